"""Acknowledgements, time, liveness and sessions."""

import array
import contextlib
import time

import pytest
from graph import until
from rclpy.qos import QoSProfile
from std_msgs.msg import String, UInt8MultiArray
from websockets.exceptions import ConnectionClosed

from connect_peer import Peer
from peer_world import (
    BYTES,
    LATCHED,
    STRING,
    TOKEN,
    cdr_bytes,
    cdr_string,
    message,
    packet,
    string_of,
)


def test_time(world, peer):
    mine = peer()
    t1 = mine.ask_time()
    mine.until(lambda: any(reply["t1"] == t1 for reply in mine.times), "time reply")
    reply = next(reply for reply in mine.times if reply["t1"] == t1)
    assert reply["t1"] <= reply["t2"] <= reply["t3"] <= reply["t4"]
    assert reply["ros"] == 0 or abs(reply["ros"] - reply["t3"]) < 1e9


@pytest.mark.alone
def test_server_acknowledges(world, peer):
    """Acknowledged at once: packets that ask, and 1,048,576 bytes; within 100 ms: less; never: acks
    alone."""
    collector = world.graph.collector(UInt8MultiArray, "/o/acks")
    mine = peer(exports=[("/o/acks", BYTES, "volatile")])
    channel = mine.channel_of("/o/acks")
    time.sleep(0.3)
    mine.publish(channel, cdr_bytes(bytes(100)))
    # Time frames that follow need no ack of their own.
    begin, sent = time.monotonic(), mine.sent_bytes
    mine.until(lambda: mine.acked >= sent, "ack of a small packet", 2)
    assert time.monotonic() - begin < 0.5  # 100 ms and a busy machine
    asks = dict(type="ack_request")
    begin = time.monotonic()
    for _ in range(10):
        sent = mine.sent_bytes
        mine.send_packet([asks])
        mine.until(lambda: mine.acked > sent, "an ack that was asked for", 2)
    assert time.monotonic() - begin < 0.5  # ten times 100 ms without asking
    acks = len(mine.acks_received)
    for _ in range(8):
        mine.publish(channel, cdr_bytes(bytes(1_000_000)))
    sent = mine.sent_bytes
    mine.until(lambda: mine.acked >= sent, "ack of everything", 2)
    assert len(mine.acks_received) - acks >= 5
    counts = [count for _, count in mine.acks_received]
    assert counts == sorted(counts)
    acks = len(mine.acks_received)
    for _ in range(5):
        mine.ask_time()
    time.sleep(0.4)
    assert len(mine.acks_received) == acks
    collector.close()


def test_who_never_acknowledges_gets_little(world, peer):
    """32 KiB and the part that was begun; then nothing but control, ack and time frames."""
    publisher = world.graph.publisher(UInt8MultiArray, "/t/window", QoSProfile(depth=50))
    mine = peer()
    mine.deaf = True
    channel = mine.find("/t/window")
    mine.demand(channel)
    large = UInt8MultiArray(data=array.array("B", bytes(1_000_000)))
    until(
        lambda: (publisher.publish(large), time.sleep(0.05), mine.received_bytes > 30_000)[2],
        "a full window",
    )
    for _ in range(4):
        publisher.publish(large)
    time.sleep(0.5)
    assert mine.received_bytes < 100_000
    times = len(mine.times)
    mine.ask_time()
    mine.until(lambda: len(mine.times) > times, "a time reply in spite of the window")
    mine.deaf = False
    mine._send_ack()
    mine.until(lambda: mine.received_bytes > 1_000_000, "data again after an ack")


def test_the_server_asks_for_the_time_and_misses_who_is_silent(world):
    mine = Peer(world.url, TOKEN)
    mine.until(lambda: mine.complete, "opening")
    mine.mute = True
    begin = time.monotonic()
    while not mine.closed and time.monotonic() < begin + 4.5:
        with contextlib.suppress(ConnectionClosed):
            mine.socket.ping()  # not a sign of life
        time.sleep(0.1)
    assert mine.wait_closed() == 4008
    assert 2.5 < time.monotonic() - begin < 4.5
    gaps = [b - a for a, b in zip(mine.asked_at, mine.asked_at[1:])]
    assert len(gaps) >= 3 and max(gaps) < 1.3, gaps


def test_session_continues(world, peer):
    old = Peer(world.url, TOKEN)
    old.until(lambda: old.complete, "opening")
    new = peer(session=old.welcome["session"])
    assert old.wait_closed() == 4005
    assert new.welcome["session"] == old.welcome["session"]
    new.until(lambda: new.complete, "the opening done again")


def test_session_continues_after_a_loss(world, peer):
    """The server keeps the mirror and publishes what is transient local once."""
    collector = world.graph.collector(String, "/o/kept", LATCHED)
    exports = [("/o/kept", STRING, "transient_local")]
    old = Peer(world.url, TOKEN, exports=exports)
    sample = cdr_string("once")
    old.publish(old.channel_of("/o/kept"), sample, number=7)
    collector.wait(1)
    (mirror,) = world.graph.publishers("/o/kept")
    old.drop()
    # The same process, hence the same gid.
    new = peer(exports=exports, session=old.welcome["session"], side=old.side)
    assert new.welcome["session"] == old.welcome["session"]
    channel = new.channel_of("/o/kept")
    new.publish(channel, sample, number=7)
    new.publish(channel, cdr_string("twice"), number=8)
    assert [m.data for m in collector.wait(2)] == ["once", "twice"]
    (now,) = world.graph.publishers("/o/kept")
    assert now.endpoint_gid == mirror.endpoint_gid
    collector.close()


@pytest.mark.parametrize("code", [1000, 1001], ids=str)
def test_link_ends_with_a_goodbye(peer, code, world):
    old = Peer(world.url, TOKEN)
    old.close(code)
    assert peer(session=old.welcome["session"]).welcome["session"] != old.welcome["session"]


@pytest.mark.parametrize("code", [4002, None], ids=str)
def test_link_is_kept_after_the_end_of_a_connection(world, peer, code):
    old = Peer(world.url, TOKEN)
    old.close(code) if code else old.drop()
    assert peer(session=old.welcome["session"]).welcome["session"] == old.welcome["session"]


def test_unknown_session(world, peer):
    mine = peer(session=bytes([7]) * 16)
    assert mine.welcome["session"] != bytes([7]) * 16


def words(samples):
    return [string_of(sample.data) for sample in samples]


def test_an_importer_goes_on_behind_what_it_has(world, peer):
    """The server keeps what may not have arrived, and what is published during the break."""
    publisher = world.graph.publisher(String, "/t/resumed")
    old = Peer(world.url, TOKEN)
    channel = old.find("/t/resumed")
    assert not old.offers[channel].get("resume")
    old.demand(channel, resume=True)
    until(
        lambda: (publisher.publish(String(data="first")), time.sleep(0.05), old.samples)[2],
        "a sample",
    )
    time.sleep(0.3)
    last = old.samples[channel][-1].sequence
    old.deaf = True  # the next one arrives, and is not acknowledged
    publisher.publish(String(data="seen"))
    old.until(lambda: words(old.samples[channel])[-1] == "seen", "the last one")
    old.drop()
    for text in ("kept", "too"):
        publisher.publish(String(data=text))
    time.sleep(0.3)
    new = peer(session=old.welcome["session"], side=old.side)
    channel = new.find("/t/resumed")
    assert new.offers[channel]["resume"]
    new.demand(channel, resume=True, after=last + 1)
    samples = new.wait_samples(channel, 2)
    assert words(samples) == ["kept", "too"]
    assert [sample.sequence for sample in samples] == [last + 2, last + 3]
    publisher.publish(String(data="new"))
    assert words(new.wait_samples(channel, 3))[-1] == "new"


def test_an_exporter_that_kept_something_is_asked_for_it(world, peer):
    collector = world.graph.collector(String, "/o/resumed")
    old = Peer(world.url, TOKEN, exports=[("/o/resumed", STRING, "volatile")])
    channel = old.channel_of("/o/resumed")
    assert old.demands[-1]["resume"] and "after" not in old.demands[-1]
    old.publish(channel, cdr_string("one"))
    collector.wait(1)
    old.drop()
    new = peer(
        session=old.welcome["session"],
        side=old.side,
        first_round=lambda mine: mine.offer("/o/resumed", STRING, resume=True),
    )
    channel = new.channel_of("/o/resumed")
    assert new.demands[-1]["after"] == 1
    # It is ahead of that by less than 2^31, but would be too far ahead of 0.
    demand = new.demanded[channel]
    frame = message(channel, 1 << 31, cdr_string("two"))
    new.send_raw(packet(dict(frame, demand=demand)))
    until(lambda: collector.messages[-1].data == "two", "what follows")
    assert [m.data for m in collector.messages] == ["one", "two"]
    collector.close()
