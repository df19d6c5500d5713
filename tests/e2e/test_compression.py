"""`compression: auto`: bytes on the wire against those without, on a long path and on none."""

import array
import math
import random
import time

import pytest
from geometry_msgs.msg import TransformStamped
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CompressedImage, JointState, LaserScan
from tf2_msgs.msg import TFMessage

from graph import until
from sanitizer import not_under_a_sanitizer

PARTS = 2  # that run side by side

HEADER_BYTES = 44  # of a message, protocol.md section 6
MESSAGES = 100
NOISE = random.Random(1)
# All pictures may wait: while other tests use the processors, the relay is too slow for them.
QUEUE = {"queue_bytes_max": 8 << 20}
SERVER = {
    "rules": ["plain", "all"],
    "rule": {
        "plain": {"export_topics": ["/t/plain/**"], "compression": "none", **QUEUE},
        "all": {"export_topics": ["/t/**"], **QUEUE},  # with the default compression
    },
}


def stamp(header, count, period):
    seconds = 1_700_000_000 + count * period
    header.stamp.sec = int(seconds)
    header.stamp.nanosec = int(seconds % 1 * 1e9)


def tf(count):
    """50 frames of a robot, 50 times a second: joints turn about an axis, offsets stay."""
    message = TFMessage()
    for joint in range(50):
        frame = TransformStamped()
        stamp(frame.header, count, 0.02)
        frame.header.frame_id = f"robot/link_{joint}"
        frame.child_frame_id = f"robot/link_{joint + 1}"
        frame.transform.translation.x = 0.1234 * joint
        frame.transform.translation.z = 0.77
        angle = math.sin(count * 0.02 + joint)
        frame.transform.rotation.z = math.sin(angle / 2)
        frame.transform.rotation.w = math.cos(angle / 2)
        message.transforms.append(frame)
    return message


def joints(count):
    """30 joints with encoders of 4096 steps."""
    message = JointState()
    stamp(message.header, count, 0.02)
    step = 2 * math.pi / 4096
    message.name = [f"left_arm_joint_{joint}" for joint in range(30)]
    message.position = [round(math.sin(count * 0.006 + j) / step) * step for j in range(30)]
    message.velocity = [round(math.cos(count * 0.006 + j) * 100) / 100 for j in range(30)]
    return message


def scan(count):
    """1080 rays in a room, in millimetres with noise of 5, and intensities."""
    message = LaserScan(angle_min=-2.35, angle_max=2.35, angle_increment=0.00436)
    stamp(message.header, count, 0.1)
    message.header.frame_id = "laser"
    for ray in range(1080):
        angle = ray * 0.00436 + count * 0.001
        wall = 3 / max(abs(math.cos(angle)), abs(math.sin(angle)))
        message.ranges.append(round(wall + NOISE.gauss(0, 0.005), 3))
        echo = 800 + 200 * math.cos(ray / 100) + NOISE.gauss(0, 5)
        message.intensities.append(float(round(echo)))
    return message


def picture(count):
    """Bytes that do not compress, like a JPEG."""
    message = CompressedImage(format="jpeg")
    stamp(message.header, count, 0.02)
    message.data = array.array("B", NOISE.randbytes(30_000))
    return message


KINDS = {
    "tf": (TFMessage, tf, 0.35),
    "joints": (JointState, joints, 0.35),
    "scan": (LaserScan, scan, 0.70),
    "picture": (CompressedImage, picture, 1.005),
}


def wire_bytes(side, topic):
    status = side.topic(topic)
    return status["wire_bytes"] + status["messages"] * HEADER_BYTES


def send_all(pair, name):
    """The same messages compressed and plain; the bytes of both on the wire."""
    kind, make, _ = KINDS[name]
    topics = [f"/t/{how}/{name}" for how in ("auto", "plain")]
    ends = [pair.opened(kind, topic, make(0), qos=MESSAGES) for topic in topics]
    until(lambda: all(pair.server.topic(topic) for topic in topics), "status")
    time.sleep(1.5)  # the round trip is measured and in the status
    before = [wire_bytes(pair.server, topic) for topic in topics]
    count = [pair.server.topic(topic)["messages"] for topic in topics]
    for _, collector in ends:
        collector.clear()
    sent = [make(number) for number in range(1, MESSAGES + 1)]
    # As numbers of 32 bits have them.
    stored = [deserialize_message(serialize_message(message), kind) for message in sent]
    for message in sent:
        for publisher, _ in ends:
            publisher.publish(message)
        time.sleep(0.02)
    for _, collector in ends:
        assert list(collector.wait(MESSAGES)) == stored

    def told():
        return all(
            pair.server.topic(topic)["messages"] >= old + MESSAGES
            for topic, old in zip(topics, count)
        )

    until(told, "status")
    return [wire_bytes(pair.server, topic) - old for topic, old in zip(topics, before)]


@pytest.mark.parametrize("name", KINDS)
def test_on_a_long_path(relayed, name):
    pair, _ = relayed(0.02, server=SERVER)
    small, plain = send_all(pair, name)
    print(f"{name}: {100 * small / plain:.1f} % of {plain / MESSAGES:.0f} bytes")
    assert small <= KINDS[name][2] * plain


@pytest.mark.alone
def test_nothing_on_a_short_one(make_pair):
    not_under_a_sanitizer("that a short path has plain messages: no path is so short")
    pair = make_pair(server=SERVER)
    # On a machine that is busy meanwhile the path is long for a moment.
    rounds = []
    while not rounds or (rounds[-1][0] != rounds[-1][1] and len(rounds) < 4):
        rounds.append(send_all(pair, "tf"))
    small, plain = rounds[-1]
    assert small == plain, rounds
