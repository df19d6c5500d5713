"""What is refused after login, with the close code of the document, and what is accepted."""

import contextlib
import json

import pytest
from std_msgs.msg import String
from websockets.exceptions import ConnectionClosed

from connect_control import (
    MEMBERS_MAX,
    TEXT_MAX,
    VALUES_MAX,
    encode_control,
    origins_messages,
)
from connect_packets import delta_compress
from connect_peer import Peer, open_socket
from connect_records import decode_welcome, encode_login
from peer_world import (
    BAD_BYTES,
    BAD_TEXTS,
    HELLO,
    OFFER,
    STRING,
    TOKEN,
    World,
    cdr_string,
    message,
    named,
    packet,
    part_of,
    until,
    without_zstd,
)


def refused(world, what, offers=()):
    """The close code for this after login."""
    mine = Peer(world.url, TOKEN, exports=offers)
    mine.until(lambda: len(mine.offered) == len(offers), "offers")
    with contextlib.suppress(ConnectionClosed):
        mine.socket.send(what) if isinstance(what, str) else mine.send_raw(what)
    return mine.wait_closed()


# With the channels of the vectors, so that nothing but the bytes is wrong.
CHANNELS = [(f"/o/channel{number}", STRING, "volatile") for number in range(1, 8)]


@named([vector for vector in BAD_BYTES if vector["kind"] == "packet"])
def test_malformed_packet(world, vector):
    assert refused(world, bytes.fromhex(vector["hex"]), CHANNELS) == vector["close"]


@named(BAD_TEXTS)
def test_malformed_control(world, vector):
    assert refused(world, vector["text"]) == vector["close"]


def test_the_good_peer_was_served_all_the_time(served):
    pass


@pytest.mark.parametrize(
    "code, frames",
    [
        (4010, [message(99, 1, b"abcd")]),
        (4010, [part_of(99, b"abcd")]),
        (4009, [part_of(1, b"abcd")]),
        (4009, [part_of(1, b"", True)]),
        (4009, [message(1, 1, b"a", 4), message(1, 2, b"abcd")]),
        (4009, [message(1, 2, b"abcd"), message(1, 2, b"abcd")]),
        (4009, [message(1, 2, b"abcd"), message(1, 1, b"abcd")]),
        (4002, [message(1, 1, b"a", 4), part_of(1, b"abcd")]),
        (4006, [message(1, 1, b"a", (64 << 20) + 1)]),
        (4009, [dict(type="ack", received_bytes=1 << 40, arrived=1)]),
        (4002, [dict(message(1, 1, b"\x10a"), codec="lz4", raw_bytes=5)]),
        (4002, [dict(message(1, 1, b"abcd"), codec="zstd", raw_bytes=5)]),
        (4006, [dict(type="time_request", t1=1)] * 1025),
    ],
    ids=[
        "unknown channel",
        "part of an unknown channel",
        "part without message",
        "abort without message",
        "message within a message",
        "same sequence",
        "falling sequence",
        "part too long",
        "message too large",
        "ack of too much",
        "broken lz4",
        "broken zstd",
        "too many frames",
    ],
)
def test_refused_by_state(world, served, code, frames):
    # The channel has demand, so its data cannot be dropped unread.
    collector = world.graph.collector(String, "/o/states")
    try:
        mine = Peer(world.url, TOKEN, exports=OFFER)
        mine.channel_of("/o/states")
        mine.send_raw(packet(*frames))
        assert mine.wait_closed() == code
    finally:
        collector.close()


# Nothing in it repeats, so a delta takes it from its base, which the other has at another place.
TEXT = "".join(chr(ord("!") + number * number % 83) for number in range(41))
BASE = cdr_string(TEXT)
OTHER = cdr_string(TEXT + " moved")


def delta(codec, sequence, base, checksum=True):
    body = delta_compress(BASE, base, checksum)
    return dict(message(1, sequence, body), codec=codec, raw_bytes=len(BASE))


@without_zstd
@pytest.mark.parametrize(
    "make",
    [
        lambda: [delta("zstd_delta", 1, BASE)],
        lambda: [message(1, 1, BASE), delta("zstd_delta", 2, BASE)],
        lambda: [delta("zstd_base", 1, b""), delta("zstd_delta", 2, OTHER)],
        lambda: [delta("zstd_base", 1, b"", checksum=False)],
        lambda: [dict(delta("zstd_base", 1, b""), raw_bytes=32769)],
    ],
    ids=["no base", "base in the clear", "another base", "no checksum", "base too large"],
)
def test_deltas_refused(world, make):
    collector = world.graph.collector(String, "/o/states")
    try:
        mine = Peer(world.url, TOKEN, exports=OFFER)
        mine.channel_of("/o/states")
        mine.send_raw(packet(*make()))
        assert mine.wait_closed() == 4002
    finally:
        collector.close()


@pytest.mark.parametrize(
    "code, text",
    [
        (4010, {"type": "withdraw", "channels": [9]}),
        (4010, {"type": "origins", "channel": 9, "added": [], "removed": []}),
        (4009, {"type": "offer", "channels": [{"channel": 1, "kind": "later", "name": "/o/x"}]}),
    ],
    ids=["withdraw of nothing", "origins of nothing", "number in use"],
)
def test_control_refused_by_state(world, code, text):
    mine = Peer(world.url, TOKEN, exports=OFFER)
    mine.until(lambda: mine.offered, "offer")
    mine.send_control(**text)
    assert mine.wait_closed() == code


def accepts(count):
    """With so many entries in all lists together; no single list is long."""
    names = [f"/name{number}" for number in range(count)]
    third = count // 3
    rules = [{"topics": names[:third], "types": names[third : 2 * third]}]
    return {"type": "accepts", "rules": rules, "deny": names[2 * third :]}


def test_patterns_beyond_the_limit(tmp_path):
    """In a world of its own: whoever logs in next with its identity is looked at later."""
    with contextlib.closing(World(tmp_path)) as own:
        with contextlib.closing(Peer(own.url, TOKEN)) as mine:
            mine.until(lambda: mine.complete, "opening")
            mine.send_control(**accepts(4096))
            mine.ask_time()
            mine.until(lambda: mine.times, "a time reply")
        assert refused(own, encode_control(accepts(4097))) == 4006


def origins(first, count):
    qos = {"reliability": "reliable", "durability": "volatile"}
    numbers = range(first, first + count)
    return [{"origin": n, "gid": f"{n:048x}", "node": "/python", "qos": qos} for n in numbers]


def test_all_origins_of_a_topic_are_replaced(world, served):
    """Removed ones make room for added ones; more than 1024 at a time are refused."""
    mine = Peer(world.url, TOKEN)
    mine.until(lambda: mine.accepts, "accepts")
    channel = mine.offer("/o/replaced", STRING, origins=origins(1, 250))
    for change in origins_messages(channel, origins(601, 250), range(1, 251)):
        mine.send_control(**change)
    until(lambda: world.graph.tester.count_publishers("/o/replaced") == 250, "250 mirrors")
    t1 = mine.ask_time()
    mine.until(lambda: any(reply["t1"] == t1 for reply in mine.times), "a time reply")
    for change in origins_messages(channel, origins(2000, 775)):
        mine.send_control(**change)
    assert mine.wait_closed() == 4006


def test_data_after_withdraw(world):
    mine = Peer(world.url, TOKEN, exports=OFFER)
    mine.until(lambda: mine.offered, "offer")
    mine.send_control(type="withdraw", channels=[1])
    mine.send_raw(packet(message(1, 1, b"abcd")))
    assert mine.wait_closed() == 4010


def test_too_large_after_login(world, served):
    assert refused(world, bytes(1 + (1 << 20))) in (4006, 1009)
    assert refused(world, "{}" + " " * (1 << 20)) in (4006, 1009)
    assert refused(world, withdraw(" " * TEXT_MAX)) == 4006


def withdraw(inside):
    return '{"type":"withdraw","channels":[]' + inside + "}"


def listed(count, value="0"):
    return ',"x":[' + ",".join([value] * count) + "]"


# What takes long to read beside its size: many values, many members, deep nesting.
@pytest.mark.parametrize(
    "inside",
    [
        listed(VALUES_MAX),
        listed(VALUES_MAX, "{}"),
        listed(VALUES_MAX, "1e-320"),
        "".join(f',"{n:x}":0' for n in range(20_000)),
        ',"channels":[]' * MEMBERS_MAX,
        ',"x":' + "[" * 9 + "]" * 9,
    ],
    ids=["values", "objects", "floats", "members", "one member", "nesting"],
)
def test_control_messages_that_take_long(world, served, inside):
    assert refused(world, withdraw(inside)) == 4006


def test_what_is_wrong_first_decides(world):
    assert refused(world, packet(message(99, 1, b"abcd")) + b"\xff") == 4010
    assert refused(world, b"\xff" + packet(message(99, 1, b"abcd"))) == 4002


@pytest.mark.parametrize(
    "sequence, code", [((1 << 31) - 1, None), (1 << 31, 4009), ((1 << 32) - 1, 4009)]
)
def test_first_sequence(world, sequence, code):
    mine = Peer(world.url, TOKEN, exports=OFFER)
    mine.until(lambda: mine.offered, "offer")
    mine.send_raw(packet(message(1, sequence, b"abcd")))
    if code:
        assert mine.wait_closed() == code
        return
    t1 = mine.ask_time()
    mine.until(lambda: any(reply["t1"] == t1 for reply in mine.times), "a time reply")
    mine.close()


def test_what_is_accepted(world, peer):
    """Ignored, not refused: sections 4, 5, 6, 8 and 14."""
    mine = peer(exports=[("/o/undemanded", STRING, "volatile")])
    mine.until(lambda: mine.complete and mine.offered, "opening")
    mine.demand(77)
    mine.send_control(type="decline", channel=77, code="word_of_tomorrow")
    mine.send_control(
        type="accepts", rules=mine.rules, deny=["no pattern"], tomorrow=[None, {"x": -1.5}, "a\nb"]
    )
    mine.send_control(type="offer", channels=[], complete=True)
    mine.send_control(type="origins", channel=1, added=[], removed=[9])
    mine.send_raw(b"")
    mine.send_packet([dict(type="ack", received_bytes=0, arrived=0)])
    mine.send_packet([dict(type="time_reply", t1=1, t2=2, t3=3, ros=4)])
    mine.send_packet([message(1, 5, b"no cdr"), dict(message(1, 7, cdr_string("x")), origin=9)])
    mine.send_packet([message(1, 8, b"a", 100), part_of(1, b"bc"), part_of(1, b"", True)])
    mine.ask_time()
    mine.until(lambda: mine.times, "time reply")


BARE = {"channel": 500, "name": "no name at all", "type": None, "origins": 7}


@pytest.mark.parametrize(
    "kind",
    [
        "of_tomorrow",
        "parameters",
        "action",
    ],
)
def test_kind_that_is_not_forwarded(peer, kind):
    """No member but channel, kind and name is read."""
    mine = peer()
    mine.send_control(type="offer", channels=[{**BARE, "kind": kind}])
    mine.until(lambda: mine.declined.get(500), "decline")
    assert mine.declined[500][0] == "unsupported"


def test_offer_before_accepts(world, served):
    socket = open_socket(world.url)
    socket.send(HELLO)
    socket.send(encode_login("token", TOKEN))
    decode_welcome(socket.recv(timeout=5))
    socket.send(encode_control({"type": "offer", "channels": [{**BARE, "kind": "of_tomorrow"}]}))
    got = []
    while "decline" not in got:
        data = socket.recv(timeout=5)
        if isinstance(data, str):
            got.append(json.loads(data)["type"])
    assert got[0] == "accepts" and "offer" not in got
    socket.close()


def test_fragments_of_websocket_mean_nothing(world):
    socket = open_socket(world.url)
    login = encode_login("token", TOKEN)
    socket.send([HELLO[:3], HELLO[3:]])
    socket.send([login[:7], login[7:9], login[9:]])
    decode_welcome(socket.recv(timeout=5))
    socket.close()
