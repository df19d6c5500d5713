"""A type that one side lacks or has with another definition: the rest goes on, and the
logs say so."""

import pytest
from connect_bridge_test_interfaces.msg import Blob
from std_msgs.msg import Int32, String

from actions import Client, FibonacciServer, Goal
from calls import Caller, EchoServer, request_of
from graph import Graph, connect, until
from harness.domains import free_port
from harness.programs import uses_rmw
from lacking import TEST_PACKAGE as PACKAGE
from lacking import take_away

SERVER = {
    "rules": ["all"],
    "rule": {
        "all": {
            "export_topics": ["/t/**"],
            "export_services": ["/s/**"],
            "export_actions": ["/a/**"],
        }
    },
}


@pytest.fixture
def lacking(domains, make_graph, make_side):
    """lacking(role, ...): both sides, of which that one lacks the package, and their graphs; with
    parameters for both."""

    class Lacking:
        def __init__(self, role, **more):
            port, (robot, operator) = free_port(), domains(2)
            login = {"auth": {"token": "a-token-of-two-versions"}, **more}
            self.robot, self.operator = make_graph(robot), make_graph(operator)
            listen = {"listen": {"port": port}, **login, **SERVER}
            self.server = make_side("server", robot, listen)
            self.client = make_side("client", operator, {"url": f"ws://127.0.0.1:{port}", **login})
            take_away([PACKAGE], self.server if role == "server" else self.client)
            self.server.start().wait_listening()
            self.client.start().wait_linked()

        def carries(self):
            """The link still carries messages, whatever else happened."""
            collector = self.operator.collector(String, "/t/text")
            connect(self.robot.publisher(String, "/t/text"), collector, String(data="x"))

    return Lacking


# There the types of services must be installed; topics are in test_rmw.py.
needs_services = pytest.mark.skipif(
    uses_rmw("rmw_cyclonedds_cpp"),
    reason="rmw_cyclonedds_cpp reads requests by their fields",
)


def lines_with(side, *words):
    return [line for line in side.text().splitlines() if all(word in line for word in words)]


# The graph does not tell the hash of a service's type, and there endpoints find each other by it.
without_type = pytest.mark.skipif(
    uses_rmw("rmw_zenoh_cpp"),
    reason="with rmw_zenoh_cpp the exporter calls only services of installed types",
)


@needs_services
@pytest.mark.parametrize("role", [pytest.param("server", marks=without_type), "client"])
def test_what_one_side_lacks_is_carried(lacking, role):
    """Its log says once per type that messages are carried unchecked; the other side has the
    type."""
    pair = lacking(role)
    here = pair.server if role == "server" else pair.client
    blobs, blob = pair.robot.publisher(Blob, "/t/blob"), Blob(data=bytes(range(200)) * 100)
    (robots,) = until(lambda: pair.robot.publishers("/t/blob"), "the publisher")
    (mirror,) = pair.operator.wait_publishers("/t/blob", 1)
    assert mirror.topic_type == f"{PACKAGE}/msg/Blob"
    assert mirror.topic_type_hash == robots.topic_type_hash
    collector = pair.operator.collector(Blob, "/t/blob")
    connect(blobs, collector, blob)
    blobs.publish(blob)
    assert collector.wait()[0] == blob

    servers = Graph(pair.robot.domain, 4, "servers")
    echo, fibonacci = EchoServer(servers, "/s/echo"), FibonacciServer(servers, "/a/fib")
    caller = Caller(pair.operator, "/s/echo").wait_ready()
    for number in range(20):
        request = request_of("x" * number * number)
        assert caller.call(request).tree == request.tree
    client = Client(pair.operator, "/a/fib")
    until(client.server_is_ready, "the action is ready")
    goal = Goal(client, 5)
    assert goal.handle.accepted
    until(lambda: goal.feedback, "feedback")
    assert list(goal.result().result.sequence) == [0, 1, 1, 2, 3, 5]

    told = "is not installed here: its messages are forwarded unchecked"
    for type_name in ("msg/Blob", "srv/Echo", "action/Fibonacci"):
        assert len(lines_with(here, f"the type {PACKAGE}/{type_name} {told}")) == 1, here.text()
    assert len(lines_with(here, told)) == 3
    made = lambda: here.status().get("types_not_installed")  # noqa: E731
    # Two of a service; of an action two services and the feedback, the rest is of action_msgs.
    until(lambda: made() == 1 + 2 + 5, lambda: f"{made()} types")
    pair.robot.tester.destroy_publisher(blobs)
    collector.close()
    client.destroy()
    caller.close()
    echo.stop()
    fibonacci.stop()
    until(lambda: made() == 0, lambda: f"{made()} types are left")
    servers.close()


def test_the_exporter_lacks_it(lacking):
    """Nothing of it is offered, and its log says why before anybody asks for it."""
    pair = lacking("server", types_not_installed="refuse")
    echo = EchoServer(pair.robot, "/s/echo")
    for name in ("/t/blob", "/t/other"):
        pair.robot.publisher(Blob, name)

    def missing(kind):
        return f"the type {PACKAGE}/{kind} is not known here: install the package"

    for kind in ("msg/Blob", "srv/Echo"):
        until(lambda: lines_with(pair.server, missing(kind)), pair.server.text)  # noqa: B023
    pair.operator.collector(Blob, "/t/blob")
    pair.carries()
    assert not pair.operator.publishers("/t/blob") and not pair.operator.publishers("/t/other")
    assert "/s/echo" not in dict(pair.operator.tester.get_service_names_and_types())
    for name, kind in (("/t/blob", "msg/Blob"), ("/s/echo", "srv/Echo")):
        assert len(lines_with(pair.server, missing(kind))) == 1, pair.server.text()
        assert lines_with(pair.server, f"cannot export {name}: " + missing(kind))
    echo.stop()


@pytest.mark.skipif(
    uses_rmw("rmw_zenoh_cpp") or uses_rmw("rmw_cyclonedds_cpp"),
    reason="there one process can have both",
)
def test_one_name_with_two_types(make_pair, make_graph):
    """Where one process cannot have both, the log names both types and their nodes."""
    pair = make_pair(client={"rules": ["a"], "rule": {"a": {"import_topics": ["/t/**"]}}})
    texts, letters = pair.opened(String, "/t/two", String(data="x"))
    other = make_graph(pair.domains[0])
    numbers = other.node("counter")
    numbers.create_publisher(Int32, "/t/two", 10)
    until(lambda: len(pair.robot.topics()["/t/two"]) == 2, "both types at the robot")
    pair.operator.wait_publishers("/t/two", 1)
    told = until(
        lambda: lines_with(pair.client, "cannot mirror /t/two of /counter: "),
        lambda: pair.client.text(),
    )
    assert len(told) == 1
    for word in ("std_msgs/msg/String (", "/tester", "cannot have the type std_msgs/msg/Int32"):
        assert word in told[0]
    until(lambda: lines_with(pair.server, "does not import /t/two", "(type_mismatch)"), "told")
    texts.publish(String(data="y"))
    letters.wait_for(lambda m: m.data == "y")
