"""The memory that all peers together may use, nearly used up: docs/security.md, section 5."""

import contextlib
import time

from graph import until
from sanitizer import not_under_a_sanitizer
from std_msgs.msg import String, UInt8MultiArray

from connect_peer import Peer
from peer_world import BYTES, STRING, World, cdr_string, message, token_of

MIB = 1 << 20
MEMORY_MAX, MESSAGE_MAX, BODY = 64 * MIB, MIB, 512 << 10
# Each of n greedy peers has 1/(n + 2) of it, if it has one link: 12 of them 86 %.
GREEDY = [f"greedy{n}" for n in range(12)]
TOPICS = [f"/o/hoard{n}" for n in range(16)]
# What the workers and connections without a login may use, and the program itself, which has 192
# publishers here.
BESIDE = 8 * MIB + 3 * MESSAGE_MAX + 30 * MIB + 64 * MIB


def test_greedy_peers_use_no_more_than_there_is(tmp_path):
    own = World(
        tmp_path,
        [*GREEDY, "modest"],
        dead_after=60.0,
        memory_max=MEMORY_MAX,
        max_message_size=MESSAGE_MAX,
    )
    with contextlib.ExitStack() as stack:
        stack.callback(own.close)

        def login(identity):
            mine = Peer(own.url, token_of(identity), dead_after=60.0)
            stack.callback(mine.close)
            return mine

        collectors = [own.graph.collector(UInt8MultiArray, name) for name in TOPICS]
        heard = own.graph.collector(String, "/o/modest")
        peers = [login(identity) for identity in GREEDY]
        for mine in peers:
            for name in TOPICS:
                mine.offer(name, BYTES)
        for mine in peers:
            for name in TOPICS:
                channel = mine.channel_of(name)
                begun = message(channel, 1, bytes(BODY - 1), body_bytes=BODY)
                mine.send_packet([dict(begun, demand=mine.demanded[channel])])

        def used():
            return own.server.status().get("memory_max_used_bytes", 0)

        until(lambda: used() >= 0.8 * MEMORY_MAX, lambda: f"80 % of the memory: {used()}")
        most = 0
        for _ in range(20):
            most = max(most, own.server.resident_bytes())
            time.sleep(0.1)
        assert used() <= MEMORY_MAX
        bound = MEMORY_MAX + BESIDE + len(peers) * MESSAGE_MAX
        print(f"{used() / MEMORY_MAX:.0%} of memory_max, {most / MIB:.0f} of {bound / MIB:.0f} MiB")
        # There is room for who needs little.
        modest = login("modest")
        modest.offer("/o/modest", STRING)
        channel = modest.channel_of("/o/modest")

        def arrives():
            modest.publish(channel, cdr_string("m" * 20_000))
            time.sleep(0.05)
            return heard.messages

        until(arrives, "a message of the modest peer")
        assert all(mine.closed is None for mine in peers)
        for collector in [*collectors, heard]:
            collector.close()
        not_under_a_sanitizer("the server's memory beside greedy peers")
        assert most < bound
