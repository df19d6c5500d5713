"""Attempts by a peer or a stranger that must not affect others."""

import contextlib
import os
import signal
import threading
import time

import pytest
from graph import until
from std_msgs.msg import String, UInt8MultiArray
from websockets.exceptions import ConnectionClosed

from connect_control import PARAMETER_EVENTS
from connect_packets import zstd_compress
from connect_peer import Peer, open_socket
from connect_records import encode_login
from peer_world import (
    BYTES,
    HELLO,
    STRING,
    TOKEN,
    World,
    message,
    packet,
    say,
    token_of,
    without_zstd,
)


def test_silent_connections_keep_nobody_out(world, served, peer):
    with contextlib.ExitStack() as stack:
        for _ in range(140):
            socket = open_socket(world.url)
            stack.callback(socket.socket.close)
        mine = peer()
        mine.until(lambda: mine.complete, "the first round")


def test_wrong_logins_keep_nobody_out(world, served, peer):
    """All come from one address, as they would behind a proxy."""
    for _ in range(20):
        assert say(world, HELLO, encode_login("token", b"a-token-of-nobody")) == 4003
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")


def test_one_token_does_not_take_all_places(tmp_path):
    own = World(tmp_path, ["greedy", "other"], connections_max=16)  # one may have half
    try:
        with contextlib.ExitStack() as stack:
            for identity in [*["greedy"] * 8, "other"]:
                mine = Peer(own.url, token_of(identity))
                stack.callback(mine.close)
                assert mine.welcome["identity"] == identity
            with pytest.raises(ConnectionClosed) as closed:
                Peer(own.url, token_of("greedy"))
            assert closed.value.rcvd.code == 4012
    finally:
        own.close()


def test_the_reason_of_a_close_is_text_in_the_log(world, peer):
    mine = peer()
    mine.socket.close(1000, "gone\n[ERROR] [1.0] [connect_server]: forged\x1b[2J\x9b2J")
    world.server.wait_for("gone.*forged")
    assert not any(line.startswith("[ERROR]") for line in world.server.text().splitlines())
    assert "\x1b" not in world.server.text() and "\x9b" not in world.server.text()


def test_a_peer_that_changes_its_mind_all_the_time(world, served, peer):
    """Each look at all that there is has its price; the last word holds."""
    last = world.graph.publisher(String, "/t/last_word")
    mine = peer(imports=["/t/tick"])
    mine.find("/t/tick")
    for turn in range(1000):
        topics = [["/t/nothing"], ["/t/tick"]][turn % 2]
        mine.send_control(type="accepts", rules=[{"topics": topics, "types": []}], deny=[])
    rules = [{"topics": ["/t/last_word"], "types": []}]
    mine.send_control(type="accepts", rules=rules, deny=[])
    mine.find("/t/last_word")
    assert {offer["name"] for offer in mine.offers.values()} == {"/t/last_word"}
    assert len(mine.withdrawn) < 100
    world.graph.tester.destroy_publisher(last)


def test_events_of_parameters_that_may_only_be_seen(world, peer):
    """A right to read a node's parameters is none to speak for it."""
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    gid = mine.side.ljust(24, b"\0").hex()
    origins = [{"origin": 1, "gid": gid, "node": "/open_node", "qos": {}}]
    channel = mine.offer(PARAMETER_EVENTS, "rcl_interfaces/msg/ParameterEvent", origins=origins)
    mine.until(lambda: channel in mine.declined, "decline")
    assert mine.declined[channel][0] == "not_permitted"


@without_zstd
def test_a_bomb_is_decompressed_now_and_then(world, served, peer):
    """2 kB are 64 MiB: 30 of them within a second would be 2 GB."""
    collector = world.graph.collector(UInt8MultiArray, "/o/bomb")
    mine = peer(exports=[("/o/bomb", BYTES, "volatile")])
    channel = mine.channel_of("/o/bomb")
    raw = b"\0\1\0\0" + bytes((64 << 20) - 4)
    body = zstd_compress(raw)
    assert len(body) < 10_000
    for sequence in range(1, 31):
        frame = message(channel, sequence, body)
        mine.send_packet([dict(frame, codec="zstd", raw_bytes=len(raw))])
    until(lambda: len(collector.messages) >= 1, "the first one")
    time.sleep(2)
    assert len(collector.messages) <= 6
    assert mine.closed is None
    collector.close()


def test_publishers_of_a_topic_have_a_limit(world, served, peer):
    origins = [
        {"origin": n, "gid": (b"many" + n.to_bytes(2, "big")).ljust(24, b"\0").hex(), "qos": {}}
        for n in range(1, 601)
    ]
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    mine.offer("/o/many", STRING, origins=origins)
    until(lambda: len(world.graph.publishers("/o/many")) >= 256, "the mirrors")
    mine.offer("/o/after", STRING)
    until(lambda: world.graph.publishers("/o/after"), "what was offered after them")
    assert len(world.graph.publishers("/o/many")) == 256


def test_a_topic_is_offered_once(world, peer):
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    mine.offer("/o/twice", STRING)
    second = mine.offer("/o/twice", STRING)
    mine.until(lambda: second in mine.declined, "decline")
    assert mine.declined[second][0] == "limit"


@pytest.mark.alone
def test_a_server_that_stood_still_misses_nobody(tmp_path):
    """A sign of life, however large, is read before a peer counts as silent."""
    own = World(tmp_path)
    try:
        mine = Peer(own.url, TOKEN, dead_after=30.0)
        mine.until(lambda: mine.complete, "the first round")
        channel = mine.offer("/o/nobody_listens", STRING)
        mine.ask_time()
        mine.until(lambda: mine.times, "an answer")
        os.kill(own.server.pid, signal.SIGSTOP)
        time.sleep(4)
        large = packet(message(channel, 1, bytes(1_000_000)))
        sender = threading.Thread(target=mine.send_raw, args=[large])
        sender.start()
        time.sleep(0.3)
        os.kill(own.server.pid, signal.SIGCONT)
        sender.join()
        time.sleep(1)
        assert mine.closed is None
        until(lambda: "this process was held up for" in own.server.text(), "its line")
        mine.close()
    finally:
        own.close()
