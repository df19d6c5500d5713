"""Messages about services that are wrong in their state, and what is accepted."""

import pytest
from std_msgs.msg import String

from connect_calls import Calls
from connect_peer import Peer
from peer_services import SET_BOOL, TRUE, answer_of, attached, flip, ready
from peer_world import STRING, TOKEN, cdr_string, message, packet


def at_server(world, service, name, offers=()):
    """A peer that is attached to a service and offers a topic on channel 1."""
    service(name)
    mine = Peer(world.url, TOKEN, services=["/s/**"], exports=[("/o/calls", STRING, "volatile")])
    mine.until(lambda: mine.offered, "offer")
    return mine, attached(mine, name)


@pytest.mark.parametrize(
    "code, text",
    [
        (4010, lambda mine, it: {"type": "attach", "channel": 99_999, "requests": 50}),
        (4009, lambda mine, it: {"type": "attach", "channel": it.channel, "requests": 50}),
        (
            4009,
            lambda mine, it: {"type": "attach", "channel": mine.find("/s/b"), "requests": 1},
        ),
        (
            4009,
            lambda mine, it: {
                "type": "attach",
                "channel": mine.find("/s/b"),
                "requests": it.requests,
            },
        ),
        (4009, lambda mine, it: {"type": "attach", "channel": mine.find("/t/b"), "requests": 50}),
        (4010, lambda mine, it: {"type": "forget", "channel": 99_999, "calls": [1]}),
        (4010, lambda mine, it: {"type": "refuse", "channel": 99, "calls": [1], "code": "limit"}),
        (4010, lambda mine, it: {"type": "attached", "channel": 99, "requests": 9, "calls": []}),
        (4010, lambda mine, it: {"type": "withdraw", "channels": [99]}),
        (4009, lambda mine, it: {"type": "offer", "channels": [again(it.requests)]}),
    ],
    ids=[
        "attach of nothing",
        "attach twice",
        "requests is a channel of ours",
        "requests is in use",
        "attach of a topic",
        "forget of nothing",
        "refuse of nothing",
        "attached to nothing",
        "withdraw of no requests",
        "offer with a number of requests",
    ],
)
def test_refused_by_state(world, served, service, code, text):
    publisher = world.graph.publisher(String, "/t/b")
    service("/s/b")
    mine, it = at_server(world, service, "/s/a")
    mine.send_control(**text(mine, it))
    assert mine.wait_closed() == code
    world.graph.tester.destroy_publisher(publisher)


def again(number):
    described = {"channel": number, "kind": "service", "name": "/p/x", "type": SET_BOOL}
    return {**described, "epoch": 1}


def test_requests_after_their_withdraw(world, service):
    mine, it = at_server(world, service, "/s/a")
    mine.detach(it)
    mine.send_raw(packet(message(it.requests, 1, TRUE)))
    assert mine.wait_closed() == 4010


def test_a_compressed_request_that_is_broken(world, service):
    mine, it = at_server(world, service, "/s/a")
    mine.send_raw(packet(dict(message(it.requests, 1, b"\x10a"), codec="lz4", raw_bytes=5)))
    assert mine.wait_closed() == 4002


@pytest.mark.parametrize(
    "code, second",
    [
        (4009, {}),
        (None, {"requests": 77}),  # of an attachment that has ended
    ],
    ids=["attached twice", "attached to something else"],
)
def test_attached_that_does_not_fit(world, client, code, second):
    mine = Peer(world.url, TOKEN)
    mine.until(lambda: mine.complete, "opening")
    channel = mine.serve("/p/odd", SET_BOOL, flip)
    ready(client("/p/odd"))
    requests = mine.served[channel].requests
    said = {"type": "attached", "channel": channel, "requests": requests, "calls": [], **second}
    mine.send_control(**said)
    if code:
        assert mine.wait_closed() == code
        return
    mine.ask_time()
    mine.until(lambda: mine.times, "a time reply")
    mine.close()


class Liar(Peer):
    """Claims to have seen calls that cannot exist."""

    def _send_attached(self, channel):
        self.served[channel].seen = 0xF0000000
        Calls._send_attached(self, channel)


def test_seen_beyond_all_numbers(world, client):
    mine = Liar(world.url, TOKEN)
    mine.until(lambda: mine.complete, "opening")
    mine.serve("/p/liar", SET_BOOL, flip)
    assert mine.wait_closed() == 4009


def test_what_is_accepted(world, peer, service):
    mine = peer(services=["/s/**"], exports=[("/o/accepted", STRING, "volatile")])
    service("/s/accepted")
    service_there = attached(mine, "/s/accepted")
    mine.demand(service_there.channel)
    mine.send_control(type="forget", channel=service_there.channel, calls=[1, 2, 3])
    mine.send_control(type="decline", channel=service_there.channel, code="failed", later=[1])
    assert answer_of(mine.call(service_there, TRUE)) == (True, "number 1")
    channel = mine.serve("/p/accepted", SET_BOOL, None)
    mine.send_control(type="refuse", channel=channel, calls=[1, 2], code="limit")
    for frame in mine.frames_for(channel, cdr_string("nobody asked"), origin=12):
        mine.send_packet([frame])
    t1 = mine.ask_time()
    mine.until(lambda: any(reply["t1"] == t1 for reply in mine.times), "a time reply")
