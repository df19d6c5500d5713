"""How soon a new publisher, subscriber, server or caller has its first message or response.

Their nodes are of processes that the graphs know already: discovering a new process takes the
middleware up to 3 s, also without a bridge. It should be 0.3 s and the link's round trip; the limit
is three times that, for a busy machine."""

import itertools
import statistics
import threading
import time

import pytest
from std_msgs.msg import Int32

from calls import Caller, EchoServer, request_of
from graph import Graph, qos

pytestmark = pytest.mark.alone

SERVER = {
    "rules": ["all"],
    "rule": {
        "all": {
            "export_topics": ["/t/**"],
            "import_topics": ["/t/**"],
            "export_services": ["/s/**"],
            "import_services": ["/s/**"],
        }
    },
}
CLIENT = SERVER  # without rules a client exports no services
SOON = 3 * 0.3
_number = itertools.count()


class Speaker:
    """A publisher that says what number it is at, from its beginning on."""

    def __init__(self, graph, topic, node):
        self._publisher = graph.publisher(Int32, topic, qos(10), node=node)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._speak)
        self._thread.start()

    def _speak(self):
        for number in itertools.count():
            self._publisher.publish(Int32(data=number))
            if self._ends.wait(0.005):
                return

    def close(self):
        self._ends.set()
        self._thread.join()


@pytest.fixture(scope="module")
def others(pair):
    """More of both graphs: (robot, operator)."""
    graphs = [Graph(domain, name="others") for domain in pair.domains]
    time.sleep(2)  # all processes have discovered each other
    yield graphs
    for graph in graphs:
        graph.close()


def new_publisher(near, far):
    topic = f"/t/soon{next(_number)}"
    collector = far.collector(Int32, topic, qos(10))
    time.sleep(0.3)
    begin = time.monotonic()
    speaker = Speaker(near, topic, near.node(f"near{next(_number)}"))
    collector.wait()
    speaker.close()
    return collector.times[0] - begin


def new_subscriber(near, far):
    topic = f"/t/soon{next(_number)}"
    speaker = Speaker(near, topic, near.node(f"near{next(_number)}"))
    time.sleep(0.3)
    begin = time.monotonic()
    collector = far.collector(Int32, topic, qos(10), node=far.node(f"far{next(_number)}"))
    collector.wait()
    speaker.close()
    return collector.times[0] - begin


def new_caller(near, far):
    service = f"/s/soon{next(_number)}"
    EchoServer(near, service)
    time.sleep(0.3)
    begin = time.monotonic()
    Caller(far, service).wait_ready().call(request_of("soon"))
    return time.monotonic() - begin


def new_server(near, far):
    service = f"/s/soon{next(_number)}"
    caller = Caller(far, service)
    time.sleep(0.3)
    begin = time.monotonic()
    EchoServer(near, service)
    caller.wait_ready().call(request_of("soon"))
    return time.monotonic() - begin


@pytest.mark.parametrize("new", [new_publisher, new_subscriber, new_caller, new_server])
@pytest.mark.parametrize("way", ["robot_to_operator", "operator_to_robot"])
def test_is_soon_heard(others, new, way):
    near, far = others if way == "robot_to_operator" else reversed(others)
    took = [new(near, far) for _ in range(5)]
    median = statistics.median(took)
    print(f"{new.__name__}, {way}: {median:.3f} s, {max(took):.3f} s at most")
    assert median < SOON, took
