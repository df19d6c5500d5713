"""Topics between the real server and a peer that was written from docs/md alone."""

import array
import contextlib
import random
import struct
import time

import pytest
from geometry_msgs.msg import Twist
from graph import until
from std_msgs.msg import String, UInt8MultiArray

from connect_packets import decompress, delta_compress, zstd_compress
from peer_world import (
    BYTES,
    LATCHED,
    STRING,
    TWIST,
    bytes_of,
    cdr_bytes,
    cdr_string,
    publish_until,
    string_of,
    without_zstd,
)


def test_string(world, peer):
    publisher = world.graph.publisher(String, "/t/chatter")
    mine = peer()
    channel = mine.find("/t/chatter")
    offer = mine.offers[channel]
    assert (offer["kind"], offer["type"]) == ("topic", STRING)
    assert offer["type_hash"].startswith("RIHS01_")
    assert len(offer["origins"]) == 1
    assert offer["origins"][0]["qos"]["reliability"] == "reliable"
    publisher.publish(String(data="nobody asked"))
    time.sleep(0.2)
    assert channel not in mine.samples
    mine.demand(channel)
    texts = iter(range(10_000))
    publish_until(
        publisher, lambda: String(data=f"text {next(texts)} ü"), lambda: mine.samples.get(channel)
    )
    sample = mine.samples[channel][0]
    assert string_of(sample.data).startswith("text ")
    assert abs(time.time_ns() - sample.stamp) < 30e9
    assert sample.sequence == 1
    mine.demand(channel, on=False)
    time.sleep(0.3)
    count = len(mine.samples[channel])
    publisher.publish(String(data="no longer"))
    time.sleep(0.2)
    assert len(mine.samples[channel]) == count
    world.graph.tester.destroy_publisher(publisher)
    mine.until(lambda: channel in mine.withdrawn, "withdraw")


def test_500_kilobytes(world, peer):
    publisher = world.graph.publisher(UInt8MultiArray, "/t/large")
    data = random.Random(1).randbytes(500_000)
    mine = peer()
    channel = mine.find("/t/large")
    mine.demand(channel)
    publish_until(
        publisher,
        lambda: UInt8MultiArray(data=array.array("B", data)),
        lambda: (time.sleep(0.3), mine.samples.get(channel))[1],
    )
    assert bytes_of(mine.samples[channel][0].data) == data
    kinds = [(kind, size) for number, kind, size in mine.frames if number == channel]
    assert kinds[0][0] == "message" and [kind for kind, _ in kinds[1:4]] == ["part"] * 3
    assert max(size for _, size in kinds[:4]) <= 131_072
    assert max(size for _, size in kinds) <= 262_144  # once the link has shown its rate


@pytest.mark.parametrize("codec", ["lz4", pytest.param("zstd", marks=without_zstd)])
def test_compressed(world, peer, codec):
    publisher = world.graph.publisher(String, f"/t/{codec}")
    mine = peer()
    channel = mine.find(f"/t/{codec}")
    mine.demand(channel)
    text = "to and fro, " * 2000 + "end"
    publish_until(publisher, lambda: String(data=text), lambda: mine.samples.get(channel))
    assert mine.samples[channel][0].codec == codec
    assert string_of(mine.samples[channel][0].data) == text
    # A message that does not shrink is not compressed.
    mine.samples[channel].clear()
    publish_until(
        publisher,
        lambda: String(data="a"),
        lambda: [s for s in mine.samples[channel] if s.codec == "none"],
    )


@without_zstd
def test_deltas(world, peer):
    publisher = world.graph.publisher(String, "/t/zstd")
    mine = peer()
    channel = mine.find("/t/zstd")
    mine.demand(channel)
    noise = random.Random(1).randbytes(500).hex()
    count = iter(range(10_000))
    publish_until(
        publisher,
        lambda: String(data=f"{noise} {next(count)}"),
        lambda: len(mine.samples.get(channel, [])) > 3,
    )
    first, *others = mine.samples[channel]
    assert first.codec == "zstd_base"
    assert {sample.codec for sample in others} == {"zstd_delta"}
    assert all(string_of(sample.data).startswith(noise) for sample in mine.samples[channel])
    # A new demand does not use bases of the last one.
    mine.demand(channel, on=False)
    mine.samples[channel].clear()
    mine.demand(channel)
    publish_until(publisher, lambda: String(data=noise), lambda: mine.samples[channel])
    assert mine.samples[channel][0].codec == "zstd_base"


def test_history_for_a_second_peer(world, peer):
    publisher = world.graph.publisher(String, "/t/latched", LATCHED)
    first = peer()
    channel = first.find("/t/latched")
    assert first.offers[channel]["origins"][0]["qos"]["durability"] == "transient_local"
    for number in range(3):
        publisher.publish(String(data=str(number)))
    first.demand(channel)
    first.wait_samples(channel, 3)
    second = peer()
    channel = second.find("/t/latched")
    second.demand(channel)
    second.wait_samples(channel, 3)
    assert [string_of(sample.data) for sample in second.samples[channel]] == ["0", "1", "2"]
    # A new demand gets the history again, and the numbers identify it.
    frames = len(second.frames)
    second.demand(channel, on=False)
    second.demand(channel)
    second.until(lambda: len(second.frames) >= frames + 3, "history again")
    assert len(second.samples[channel]) == 3


def test_origins_come_and_go(world, peer):
    publisher = world.graph.publisher(String, "/t/origins")
    mine = peer()
    channel = mine.find("/t/origins")
    late = world.graph.node("late")
    world.graph.publisher(String, "/t/origins", node=late)
    origins = mine.offers[channel]["origins"]
    mine.until(lambda: len(origins) == 2, "another origin")
    assert len({origin["gid"] for origin in origins}) == 2
    world.graph.remove(late)
    mine.until(lambda: len(origins) == 1, "one origin")
    world.graph.tester.destroy_publisher(publisher)


def test_node_of_an_origin(world, peer):
    """Its fully qualified name; absent or empty where the middleware does not know it yet."""
    mine = peer()
    known = 0
    for number in range(5):
        node = world.graph.node(f"fresh{number}")
        world.graph.publisher(String, f"/t/fresh{number}", node=node)
        channel = mine.find(f"/t/fresh{number}")
        (origin,) = mine.offers[channel]["origins"]
        world.graph.remove(node)
        name = origin.get("node", "")
        assert name in ("", f"/fresh{number}")
        known += bool(name)
    assert known


def test_only_what_is_accepted_is_offered(world, peer):
    world.graph.publisher(String, "/t/wanted/a")
    world.graph.publisher(String, "/t/other")
    world.graph.publisher(String, "/secret")
    peer().find("/t/other")
    mine = peer(imports=["/t/wanted/**"])
    channel = mine.find("/t/wanted/a")
    mine.until(lambda: mine.complete, "complete")
    assert set(mine.offers) == {channel}
    mine.send_control(
        type="accepts", rules=[{"topics": ["/t/other", "/secret"], "types": [STRING]}], deny=[]
    )
    mine.rules[0]["topics"] = ["/t/other", "/secret"]
    mine.find("/t/other")
    mine.until(lambda: channel in mine.withdrawn, "withdraw")
    assert "/secret" not in {offer["name"] for offer in mine.offers.values()}


def test_cmd_vel(world, peer):
    collector = world.graph.collector(Twist, "/cmd_vel")
    mine = peer(exports=[("/cmd_vel", TWIST, "volatile")])
    channel = mine.channel_of("/cmd_vel")
    numbers = (0.5, 0.0, 0.0, 0.0, 0.0, -1.25)
    sample = b"\0\1\0\0" + struct.pack("<6d", *numbers)
    until(
        lambda: (mine.publish(channel, sample), time.sleep(0.05), collector.messages)[2], "a Twist"
    )
    got = collector.messages[0]
    assert (got.linear.x, got.angular.z) == (0.5, -1.25)
    collector.close()
    mine.until(lambda: channel not in mine.demanded, "no demand")


def test_interleaved_parts(world, peer):
    topics = ("/o/left", "/o/right")
    collectors = [world.graph.collector(UInt8MultiArray, topic) for topic in topics]
    mine = peer(exports=[(topic, BYTES, "transient_local") for topic in topics])
    channels = [mine.channel_of(topic) for topic in topics]
    data = [random.Random(n).randbytes(300_000) for n in range(2)]
    # An aborted message first: it is discarded and its number counts.
    first = list(mine.frames_for(channels[0], cdr_bytes(b"x" * 5000), part=1000))
    mine.send_packet(first[:2] + [dict(type="part", abort=True, channel=channels[0], part=b"")])
    streams = [mine.frames_for(c, cdr_bytes(d), part=7001) for c, d in zip(channels, data)]
    for frames in zip(*streams):
        mine.send_packet(frames)
    for collector, sent in zip(collectors, data):
        assert bytes(collector.wait(1)[0].data) == sent
        assert len(collector.messages) == 1
        collector.close()


@pytest.mark.parametrize("codec", ["lz4", pytest.param("zstd", marks=without_zstd)])
def test_compressed_to_the_server(world, peer, codec):
    topic = f"/o/{codec}"
    collector = world.graph.collector(String, topic)
    mine = peer(exports=[(topic, STRING, "transient_local")])
    channel = mine.channel_of(topic)
    text = "a" * 790
    sample = cdr_string(text)
    if codec == "zstd":
        body = zstd_compress(sample)
    else:  # 9 literals, a match of 15 + 4 + 3 * 255 bytes at offset 1, and 6 literals
        body = b"\x9f" + sample[:9] + b"\1\0" + b"\xff\xff\xff\0" + b"\x60" + sample[-6:]
    assert decompress(codec, body, len(sample)) == sample
    mine.publish(channel, sample, codec=codec, body=body)
    assert collector.wait(1)[0].data == text
    collector.close()


@without_zstd
def test_deltas_to_the_server(world, peer):
    collector = world.graph.collector(String, "/o/deltas")
    mine = peer(exports=[("/o/deltas", STRING, "transient_local")])
    channel = mine.channel_of("/o/deltas")
    base = b""
    for codec, text in (
        ("zstd_base", "the first of them " * 5),
        ("zstd_delta", "the first of them, nearly " * 5),
        ("zstd_base", "another one " * 5),
        ("zstd_delta", "another one, nearly " * 5),
    ):
        sample = cdr_string(text)
        body = delta_compress(sample, base if codec == "zstd_delta" else b"")
        mine.publish(channel, sample, codec=codec, body=body)
        base = sample
    got = [sample.data[:12] for sample in collector.wait(4)]
    assert got == ["the first of", "the first of", "another one ", "another one,"]
    collector.close()


@pytest.mark.parametrize(
    "name, kind, code",
    [
        ("/not/allowed", STRING, "not_permitted"),
        ("/o/a/../b", STRING, "not_permitted"),
        ("/o/type", "no type", "not_permitted"),
    ],
)
def test_declined(world, peer, name, kind, code):
    mine = peer()
    mine.until(lambda: mine.complete, "opening")
    channel = mine.offer(name, kind)
    mine.until(lambda: channel in mine.declined, "decline")
    assert mine.declined[channel][0] == code
    assert channel not in mine.demanded


def test_type_of_another_kind_is_no_type(peer):
    mine = peer()
    channel = mine.offer("/o/type", "std_srvs/srv/Empty")
    mine.until(lambda: channel in mine.declined, "decline")
    assert mine.declined[channel][0] == "not_permitted"


def test_other_type_hash_is_declined(world, peer):
    collector = world.graph.collector(String, "/o/hash")
    mine = peer()
    mine.until(lambda: mine.complete, "opening")
    channel = mine.offer("/o/hash", STRING, type_hash="RIHS01_" + "0" * 64)
    mine.until(lambda: channel in mine.declined, "decline")
    assert mine.declined[channel][0] == "type_mismatch"
    collector.close()


def test_mirrors(world, peer):
    """One publisher per origin, none for a publisher of the server's own graph."""
    collector = world.graph.collector(String, "/o/mirrors")
    own = world.graph.publisher(String, "/t/own")
    mine = peer()
    gids = [f"{number:048x}" for number in (1, 2, 3)]
    gids.append(mine.offers[mine.find("/t/own")]["origins"][0]["gid"])
    origins = [{"origin": number + 1, "gid": gid, "qos": {}} for number, gid in enumerate(gids)]
    mine.offer("/o/mirrors", STRING, origins=origins)
    world.graph.wait_publishers("/o/mirrors", 3)
    mine.send_control(type="origins", channel=1, added=[], removed=[1, 2])
    world.graph.wait_publishers("/o/mirrors", 1)
    mine.send_control(type="withdraw", channels=[1])
    world.graph.wait_publishers("/o/mirrors", 0)
    collector.close()
    world.graph.tester.destroy_publisher(own)


@pytest.mark.parametrize(
    "numbers, texts",
    [
        ((10, 20, 20, 15, 30), ["0", "1", "4"]),
        ((0, 0), ["0", "1"]),
    ],
    ids=["rising", "not known"],
)
def test_numbers_of_transient_local(world, peer, numbers, texts):
    topic = f"/o/numbers{numbers[0]}"
    collector = world.graph.collector(String, topic, LATCHED)
    mine = peer(exports=[(topic, STRING, "transient_local")])
    channel = mine.channel_of(topic)
    for count, number in enumerate(numbers):
        mine.publish(channel, cdr_string(str(count)), number=number)
    sent = mine.sent_bytes  # more follows, of what the peer says by itself
    until(lambda: mine.acked >= sent, "ack")
    with contextlib.suppress(AssertionError):
        collector.wait(len(texts), 2)
    assert [m.data for m in collector.messages] == texts
    collector.close()
