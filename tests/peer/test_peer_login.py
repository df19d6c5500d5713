"""Transport and login, and every way in which they fail."""

import time

import pytest
from websockets.exceptions import InvalidStatus

from connect_control import is_accepted
from connect_peer import Peer, open_socket
from connect_records import decode_welcome, encode_hello, encode_login
from peer_world import BAD_BYTES, HELLO, SIDE, TOKEN, TWIST, named, say


def test_welcome_and_opening(world, peer):
    mine = peer()
    assert mine.welcome["dead_after_ms"] == 3000
    assert mine.welcome["message_bytes_max"] == 64 << 20
    assert mine.welcome["node"] == "/connect_server"
    assert not mine.socket.protocol.extensions
    mine.until(lambda: mine.accepts and mine.complete, "accepts and a complete offer")
    assert is_accepted(mine.accepts, "/cmd_vel", TWIST)
    assert not is_accepted(mine.accepts, "/not/allowed", TWIST)


@pytest.mark.parametrize(
    "options, status",
    [({"subprotocols": ["other.v1"]}, 400), ({"subprotocols": None}, 400)],
    ids=["another subprotocol", "no subprotocol"],
)
def test_upgrade_is_refused(world, options, status):
    with pytest.raises(InvalidStatus) as refused:
        open_socket(world.url, **options)
    assert refused.value.response.status_code == status


def test_deflate_is_never_accepted(world):
    socket = open_socket(world.url, compression="deflate")
    assert not socket.protocol.extensions
    socket.close()


@pytest.mark.parametrize(
    "login",
    [
        encode_login("token", b"wrong"),
        encode_login("token", b""),
        encode_login("none"),
        encode_login("other", TOKEN),
    ],
    ids=["wrong token", "empty token", "none", "unknown method"],
)
def test_wrong_login(world, served, login):
    assert say(world, HELLO, login) == 4003


@pytest.mark.parametrize("records", [[], [HELLO]], ids=["silence", "hello alone"])
def test_no_login_within_five_seconds(world, records):
    begin = time.monotonic()
    assert say(world, *records) == 4004
    assert 4.5 < time.monotonic() - begin < 7


def test_text_before_login(world, served):
    assert say(world, "{}") == 4009
    assert say(world, HELLO, "{}") == 4009


def test_record_out_of_turn(world, served):
    assert say(world, encode_login("token", TOKEN)) == 4002
    assert say(world, HELLO, HELLO) == 4002


def test_second_login(world, served):
    mine = Peer(world.url, TOKEN)
    mine.send_raw(encode_login("token", TOKEN))
    assert mine.wait_closed() == 4002


def test_later_version(world):
    assert say(world, encode_hello(version_min=2, version_max=9, side=SIDE)) == 4001


def test_range_of_versions(world):
    socket = open_socket(world.url)
    socket.send(encode_hello(version_max=7, side=SIDE))
    socket.send(encode_login("token", TOKEN))
    assert decode_welcome(socket.recv(timeout=5))["version"] == 1
    socket.close()


def test_own_side(world, peer):
    assert (
        say(world, encode_hello(side=peer().welcome["side"]), encode_login("token", TOKEN)) == 4011
    )


@named([vector for vector in BAD_BYTES if vector["kind"] in ("hello", "login")])
def test_malformed_record(world, vector):
    before = [HELLO] if vector["kind"] == "login" else []
    data = bytes.fromhex(vector["hex"])
    codes = (4006, 1009) if len(data) > 4096 else (vector["close"],)
    assert say(world, *before, data) in codes
