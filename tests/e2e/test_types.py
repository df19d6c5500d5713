"""A type that one side lacks or has with another definition: the rest goes on, and both logs say
so."""

import json
import os
import pathlib

import pytest
from connect_bridge_test_interfaces.msg import Blob, Tree
from std_msgs.msg import Int32, String
from type_description_interfaces.srv import GetTypeDescription

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

    told = "is not installed here: its messages are carried unchecked"
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


def test_what_both_lack_is_described_by_its_node(domains, make_graph, make_side):
    """The server asks the publisher's node what the type is made of, and tells the client, which
    checks messages by it."""
    port, (robot, operator) = free_port(), domains(2)
    login = {"auth": {"token": "a-token-of-two-that-lack"}}
    listen = {"listen": {"port": port}, **login, **SERVER}
    server = make_side("server", robot, listen)
    client = make_side("client", operator, {"url": f"ws://127.0.0.1:{port}", **login})
    for side in (server, client):
        take_away([PACKAGE], side)
    server.start().wait_listening()
    client.start().wait_linked()
    robots, operators = make_graph(robot), make_graph(operator)
    blobs, blob = robots.publisher(Blob, "/t/blob"), Blob(data=bytes(range(200)) * 100)
    operators.wait_publishers("/t/blob", 1)
    described = lambda: client.status().get("types_described")  # noqa: E731
    until(lambda: described() == 1, lambda: f"{described()} types: {client.text()}", timeout=30)
    collector = operators.collector(Blob, "/t/blob")
    connect(blobs, collector, blob)
    blobs.publish(blob)
    assert collector.wait()[0] == blob
    robots.tester.destroy_publisher(blobs)
    until(lambda: described() == 0, lambda: f"{described()} types are left")


@needs_services
def test_services_and_actions_are_described_too(lacking):
    """The client checks answers, results and feedback by what the server tells."""
    pair = lacking("client")
    echo, fibonacci = EchoServer(pair.robot, "/s/echo"), FibonacciServer(pair.robot, "/a/fib")
    caller = Caller(pair.operator, "/s/echo").wait_ready()
    client = Client(pair.operator, "/a/fib")
    until(client.server_is_ready, "the action is ready")
    described = lambda: pair.client.status().get("types_described")  # noqa: E731
    until(lambda: described() == 2 + 5, lambda: f"{described()} types: {pair.client.text()}")
    for number in range(20):
        request = request_of("x" * number * number)
        assert caller.call(request).tree == request.tree
    goal = Goal(client, 5)
    assert list(goal.result().result.sequence) == [0, 1, 1, 2, 3, 5]
    client.destroy()
    caller.close()
    echo.stop()
    fibonacci.stop()
    until(lambda: described() == 0, lambda: f"{described()} types are left")


def asked(graph, node, kind, type_hash, sources=True):
    """What a node says about a type."""
    client = graph.tester.create_client(GetTypeDescription, node + "/get_type_description")
    until(client.service_is_ready, f"{node} tells of its types")
    request = GetTypeDescription.Request(type_name=kind, include_type_sources=sources)
    request.type_hash = str(type_hash)
    future = client.call_async(request)
    until(future.done, f"{node} answers")
    graph.tester.destroy_client(client)
    return future.result()


def test_a_mirrors_node_tells_what_its_type_is(lacking):
    """As the robot's own node does: the whole description, to a client of ROS."""
    pair = lacking("client")
    camera = pair.robot.node("camera")
    trees = camera.create_publisher(Tree, "/t/tree", 10)
    (info,) = pair.operator.wait_publishers("/t/tree", 1)
    owners = lambda: [i.node_name for i in pair.operator.publishers("/t/tree")]  # noqa: E731
    until(lambda: owners() == ["camera"], lambda: f"its node, not {owners()}")
    kind = f"{PACKAGE}/msg/Tree"
    real = asked(pair.robot, "/camera", kind, info.topic_type_hash)
    assert real.successful, real.failure_reason

    def without_defaults(description):
        for each in [description.type_description, *description.referenced_type_descriptions]:
            for field in each.fields:
                field.default_value = ""
        return description

    for node in ("/camera", "/connect_client"):
        told = asked(pair.operator, node, kind, info.topic_type_hash)
        assert told.successful, told.failure_reason
        assert told.type_description == without_defaults(real.type_description)
        names = [told.type_description.type_description.type_name]
        names += [t.type_name for t in told.type_description.referenced_type_descriptions]
        sources = [(s.type_name, s.encoding, s.raw_file_contents) for s in told.type_sources]
        assert sources == [(name, "dynamic", "") for name in names]
    assert not asked(pair.operator, "/camera", kind, info.topic_type_hash, False).type_sources
    # What is installed at the bridge is known, too; another hash is not.
    text = pair.robot.publisher(String, "/t/text")
    (info,) = pair.operator.wait_publishers("/t/text", 1)
    assert asked(pair.operator, "/camera", "std_msgs/msg/String", info.topic_type_hash).successful
    told = asked(pair.operator, "/camera", kind, info.topic_type_hash)
    assert not told.successful and "with this hash is not known here" in told.failure_reason
    camera.destroy_publisher(trees)
    pair.robot.tester.destroy_publisher(text)
    services = lambda: dict(pair.operator.tester.get_service_names_and_types())  # noqa: E731
    until(lambda: "/camera/get_type_description" not in services(), "it goes with the mirror")


def hash_of(kind):
    """Of an installed type, as its package says."""
    for prefix in os.environ["AMENT_PREFIX_PATH"].split(":"):
        file = pathlib.Path(prefix, "share", kind + ".json")
        if file.exists():
            return json.loads(file.read_text(encoding="utf-8"))["type_hashes"][0]["hash_string"]
    raise AssertionError(f"{kind} is not installed")


@needs_services
def test_a_mirrors_node_tells_what_a_service_is(lacking):
    pair = lacking("client")
    robots = pair.robot.node("teller")
    echo = EchoServer(pair.robot, "/s/echo", node=robots)
    caller = Caller(pair.operator, "/s/echo").wait_ready()
    kind = f"{PACKAGE}/srv/Echo"
    told = asked(pair.operator, "/teller", kind, hash_of(kind))
    assert told.successful, told.failure_reason
    nested = [t.type_name for t in told.type_description.referenced_type_descriptions]
    assert f"{kind}_Request" in nested and f"{kind}_Response" in nested
    caller.close()
    echo.stop()


def test_the_exporter_lacks_it(lacking):
    """Nothing of it is offered, and the importer's log says why before anybody asks for it."""
    pair = lacking("server", types_not_installed="refuse")
    echo = EchoServer(pair.robot, "/s/echo")
    for name in ("/t/blob", "/t/other"):
        pair.robot.publisher(Blob, name)

    def missing(kind):
        return f"the type {PACKAGE}/{kind} is not known here: install the package"

    for kind in ("msg/Blob", "srv/Echo"):
        until(lambda: lines_with(pair.client, missing(kind)), pair.client.text)  # noqa: B023
    pair.operator.collector(Blob, "/t/blob")
    pair.carries()
    assert not pair.operator.publishers("/t/blob") and not pair.operator.publishers("/t/other")
    assert "/s/echo" not in dict(pair.operator.tester.get_service_names_and_types())
    for name, kind in (("/t/blob", "msg/Blob"), ("/s/echo", "srv/Echo")):
        assert len(lines_with(pair.server, missing(kind))) == 1, pair.server.text()
        assert len(lines_with(pair.client, missing(kind))) == 1, pair.client.text()
        assert lines_with(pair.server, f"cannot export {name}: " + missing(kind))
        (line,) = lines_with(pair.client, f"cannot export {name}, and says: " + missing(kind))
        assert "/connect_server at" in line
    echo.stop()


@pytest.mark.parametrize("role", ["server", "client"])
def test_an_action_that_one_side_lacks_is_one_line(lacking, role):
    pair = lacking(role, types_not_installed="refuse")
    server = FibonacciServer(pair.robot, "/a/fib")
    missing = f"the type {PACKAGE}/action/Fibonacci is not known here"
    here, there = (pair.server, pair.client) if role == "server" else (pair.client, pair.server)
    until(lambda: lines_with(there, "says: " + missing), "the other side is told")
    pair.carries()
    assert len(lines_with(here, missing)) == 1, here.text()
    assert len(lines_with(there, missing)) == 1, there.text()
    verb = "cannot export" if role == "server" else "cannot mirror"
    assert lines_with(here, f"{verb} the action /a/fib: ")
    server.stop()


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
