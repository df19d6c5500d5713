"""The tests' own graph: what comes and goes in it while its callbacks run, and how it fails."""

import sys
import time

import pytest
from std_msgs.msg import String

from actions import Client, FibonacciServer, Goal
from graph import until

ROUNDS = 150


@pytest.fixture
def busy():
    """Threads take turns as on a machine that has little time for them."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    yield
    sys.setswitchinterval(before)


def test_callbacks_outlive_what_comes_and_goes(busy, domains, make_graph):
    (domain,) = domains(1)
    robot, operator = make_graph(domain), make_graph(domain)
    kept = FibonacciServer(robot, "/a/kept")
    client = Client(operator, "/a/kept")
    until(client.server_is_ready, "the action is ready")
    for _ in range(ROUNDS):
        server, passing = FibonacciServer(robot, "/a/passing"), Client(operator, "/a/passing")
        collector = operator.collector(String, "/t/passing")
        assert Goal(client, 1, period_ms=0).handle.accepted
        collector.close()
        passing.destroy()
        server.stop()
    until(lambda: kept.goals == ROUNDS, lambda: f"{ROUNDS} goals, there were {kept.goals}")


def test_an_exception_in_a_callback_is_told_at_once(domains, make_graph):
    (domain,) = domains(1)
    graph = make_graph(domain)

    def fails():
        raise ValueError("of this test")

    graph.tester.create_timer(0.01, fails)
    begin = time.monotonic()
    with pytest.raises(AssertionError, match="of this test"):
        until(lambda: False, "nothing")
    assert time.monotonic() - begin < 10
