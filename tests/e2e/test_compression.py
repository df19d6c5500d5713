"""`compression: auto`: bytes on the wire against those without, on a long path and on none."""

import math
import time

import pytest
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from graph import until
from sanitizer import not_under_a_sanitizer

HEADER_BYTES = 44  # of a message, protocol.md section 6
MESSAGES = 100
SERVER = {
    "rules": ["plain", "all"],
    "rule": {
        "plain": {"export_topics": ["/t/plain"], "compression": "none"},
        "all": {"export_topics": ["/t/**"]},  # with the default compression
    },
}


def tf(count):
    """50 frames of a robot, 50 times a second: joints turn about an axis, offsets stay."""
    message = TFMessage()
    seconds = 1_700_000_000 + count * 0.02
    for joint in range(50):
        frame = TransformStamped()
        frame.header.stamp.sec = int(seconds)
        frame.header.stamp.nanosec = int(seconds % 1 * 1e9)
        frame.header.frame_id = f"robot/link_{joint}"
        frame.child_frame_id = f"robot/link_{joint + 1}"
        frame.transform.translation.x = 0.1234 * joint
        frame.transform.translation.z = 0.77
        angle = math.sin(count * 0.02 + joint)
        frame.transform.rotation.z = math.sin(angle / 2)
        frame.transform.rotation.w = math.cos(angle / 2)
        message.transforms.append(frame)
    return message


def wire_bytes(side, topic):
    status = side.topic(topic)
    return status["wire_bytes"] + status["messages"] * HEADER_BYTES


def send_all(pair):
    """The same messages compressed and plain; the bytes of both on the wire."""
    topics = ["/t/auto", "/t/plain"]
    ends = [pair.opened(TFMessage, topic, tf(0), qos=MESSAGES) for topic in topics]
    until(lambda: all(pair.server.topic(topic) for topic in topics), "status")
    time.sleep(1.5)  # the round trip is measured and in the status
    before = [wire_bytes(pair.server, topic) for topic in topics]
    count = [pair.server.topic(topic)["messages"] for topic in topics]
    for _, collector in ends:
        collector.clear()
    sent = [tf(number) for number in range(1, MESSAGES + 1)]
    for message in sent:
        for publisher, _ in ends:
            publisher.publish(message)
        time.sleep(0.02)
    for _, collector in ends:
        assert list(collector.wait(MESSAGES)) == sent

    def told():
        return all(
            pair.server.topic(topic)["messages"] >= old + MESSAGES
            for topic, old in zip(topics, count)
        )

    until(told, "status")
    return [wire_bytes(pair.server, topic) - old for topic, old in zip(topics, before)]


def test_on_a_long_path(relayed):
    """Of other types: tests/unit/flow/delta_ratio_test.cpp."""
    pair, _ = relayed(0.02, server=SERVER)
    small, plain = send_all(pair)
    print(f"{100 * small / plain:.1f} % of {plain / MESSAGES:.0f} bytes")
    assert small <= 0.35 * plain


@pytest.mark.alone
def test_nothing_on_a_short_one(make_pair):
    not_under_a_sanitizer("that a short path has plain messages: no path is so short")
    pair = make_pair(server=SERVER)
    # On a machine that is busy meanwhile the path is long for a moment.
    rounds = []
    while not rounds or (rounds[-1][0] != rounds[-1][1] and len(rounds) < 4):
        rounds.append(send_all(pair))
    small, plain = rounds[-1]
    assert small == plain, rounds
