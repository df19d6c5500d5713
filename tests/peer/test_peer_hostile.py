"""Attempts by a peer or a stranger that must not affect others."""

import os
import signal
import threading
import time

import pytest
from graph import until

from connect_peer import Peer
from peer_world import STRING, TOKEN, World, message, packet


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
