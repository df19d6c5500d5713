"""Topics of every size and QoS, seen on the far side as on the near one."""

import array
import hashlib
import itertools
import time

import pytest
from connect_bridge_test_interfaces.msg import Blob, Everything
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, ReliabilityPolicy
from std_msgs.msg import String

from graph import connect, everything, qos, until
from harness.programs import uses_rmw

KIB, MIB = 1 << 10, 1 << 20
SIZES = (
    0,
    1,
    3,
    100,
    1000,
    16 * KIB - 1,
    16 * KIB,
    64 * KIB + 1,
    500_000,
    2 * MIB,
    8 * MIB,
    32 * MIB,
)


def blob(sequence, size):
    return Blob(sequence=sequence, data=array.array("B", hashlib.shake_128(b"x").digest(size)))


def test_sizes_from_nothing_to_32_MiB(pair, topic):
    publisher, collector = pair.opened(Blob, topic, blob(0, 10))
    for sequence, size in enumerate(SIZES, 1):
        sent = blob(sequence, size)
        publisher.publish(sent)
        received = collector.wait(sequence)[-1]
        assert received.sequence == sequence
        assert received.data == sent.data, f"{size} bytes arrive changed"


def test_every_kind_of_field(pair, topic):
    message = everything()
    publisher, collector = pair.opened(Everything, topic, message)
    publisher.publish(message)
    assert collector.wait(1)[0] == message


def test_order_and_completeness_of_a_burst(pair, topic):
    publisher, collector = pair.opened(Blob, topic, Blob(), qos(100))
    for sequence in range(1, 2001):
        publisher.publish(Blob(sequence=sequence))
        if sequence % 50 == 0:  # the depth of the queues is 100
            collector.wait(sequence)
    assert [m.sequence for m in collector.messages] == list(range(1, 2001))


def described(info):
    """The graph's information about an endpoint, without its identity."""
    profile = info.qos_profile
    return (
        info.topic_type,
        str(info.topic_type_hash),
        profile.reliability,
        profile.durability,
        profile.deadline.nanoseconds,
        profile.lifespan.nanoseconds,
        profile.liveliness,
        profile.liveliness_lease_duration.nanoseconds,
    )


def combinations():
    none = {}
    deadline = {"deadline": Duration(seconds=5)}
    lifespan = {"lifespan": Duration(seconds=7)}
    for reliability, durability, times in itertools.product(
        (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT),
        (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL),
        (none, deadline, lifespan, {**deadline, **lifespan}),
    ):
        yield qos(10, reliability=reliability, durability=durability, **times)
    yield qos(
        10, liveliness=LivelinessPolicy.AUTOMATIC, liveliness_lease_duration=Duration(seconds=9)
    )


def test_all_combinations_of_qos(pair):
    """The mirror has its origin's QoS, and a subscriber with exactly that QoS is served."""
    profiles = {f"/t/qos_{i}": profile for i, profile in enumerate(combinations())}
    publishers = {name: pair.robot.publisher(String, name, p) for name, p in profiles.items()}
    for name in profiles:
        (mirror,) = pair.operator.wait_publishers(name, 1)
        (origin,) = pair.robot.publishers(name)
        assert described(mirror) == described(origin), name
    collectors = {n: pair.operator.collector(String, n, p) for n, p in profiles.items()}
    for name, publisher in publishers.items():
        connect(publisher, collectors[name], String(data="first"))
        publisher.publish(String(data=name))
    for name, collector in collectors.items():
        collector.wait_for(lambda m, name=name: m.data == name, name)
        assert len([m for m in collector.messages if m.data == name]) == 1


def test_qos_is_adapted_when_publishers_change(pair, topic):
    """A reliable subscriber gets the reliable publisher's messages, whatever other publishers
    exist."""
    best_effort = pair.robot.publisher(
        String, topic, qos(10, reliability=ReliabilityPolicy.BEST_EFFORT)
    )
    collector = pair.operator.collector(
        String, topic, qos(10, reliability=ReliabilityPolicy.BEST_EFFORT)
    )
    connect(best_effort, collector, String(data="a"))
    reliable = pair.robot.publisher(String, topic)
    late = pair.operator.collector(String, topic)
    connect(reliable, late, String(data="b"))
    reliable.publish(String(data="c"))
    best_effort.publish(String(data="d"))
    collector.wait_for(lambda m: m.data == "c")
    collector.wait_for(lambda m: m.data == "d")
    late.wait_for(lambda m: m.data == "c")
    if not uses_rmw("rmw_zenoh_cpp"):  # which joins all
        assert all(m.data != "d" for m in late.messages)


@pytest.mark.skipif(
    uses_rmw("rmw_zenoh_cpp"), reason="rmw_zenoh_cpp joins any QoS"
)
def test_an_incompatible_pair_is_warned_about_by_name(pair, topic):
    pair.robot.publisher(String, topic, qos(10, reliability=ReliabilityPolicy.BEST_EFFORT))
    pair.operator.wait_publishers(topic, 1)
    pair.operator.collector(String, topic, qos(10, reliability=ReliabilityPolicy.RELIABLE))

    def warnings():
        lines = pair.client.text().splitlines()
        return [line for line in lines if topic in line and "reliability" in line.lower()]

    until(warnings, "a warning that names topic and policy")
    time.sleep(1)
    (line,) = warnings()
    assert "/tester requests" in line and "and /tester on the other side offers" in line


def test_names_types_and_publisher_counts_are_equal(pair):
    nodes = [pair.robot.node(f"counted_{i}") for i in range(3)]
    for node in nodes:
        pair.robot.publisher(String, "/t/counted", 10, node)
    pair.robot.publisher(String, "/t/counted", 10, nodes[0])
    pair.robot.publisher(Blob, "/t/counted_too", 10, nodes[1])
    pair.operator.wait_publishers("/t/counted", 4)
    pair.operator.wait_publishers("/t/counted_too", 1)

    def ours(graph):
        return {n: t for n, t in graph.topics().items() if n.startswith("/t/counted")}

    assert ours(pair.operator) == ours(pair.robot)
    pair.robot.remove(nodes[0])
    pair.operator.wait_publishers("/t/counted", 2)
    pair.robot.remove(nodes[1])
    pair.operator.wait_publishers("/t/counted_too", 0)
    pair.robot.remove(nodes[2])
    pair.operator.wait_publishers("/t/counted", 0)
