"""Service servers and clients for tests: which requests were executed, and which callers got
answers."""

import threading
import time

from connect_bridge_test_interfaces.srv import Echo
from rclpy.callback_groups import ReentrantCallbackGroup

from graph import WAIT, Graph, qos, until

# The default keeps 10 requests, and as many answers: a larger burst is lost in the endpoints
# themselves. The bridge hands over no more than that at once, but other callers do.
DEEP = qos(1000)

# What each side allows; services and actions go from robot to operator.
OPEN_CALLS = {
    "rules": ["all"],
    "rule": {
        "all": {
            "export_services": ["/s/**"],
            "export_actions": ["/a/**"],
            "export_topics": ["/t/**"],
        }
    },
}


def servers_graph(pair, threads, name="servers"):
    """Another node in the robot's graph, for slow servers, with a node name of its own."""
    return Graph(pair.domains[0], threads, name)


def request_of(name):
    """A request that a server and a test can recognize."""
    request = Echo.Request()
    request.tree.header.frame_id = name
    return request


def name_of(message):
    return message.tree.header.frame_id


class EchoServer:
    """Answers with what it was sent; records what it executed. `delay` in seconds, or a
    function."""

    def __init__(self, graph, service, node=None, delay=0.0, depth=DEEP):
        self.executed = []
        self.service = service
        self._depth = depth
        self._graph, self._node, self._delay = graph, node or graph.tester, delay
        self._group = ReentrantCallbackGroup()
        self._server = None
        self.start()

    def start(self):
        self._server = self._node.create_service(
            Echo, self.service, self._answer, qos_profile=self._depth, callback_group=self._group
        )

    def stop(self):
        self._node.destroy_service(self._server)

    def _answer(self, request, response):
        self.executed.append(name_of(request))
        delay = self._delay(name_of(request)) if callable(self._delay) else self._delay
        if delay:
            time.sleep(delay)
        response.tree = request.tree
        response.calls = len(self.executed)
        return response


class Caller:
    """A client that records its requests and their answers."""

    def __init__(self, graph, service, kind=Echo, node=None):
        self.service = service
        self._node = node or graph.tester
        self.client = self._node.create_client(kind, service, qos_profile=DEEP)
        self.answers = {}  # name -> list of answers
        self.asked = []
        self._lock = threading.Lock()

    def ready(self):
        return self.client.service_is_ready()

    def wait_ready(self, timeout=WAIT):
        until(self.ready, f"{self.service} is there", timeout, step=0.002)
        return self

    def wait_gone(self, timeout=WAIT):
        until(lambda: not self.ready(), f"{self.service} is gone", timeout, step=0.002)
        return self

    def call(self, request, timeout=WAIT):
        """One call; its response."""
        future = self.client.call_async(request)
        until(future.done, f"an answer of {self.service}", timeout, step=0.001)
        return future.result()

    def ask(self, name):
        """Calls an EchoServer and does not wait."""
        self.asked.append(name)

        def answered(future):
            with self._lock:
                self.answers.setdefault(name, []).append(name_of(future.result()))

        self.client.call_async(request_of(name)).add_done_callback(answered)

    def wait_answers(self, count, timeout=WAIT):
        until(
            lambda: len(self.answers) >= count,
            lambda: f"{count} answers of {self.service}, there are {len(self.answers)}",
            timeout,
        )

    def check(self):
        """Each answer came once and for the right request."""
        for name, answers in self.answers.items():
            assert answers == [name], f"{name} was answered by {answers}"

    def close(self):
        self._node.destroy_client(self.client)


def check_once(server):
    twice = {name for name in server.executed if server.executed.count(name) > 1}
    assert not twice, f"executed twice: {sorted(twice)[:5]}"


def service_entry(side, service):
    """The status of one service on the first link that has it."""
    for link in side.status().get("links", []):
        for entry in link.get("services", []):
            if entry.get("service") == service:
                return entry
    return {}
