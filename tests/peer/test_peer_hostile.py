"""Attempts by a peer or a stranger that must not affect others."""

import contextlib
import os
import signal
import threading
import time

import pytest
from graph import until
from std_msgs.msg import UInt8MultiArray

from connect_packets import zstd_compress
from connect_peer import Peer, open_socket
from peer_world import BYTES, STRING, TOKEN, World, message, packet, without_zstd


def test_silent_connections_keep_nobody_out(world, served, peer):
    with contextlib.ExitStack() as stack:
        for _ in range(140):
            socket = open_socket(world.url)
            stack.callback(socket.socket.close)
        mine = peer()
        mine.until(lambda: mine.complete, "the first round")


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
    time.sleep(0.5)
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
        mine.close()
    finally:
        own.close()
