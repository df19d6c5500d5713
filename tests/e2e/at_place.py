"""Nodes in a graph that a test cannot reach itself, as it is in a network namespace: a program that
takes lines, words with a space between, and answers each with one JSON object.

  talk TOPIC       publishes its own time, 20 times a second, until the end
  heard TOPIC      {"count": of what has arrived, "last": its time of publication, or 0}
  serve SERVICE
  executed SERVICE {"names": of what was asked, in the order of its execution}
  ready SERVICE    {"ready":}
  ask SERVICE NAME does not wait for the answer
  answers SERVICE  {"names": that have an answer}
"""

import json
import os
import sys
import threading
import time

sys.dont_write_bytecode = True
sys.path[:0] = [
    os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools"),
    os.path.dirname(os.path.abspath(__file__)),
]

from std_msgs.msg import String  # noqa: E402

from calls import Caller, EchoServer  # noqa: E402
from graph import Graph  # noqa: E402


class Place:
    def __init__(self):
        self.graph = Graph(int(os.environ["ROS_DOMAIN_ID"]), name="somebody")
        self.heard_by, self.servers, self.callers = {}, {}, {}

    def talk(self, topic):
        publisher = self.graph.publisher(String, topic)

        def run():
            while True:
                publisher.publish(String(data=repr(time.monotonic())))
                time.sleep(0.05)

        threading.Thread(target=run, daemon=True).start()
        return {}

    def heard(self, topic):
        if topic not in self.heard_by:
            self.heard_by[topic] = self.graph.collector(String, topic)
        messages = self.heard_by[topic].messages
        return {"count": len(messages), "last": float(messages[-1].data) if messages else 0}

    def serve(self, service):
        self.servers[service] = EchoServer(self.graph, service)
        return {}

    def executed(self, service):
        return {"names": list(self.servers[service].executed)}

    def _caller(self, service):
        if service not in self.callers:
            self.callers[service] = Caller(self.graph, service)
        return self.callers[service]

    def ready(self, service):
        return {"ready": self._caller(service).ready()}

    def ask(self, service, name):
        self._caller(service).ask(name)
        return {}

    def answers(self, service):
        return {"names": list(self._caller(service).answers)}


def main():
    place = Place()
    print("{}", flush=True)
    for line in sys.stdin:
        verb, *words = line.split()
        print(json.dumps(getattr(place, verb)(*words)), flush=True)
    os._exit(0)


main()
