"""Every vector of tests/vectors, decoded and encoded by the peer itself."""

import pytest

from connect_control import decode_control, encode_control
from connect_packets import ZSTD, decode_packet, decompress, delta_decompress, encode_packet
from connect_records import (
    Refused,
    decode_hello,
    decode_login,
    decode_welcome,
    encode_hello,
    encode_login,
    encode_welcome,
)
from peer_world import BAD_BYTES, BAD_TEXTS, named, vectors

DECODE = {
    "packet": decode_packet,
    "hello": decode_hello,
    "login": decode_login,
    "welcome": decode_welcome,
}
ENCODE = {"hello": encode_hello, "login": encode_login, "welcome": encode_welcome}


def plain(value):
    return value.hex() if isinstance(value, bytes) else value


@named(vectors("records"))
def test_record(vector):
    kind, data = vector["record"], bytes.fromhex(vector["hex"])
    fields = DECODE[kind](data)
    assert {key: plain(value) for key, value in fields.items()} == vector["fields"]
    assert ENCODE[kind](**fields) == data


@named(vectors("packets"))
def test_packet(vector):
    data = bytes.fromhex(vector["hex"])
    frames = decode_packet(data)
    assert [{key: plain(value) for key, value in frame.items()} for frame in frames] == vector[
        "frames"
    ]
    assert encode_packet(frames) == data


@named(vectors("control"))
def test_control(vector):
    assert encode_control(decode_control(vector["text"])) == vector["text"]


@pytest.mark.parametrize("vector", vectors("compression"), ids=lambda vector: vector["codec"])
def test_compression(vector):
    if vector["codec"] != "lz4" and ZSTD is None:
        pytest.skip("this machine has no libzstd")
    raw, body = bytes.fromhex(vector["raw"]), bytes.fromhex(vector["body"])
    base = bytes.fromhex(vector.get("base", ""))

    def read(body, size, base=base):
        if vector["codec"].startswith("zstd_"):
            return delta_decompress(body, base, size)
        return decompress(vector["codec"], body, size)

    assert read(body, len(raw)) == raw
    for broken in (body[:-1], body + b"\0"):
        with pytest.raises(Refused):
            read(broken, len(raw))
    with pytest.raises(Refused):
        read(body, len(raw) + 1)
    if base:
        with pytest.raises(Refused):
            read(body, len(raw), base.swapcase())


def test_malformed_is_refused_by_the_peer():
    for vector in BAD_BYTES:
        with pytest.raises(Refused) as refused:
            DECODE[vector["kind"]](bytes.fromhex(vector["hex"]))
        assert refused.value.code == vector["close"], vector["name"]
    for vector in BAD_TEXTS:
        with pytest.raises(Refused) as refused:
            decode_control(vector["text"])
        assert refused.value.code == vector["close"], vector["name"]
