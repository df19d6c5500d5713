"""A type that one side lacks, or has otherwise: the rest goes on, and both logs say it."""

import os
import pathlib

import pytest
from connect_bridge_test_interfaces.msg import Blob
from std_msgs.msg import Int32, String

from actions import FibonacciServer
from graph import connect, until
from harness.domains import free_port

PACKAGE = "connect_bridge_test_interfaces"
SERVER = {
    "rules": ["all"],
    "rule": {"all": {"export_topics": ["/t/**"], "export_actions": ["/a/**"]}},
}


def without_package(folder):
    """The environment of a machine on which the package is not installed."""
    prefixes = os.environ["AMENT_PREFIX_PATH"].split(":")
    folder = pathlib.Path(folder) / "lacking"
    folder.mkdir()
    for prefix in prefixes:
        for file in (pathlib.Path(prefix) / "lib").glob("*.so*"):
            if PACKAGE not in file.name and not (folder / file.name).exists():
                (folder / file.name).symlink_to(file)
    ours = {str(pathlib.Path(prefix) / "lib") for prefix in prefixes}
    others = [p for p in os.environ["LD_LIBRARY_PATH"].split(":") if p not in ours]
    return {
        "AMENT_PREFIX_PATH": str(folder),
        "LD_LIBRARY_PATH": ":".join([str(folder), *others]),
    }


@pytest.fixture
def lacking(domains, make_graph, make_side, tmp_path):
    """lacking(role): both sides, of which that one lacks the package, and their graphs."""

    class Lacking:
        def __init__(self, role):
            port, (robot, operator) = free_port(), domains(2)
            login = {"auth": {"token": "a-token-of-two-versions"}}
            env = {role: without_package(tmp_path)}
            self.robot, self.operator = make_graph(robot), make_graph(operator)
            self.server = make_side(
                "server",
                robot,
                {"listen": {"port": port}, **login, **SERVER},
                env=env.get("server", ()),
            )
            self.client = make_side(
                "client",
                operator,
                {"url": f"ws://127.0.0.1:{port}", **login},
                env=env.get("client", ()),
            )
            self.server.start().wait_listening()
            self.client.start().wait_linked()

        def carries(self):
            """Whatever else happened."""
            collector = self.operator.collector(String, "/t/text")
            connect(self.robot.publisher(String, "/t/text"), collector, String(data="x"))

    return Lacking


def lines_with(side, *words):
    return [line for line in side.text().splitlines() if all(word in line for word in words)]


def test_the_exporter_lacks_it(lacking):
    """The topic goes when it cannot be subscribed to, and the importer's log says why."""
    pair = lacking("server")
    pair.robot.publisher(Blob, "/t/blob")
    pair.operator.wait_publishers("/t/blob", 1)
    pair.operator.collector(Blob, "/t/blob")
    pair.operator.wait_publishers("/t/blob", 0)
    pair.carries()
    missing = f"the type {PACKAGE}/msg/Blob is not known here: install the package {PACKAGE}"
    assert len(lines_with(pair.server, "cannot export /t/blob: " + missing)) == 1
    (line,) = lines_with(pair.client, "cannot export /t/blob, and says: " + missing)
    assert "/connect_server at" in line


@pytest.mark.parametrize("role", ["server", "client"])
def test_an_action_that_one_side_lacks_is_one_line(lacking, role):
    pair = lacking(role)
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


def test_one_name_with_two_types(make_pair, make_graph):
    """Where one process cannot have both, the log tells both types, and whose they are."""
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
