"""A topic that has only a subscriber at the far side exists here, and its first message arrives."""

import time

import pytest
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from std_msgs.msg import Int32, String

from graph import qos, until

BEST_EFFORT = ReliabilityPolicy.BEST_EFFORT
DELAY = 0.1  # of the line, each way


def test_it_has_a_type_and_one_subscriber_for_all_who_listen(pair):
    nodes = [pair.robot.node("base"), pair.robot.node("arm")]
    for node in nodes:
        pair.robot.collector(String, "/cmd_vel", qos(1, reliability=BEST_EFFORT), node=node)
    operator = pair.operator.tester
    until(lambda: pair.operator.subscriptions("/cmd_vel"), "somebody who listens")
    assert dict(operator.get_topic_names_and_types())["/cmd_vel"] == ["std_msgs/msg/String"]
    pair.robot.remove(nodes[0])
    time.sleep(1)
    assert [s.node_name for s in pair.operator.subscriptions("/cmd_vel")] == ["connect_client"]
    pair.robot.remove(nodes[1])
    until(lambda: not pair.operator.subscriptions("/cmd_vel"), "nobody listens any more")


BOTH_WAYS = {
    "rules": ["all"],
    "rule": {"all": {"export_topics": ["/t/**"], "import_topics": ["/t/**"]}},
}


def test_two_bridges_do_not_listen_to_each_other(make_pair):
    """Nor does a bridge listen to its own subscriptions."""
    first = make_pair(server=BOTH_WAYS)
    make_pair(server=BOTH_WAYS, domains=first.domains)
    base = first.robot.node("base")
    collector = first.robot.collector(String, "/t/heard", node=base)

    def bridges(graph):
        return sorted(
            s.node_name for s in graph.subscriptions("/t/heard") if s.node_name != "tester"
        )

    shown = ["connect_client", "connect_client"]
    until(lambda: bridges(first.operator) == shown, lambda: bridges(first.operator))
    time.sleep(1.5)
    assert bridges(first.operator) == shown
    assert bridges(first.robot) == ["base"]
    publisher = first.operator.publisher(String, "/t/heard")
    until(lambda: publisher.get_subscription_count() == len(shown), "all subscriptions")
    publisher.publish(String(data="once"))
    collector.wait()
    time.sleep(1)
    assert [m.data for m in collector.messages] == ["once"]
    first.operator.tester.destroy_publisher(publisher)
    first.robot.remove(base)
    until(lambda: not bridges(first.operator), lambda: bridges(first.operator))


def fresh_publishers(pair, name, collector, count, settings):
    """The first message of each publisher, published as soon as it has found a subscriber, and when
    it arrived."""
    took = []
    for number in range(count):
        collector.clear()
        node = pair.operator.node(f"fresh{number}")
        publisher = pair.operator.publisher(Int32, name, settings, node=node)
        until(publisher.get_subscription_count, "a subscription", step=0.001)
        begin = time.monotonic()
        publisher.publish(Int32(data=number))
        collector.wait()
        took.append(collector.times[0] - begin)
        time.sleep(0.3)
        assert [m.data for m in collector.messages] == [number]
        pair.operator.remove(node)
    return took


@pytest.mark.parametrize("treatment", [{}, {"max_age": 1.0}])
def test_the_first_message_of_each_publisher_arrives(relayed, treatment):
    """The link takes a tenth of a second each way, so demand comes long after the message."""
    rule = {"import_topics": ["/o/**"], **treatment}
    pair, _ = relayed(DELAY, server={"rules": ["all"], "rule": {"all": rule}})
    for settings in (qos(10), qos(1, durability=DurabilityPolicy.TRANSIENT_LOCAL)):
        collector = pair.robot.collector(Int32, "/o/first", qos(10))
        until(lambda: pair.operator.subscriptions("/o/first"), "the listener")
        took = fresh_publishers(pair, "/o/first", collector, 4, settings)
        assert min(took) < 2 * DELAY + 0.1 + 0.3, took
        collector.close()
        until(lambda: not pair.operator.subscriptions("/o/first"), "no listener")
