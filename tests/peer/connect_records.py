"""Sections 1 and 3 of docs/protocol.md: text, and the records of the login."""

import re
import struct

RECORD_MAX = 4096
MESSAGE_MAX = 1 << 20
STAMP_MAX = (1 << 62) - 1
MALFORMED, TOO_LARGE, SILENT, ILLEGAL, UNKNOWN_CHANNEL = 4002, 4006, 4008, 4009, 4010


class Refused(Exception):
    """What arrived is refused: the connection is closed with this code."""

    def __init__(self, code, why):
        super().__init__(f"{code}: {why}")
        self.code, self.why = code, why


def require(condition, why, code=MALFORMED):
    if not condition:
        raise Refused(code, why)


def check_text(text):
    require(not re.search("[\x00-\x1f\x7f-\x9f\ud800-\udfff]", text), "text with what is no text")
    return text


def text_of(data):
    try:
        return check_text(bytes(data).decode())
    except UnicodeDecodeError:
        raise Refused(MALFORMED, "no UTF-8") from None


def encode_hello(version_min=1, version_max=1, side=b"", session=bytes(16), node=""):
    node = node.encode()
    head = struct.pack("<4sHH16s16sH", b"R2CH", version_min, version_max, side, session, len(node))
    return head + node


def encode_login(method="token", credential=b""):
    method = method.encode()
    return struct.pack("<4sHH", b"R2CL", len(method), len(credential)) + method + credential


def encode_welcome(version, side, session, dead_after_ms, message_bytes_max, node, identity):
    node, identity = node.encode(), identity.encode()
    head = ("<4sHHII16s16sHH", b"R2CW", version, 0, dead_after_ms, message_bytes_max, side, session)
    return struct.pack(*head, len(node), len(identity)) + node + identity


def _fields(data, layout, magic):
    require(len(data) <= RECORD_MAX, "record too long", TOO_LARGE)
    require(data[:4] == magic, "another magic")
    require(len(data) >= struct.calcsize(layout), "record cut short")
    return struct.unpack_from(layout, data)[1:]


def decode_hello(data):
    low, high = _fields(data, "<4sHH", b"R2CH")
    require(1 <= low <= high, "no range of versions")
    require(low == 1, "no shared version", 4001)
    low, high, side, session, n = _fields(data, "<4sHH16s16sH", b"R2CH")
    require(any(side), "side id zero")
    require(n <= 255, "node name too long", TOO_LARGE)
    require(len(data) == 42 + n, "length of hello")
    node = text_of(data[42:])
    return dict(version_min=low, version_max=high, side=side, session=session, node=node)


def decode_login(data):
    m, c = _fields(data, "<4sHH", b"R2CL")
    require(1 <= m <= 32, "length of the method")
    require(c <= 3900, "credential too long", TOO_LARGE)
    require(len(data) == 8 + m + c, "length of login")
    method = data[8 : 8 + m]
    require(re.fullmatch(b"[a-z0-9_]+", method), "method")
    return dict(method=method.decode(), credential=data[8 + m :])


def decode_welcome(data):
    (version,) = _fields(data, "<4sH", b"R2CW")
    require(version == 1, "a version that was not asked for", 4001)
    _, zero, dead, most, side, session, n, i = _fields(data, "<4sHHII16s16sHH", b"R2CW")
    require(zero == 0, "a zero field")
    require(dead == 0 or 100 <= dead <= 600_000, "dead_after_ms")
    require(any(side) and any(session), "side or session zero")
    require(n <= 255 and i <= 1024, "node or identity too long", TOO_LARGE)
    require(len(data) == 52 + n + i, "length of welcome")
    node, identity = text_of(data[52 : 52 + n]), text_of(data[52 + n :])
    limits = dict(dead_after_ms=dead, message_bytes_max=most)
    return dict(version=1, side=side, session=session, node=node, identity=identity, **limits)
