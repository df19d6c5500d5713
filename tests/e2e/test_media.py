"""Pictures and clouds: bit for bit where the link carries them, else within the rule's error."""

import struct
import time

import pytest
from sensor_msgs.msg import Image, PointCloud2, PointField

from conftest import OPEN
from graph import until
from sanitizer import not_under_a_sanitizer

CAP = 100_000  # bytes per second
POINTS = 10_000
NAN = struct.unpack("<f", struct.pack("<I", 0x7FC00001))[0]


def image(number):
    """A gradient that moves, with padded rows."""
    made = Image(height=480, width=640, encoding="rgb8", step=1936)
    made.header.stamp.sec = number
    made.header.frame_id = "camera"
    row = bytes((x // 9 + 30 * (x % 3) + x * 7 % 3) % 256 for x in range(1936))
    made.data.frombytes(b"".join(row[y % 5 :] + row[: y % 5] for y in range(number, number + 480)))
    return made


def cloud(number):
    """Rings with an intensity; every 100th point is missing."""
    made = PointCloud2(height=1, width=POINTS, point_step=16, row_step=16 * POINTS)
    made.header.stamp.sec = number
    names = ("x", "y", "z", "intensity")
    made.fields = [
        PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
        for i, name in enumerate(names)
    ]
    values = []
    for i in range(POINTS):
        far = 8 + (i * 2654435761 % 97) / 900 + (i + number) % 16 / 4
        x = NAN if i % 100 == 0 else far * (i % 625) / 625
        values += (x, far * (1 - (i % 625) / 625), far * (i % 16) / 40, float(i * 7919 % 90))
    made.data.frombytes(struct.pack(f"<{4 * POINTS}f", *values))
    return made


def floats(message):
    return struct.unpack(f"<{4 * POINTS}f", message.data.tobytes())


def form(pair, topic):
    return [(side.topic(topic) or {}).get("sent_as") for side in (pair.server, pair.client)]


def test_a_picture_is_bit_for_bit(relayed):
    pair, _ = relayed(0.02, server=OPEN)
    publisher, collector = pair.opened(Image, "/t/image", image(0))
    collector.clear()
    for number in range(1, 6):
        sent = image(number)
        publisher.publish(sent)
        assert list(collector.wait(1)) == [sent]
        collector.clear()
    until(lambda: form(pair, "/t/image") == ["planes", "planes"], "status")
    topic = pair.server.topic("/t/image")
    assert topic["wire_bytes"] < 0.7 * topic["bytes"]
    assert "sent_as_step" not in topic


@pytest.mark.slow
@pytest.mark.parametrize("end", [None, "server", "client"])
def test_a_cloud_on_a_thin_link(make_pair, end):
    """Ten a second of 160 kB, where one exact one fits."""
    rules = {"server": {"export_topics": ["/**"]}, "client": {"import_topics": ["/**"]}}
    if end:
        rules[end]["lossy"] = "never"
    made = {side: {"rules": ["all"], "rule": {"all": rule}} for side, rule in rules.items()}
    made["server"]["link.bytes_per_second"] = CAP
    pair = make_pair(**made)
    publisher, collector = pair.opened(PointCloud2, "/t/points", cloud(0))
    collector.clear()
    sent = {0: cloud(0)}  # the last ones of the beginning may be on their way
    ends = time.monotonic() + 12
    number = 0
    while time.monotonic() < ends:
        number += 1
        sent[number] = cloud(number)
        publisher.publish(sent[number])
        time.sleep(0.06)
    came = collector.messages
    assert came
    not_under_a_sanitizer("what a busy processor keeps up with")
    sides = pair.server, pair.client
    steps = [(side.topic("/t/points") or {}).get("sent_as_step") for side in sides]
    if end:
        assert steps == [None, None]
        assert all(message == sent[message.header.stamp.sec] for message in came)
        return
    assert steps == [0.01, 0.01]
    last = came[-1]
    assert last != sent[last.header.stamp.sec]
    for index, (before, after) in enumerate(zip(floats(sent[last.header.stamp.sec]), floats(last))):
        same = struct.pack("<f", before) == struct.pack("<f", after)
        assert same or index % 4 != 3 and abs(before - after) <= 0.005
    last.data, sent[last.header.stamp.sec].data = [], []
    assert last == sent[last.header.stamp.sec]
