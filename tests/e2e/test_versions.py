"""A message package of two versions at the two ends: the log says how they differ, and a rule may
use the messages nevertheless."""

import pytest
from connect_bridge_test_interfaces.msg import Blob
from std_msgs.msg import String

from graph import connect, until
from harness.domains import free_port
from versions import with_another_blob

BLOB = "uint64 sequence\nint64 sent_ns\nuint8[] data\n"
TYPE = "connect_bridge_test_interfaces/msg/Blob"


@pytest.fixture
def versions(domains, make_graph, make_side, tmp_path):
    """versions(message, rule): the client's package has this Blob.msg, the robot's the usual
    one."""

    class Versions:
        def __init__(self, message, **rule):
            port, (robot, operator) = free_port(), domains(2)
            login = {"auth": {"token": "a-token-of-two-versions"}}
            exports = {"rules": ["all"], "rule": {"all": {"export_topics": ["/t/**"]}}}
            imports = {"rules": ["all"], "rule": {"all": {"import_topics": ["/t/**"], **rule}}}
            self.robot, self.operator = make_graph(robot), make_graph(operator)
            self.server = make_side("server", robot, {"listen": {"port": port}, **login, **exports})
            self.client = make_side(
                "client",
                operator,
                {"url": f"ws://127.0.0.1:{port}", **login, **imports},
                env=with_another_blob(tmp_path / "other", message),
            )
            self.server.start().wait_listening()
            self.client.start().wait_linked()

        def lines(self, *words):
            text = self.client.text().splitlines()
            return [line for line in text if all(word in line for word in words)]

    return Versions


def test_a_field_more_is_told_at_once(versions):
    pair = versions(BLOB + "float64[36] covariance\n")
    pair.robot.publisher(Blob, "/t/one")
    pair.robot.publisher(Blob, "/t/two")
    told = f"the definition of {TYPE} here"
    (line,) = until(lambda: pair.lines(told), lambda: pair.client.text())
    for words in (
        "cannot mirror /t/",
        f"the definition of {TYPE} here (RIHS01_",
        "/connect_server at ",
        "Install the same version of ",
        "allow_type_mismatch",
    ):
        assert words in line, line
    declined = "does not import /t/one"
    until(lambda: declined in pair.server.text(), lambda: pair.server.text())
    collector = pair.operator.collector(String, "/t/text")
    connect(pair.robot.publisher(String, "/t/text"), collector, String(data="x"))
    assert len(pair.lines(told)) == 1, pair.client.text()
    assert not pair.operator.publishers("/t/one")


def counts(pair, blobs):
    """Of /t/blob at the client: messages, and those that were no message of the type there. (Nodes
    of the client's version would receive them; the ones here have the robot's, with which the
    middleware does not connect the mirror.)"""
    blobs.publish(Blob(data=b"small"))
    topic = pair.client.topic("/t/blob")
    return topic.get("messages", 0), topic.get("dropped", {}).get("publish_failed", 0)


def test_a_rule_may_use_it_nevertheless(versions):
    """A field has another name, so that the messages fit."""
    pair = versions(BLOB.replace("sent_ns", "sent"), allow_type_mismatch=True)
    blobs = pair.robot.publisher(Blob, "/t/blob")
    pair.operator.collector(Blob, "/t/blob")
    until(lambda: counts(pair, blobs)[0] > 10, lambda: pair.client.text())
    assert counts(pair, blobs)[1] == 0
    (line,) = pair.lines(f"the definition of {TYPE} here (RIHS01_")
    assert "Messages that do not fit the definition here are dropped" in line
