"""What rules allow, and nothing else; no loops; limits."""

import time

import pytest
from geometry_msgs.msg import Twist
from std_msgs.msg import String

from conftest import OPEN
from graph import connect, until

MIB = 1 << 20


def settled(pair, marker):
    """Once an allowed marker topic has arrived, everything else that would arrive is there too."""
    pair.robot.publisher(String, marker)
    pair.operator.wait_publishers(marker, 1)
    time.sleep(0.5)


def test_nothing_is_allowed_by_default(make_pair):
    pair = make_pair(server={"rules": []})
    pair.robot.publisher(String, "/t/a")
    pair.operator.publisher(String, "/o/a")
    time.sleep(2)
    assert not pair.operator.publishers("/t/a")
    assert not pair.robot.publishers("/o/a")


def test_deny_wins_over_every_rule(make_pair):
    pair = make_pair(
        server={
            "rules": ["one", "two"],
            "rule": {
                "one": {"export_topics": ["/t/**"], "import_topics": ["/o/*"]},
                "two": {"export_topics": ["/t/secret/plans"], "deny": ["/t/secret/**", "/o/evil"]},
            },
        }
    )
    for name in ("/t/secret/plans", "/t/secret/a/b", "/t/open/plans"):
        pair.robot.publisher(String, name)
    for name in ("/o/evil", "/o/deep/er", "/o/good", "/t/not_an_import"):
        pair.operator.publisher(String, name)
    pair.robot.wait_publishers("/o/good", 1)
    settled(pair, "/t/marker")
    assert pair.operator.publishers("/t/open/plans")
    for name in ("/t/secret/plans", "/t/secret/a/b"):
        assert not pair.operator.publishers(name), name
    for name in ("/o/evil", "/o/deep/er", "/t/not_an_import"):
        assert not pair.robot.publishers(name), name


def test_types_narrow_a_rule(make_pair):
    pair = make_pair(
        server={
            "rules": ["drive"],
            "rule": {"drive": {"import_topics": ["/o/**"], "types": ["geometry_msgs/msg/Twist"]}},
        }
    )
    pair.operator.publisher(String, "/o/text")
    pair.operator.publisher(Twist, "/o/twist")
    pair.robot.wait_publishers("/o/twist", 1)
    time.sleep(0.5)
    assert not pair.robot.publishers("/o/text")


def test_the_client_has_rules_of_its_own(make_pair):
    pair = make_pair(
        client={
            "rules": ["some"],
            "rule": {"some": {"import_topics": ["/t/wanted/**"], "export_topics": ["/o/given"]}},
        }
    )
    pair.robot.publisher(String, "/t/wanted/a")
    pair.robot.publisher(String, "/t/unwanted")
    pair.operator.publisher(String, "/o/given")
    pair.operator.publisher(String, "/o/kept")
    pair.operator.wait_publishers("/t/wanted/a", 1)
    pair.robot.wait_publishers("/o/given", 1)
    time.sleep(0.5)
    assert not pair.operator.publishers("/t/unwanted")
    assert not pair.robot.publishers("/o/kept")


def test_prefix_and_remap_at_the_importing_side(make_pair):
    pair = make_pair(client={"prefix": "/robot1", "remap": ["/t/scan:=/laser"]})
    scans = pair.robot.publisher(String, "/t/scan")
    others = pair.robot.publisher(String, "/t/other")
    connect(scans, pair.operator.collector(String, "/laser"), String(data="scan"))
    connect(others, pair.operator.collector(String, "/robot1/t/other"), String(data="other"))
    assert not pair.operator.publishers("/t/other")
    back = pair.operator.publisher(String, "/robot1/o/back")
    connect(back, pair.robot.collector(String, "/o/back"), String(data="back"))


@pytest.mark.alone
def test_max_rate_and_max_age(make_pair):
    pair = make_pair(
        server={
            "rules": ["slow", "rest"],
            "rule": {
                "slow": {"export_topics": ["/t/slow"], "max_rate": 10.0},
                "rest": {"export_topics": ["/t/**"]},
            },
        }
    )
    publisher, collector = pair.opened(String, "/t/slow", String(data="x"))
    time.sleep(0.5)
    for _ in range(100):
        publisher.publish(String(data="x"))
        time.sleep(0.02)
    time.sleep(0.5)
    assert 15 <= len(collector.messages) <= 26, len(collector.messages)
    until(
        lambda: sum(pair.server.topic("/t/slow", "export")["dropped"].values()) >= 70,
        lambda: f"drops are counted: {pair.server.topic('/t/slow', 'export')}",
        5,
    )


LIMIT = {"max_message_size": MIB}


def check_too_large(pair, backward):
    """Each is refused and counted; the link lives and carries small messages."""
    name = "/o/sized" if backward else "/t/sized"
    publisher, collector = pair.opened(String, name, String(data="x"), backward=backward)
    for size in (2 * MIB, 10 * MIB):
        publisher.publish(String(data="x" * size))
    publisher.publish(String(data="small"))
    collector.wait_for(lambda m: m.data == "small")
    assert all(len(m.data) < MIB for m in collector.messages)

    def counted():
        entries = (side.topic(name) for side in pair.bridge.sides)
        return sum(entry.get("dropped", {}).get("too_large", 0) for entry in entries)

    until(lambda: counted() == 2, lambda: f"2 are counted, not {counted()}", 5)
    until(pair.client.links, "the client's status tells of the link", 5)  # written once a second
    assert [link["connects"] for link in pair.client.links()] == [1]


@pytest.mark.parametrize("backward", [False, True], ids=["export", "import"])
def test_a_message_beyond_the_servers_limit(make_pair, backward):
    check_too_large(make_pair(server={**OPEN, **LIMIT}), backward)


@pytest.mark.parametrize("backward", [False, True], ids=["import", "export"])
def test_a_message_beyond_the_clients_limit(make_pair, backward):
    check_too_large(make_pair(client=LIMIT), backward)


# ---- loops -------------------------------------------------------------------------------------


def numbers(collector):
    return [m.data for m in list(collector.messages) if m.data != "warm"]


def publish_numbers(publisher, count=30):
    for i in range(count):
        publisher.publish(String(data=str(i)))
        time.sleep(0.02)
    time.sleep(1)
    return [str(i) for i in range(count)]


BOTH_WAYS = {
    "rules": ["all"],
    "rule": {"all": {"export_topics": ["/t/**"], "import_topics": ["/t/**"]}},
}


@pytest.mark.alone
def test_two_bridges_between_the_same_graphs_multiply_nothing(make_pair):
    first = make_pair(server=BOTH_WAYS)
    make_pair(server=BOTH_WAYS, domains=first.domains)
    there, here = first.opened(String, "/t/out", String(data="warm"))
    back, home = first.opened(String, "/t/back", String(data="warm"), backward=True)
    time.sleep(1)
    near = first.robot.collector(String, "/t/out")
    connect(there, near, String(data="warm"))
    for publisher, collector in ((there, here), (back, home)):
        sent = publish_numbers(publisher)
        assert numbers(collector) == sent
    assert numbers(near) == [str(i) for i in range(30)], "it came back to where it started"
    for graph in (first.robot, first.operator):
        assert len(graph.publishers("/t/out")) == 1
        assert len(graph.publishers("/t/back")) == 1


def test_the_other_bridge_takes_over(make_pair):
    """With two bridges, the end of one is not the end of the topic."""
    first = make_pair(server=BOTH_WAYS)
    second = make_pair(server=BOTH_WAYS, domains=first.domains)
    publisher, collector = first.opened(String, "/t/out", String(data="warm"))
    for pair in (first, second):
        assert pair.client.stop() == 0
        collector.clear()
        connect(publisher, collector, String(data="warm"))
        pair.client.start().wait_linked()
        time.sleep(1.5)


def test_both_ends_in_one_domain_multiply_nothing(make_pair, domains):
    (domain,) = domains(1)
    pair = make_pair(server=BOTH_WAYS, domains=(domain, domain))
    publisher, collector = pair.opened(String, "/t/one", String(data="warm"))
    assert publish_numbers(publisher) == numbers(collector)
    pair.operator.wait_publishers("/t/one", 1)
