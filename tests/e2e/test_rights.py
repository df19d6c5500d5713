"""What rules allow, and nothing else; no loops; limits."""

import time

import pytest
from std_msgs.msg import String

from graph import connect


def settled(pair, marker):
    """Once an allowed marker topic has arrived, everything else that would arrive is there too."""
    pair.robot.publisher(String, marker)
    pair.operator.wait_publishers(marker, 1)
    time.sleep(0.5)


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


def test_prefix_and_remap_at_the_importing_side(make_pair):
    pair = make_pair(client={"prefix": "/robot1", "remap": ["/t/scan:=/laser"]})
    scans = pair.robot.publisher(String, "/t/scan")
    others = pair.robot.publisher(String, "/t/other")
    connect(scans, pair.operator.collector(String, "/laser"), String(data="scan"))
    connect(others, pair.operator.collector(String, "/robot1/t/other"), String(data="other"))
    assert not pair.operator.publishers("/t/other")
    back = pair.operator.publisher(String, "/robot1/o/back")
    connect(back, pair.robot.collector(String, "/o/back"), String(data="back"))


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


def test_both_ends_in_one_domain_multiply_nothing(make_pair, domains):
    (domain,) = domains(1)
    pair = make_pair(server=BOTH_WAYS, domains=(domain, domain))
    publisher, collector = pair.opened(String, "/t/one", String(data="warm"))
    assert publish_numbers(publisher) == numbers(collector)
    pair.operator.wait_publishers("/t/one", 1)
