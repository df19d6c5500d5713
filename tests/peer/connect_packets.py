"""Section 6 of docs/protocol.md: frames, bodies and fragments."""

import ctypes
import ctypes.util
import struct

from connect_columns import columns_decode
from connect_records import ILLEGAL, MALFORMED, MESSAGE_MAX, STAMP_MAX, TOO_LARGE, Refused, require

SAMPLE_MAX = 64 << 20
OPEN_MAX = 256 << 20
MESSAGE = "<BBHIIIqQIII"
CODECS = (
    *("none", "lz4", "zstd", "zstd_base", "zstd_delta"),
    *("picture_base", "picture_delta"),  # not decoded here, and not asked for
    *("cloud", "planes"),
)
BASE_MAX = 32768
TEXTS_MAX = 32768  # of one frame
TEXTS_KEPT = 262144  # of a direction


def encode_frame(frame):
    kind, part = frame["type"], frame.get("part", b"")
    if kind == "message":
        numbers = [
            frame[key]
            for key in (
                *("demand", "channel", "origin", "sequence"),
                *("stamp_ns", "number", "raw_bytes", "body_bytes"),
            )
        ]
        return struct.pack(MESSAGE, 1, CODECS.index(frame["codec"]), *numbers, len(part)) + part
    if kind == "part":
        return struct.pack("<BBHII", 2, frame["abort"], 0, frame["channel"], len(part)) + part
    if kind == "texts":
        head = struct.pack("<BBHII", 7, frame["kept"], 0, frame["raw_bytes"], len(frame["body"]))
        return head + frame["body"]
    if kind == "ack":
        return struct.pack("<QQq", 3, frame["received_bytes"], frame["arrived"])
    if kind == "ack_request":
        return struct.pack("<Q", 6)
    if kind == "time_request":
        return struct.pack("<Qq", 4, frame["t1"])
    return struct.pack("<Qqqqq", 5, *(frame[key] for key in ("t1", "t2", "t3", "ros")))


def encode_packet(frames):
    return b"".join(map(encode_frame, frames))


def _take(data, at, layout):
    require(len(data) - at >= struct.calcsize(layout), "a frame cut short")
    return struct.unpack_from(layout, data, at), at + struct.calcsize(layout)


def _take_part(data, at, size):
    require(len(data) - at >= size, "a part cut short")
    return bytes(data[at : at + size]), at + size


def _stamps(*values):
    require(all(0 <= value <= STAMP_MAX for value in values), "a stamp out of range")


def decode_packet(data):
    require(len(data) <= MESSAGE_MAX, "packet too long", TOO_LARGE)
    frames, at = [], 0
    while at < len(data):
        kind = data[at]
        if kind == 1:
            (_, codec, demand, channel, origin, sequence, stamp, count, raw, body, p), at = _take(
                data, at, MESSAGE
            )
            require(codec < len(CODECS) and channel and origin and sequence, "message frame")
            require(p <= body and (p or not body), "size of the part")
            require(raw == body if codec == 0 else raw and body, "sizes of the message")
            require(codec == 0 or body <= raw + raw // 128 + 128, "size of a compressed body")
            require(codec not in (3, 4) or raw <= BASE_MAX, "size of a base")
            _stamps(stamp)
            part, at = _take_part(data, at, p)
            frame = dict(
                type="message",
                codec=CODECS[codec],
                channel=channel,
                origin=origin,
                sequence=sequence,
                demand=demand,
                stamp_ns=stamp,
                number=count,
            )
            frames.append(dict(frame, raw_bytes=raw, body_bytes=body, part=part))
        elif kind == 2:
            (_, flags, zero, channel, p), at = _take(data, at, "<BBHII")
            require(flags < 2 and zero == 0 and channel, "part frame")
            require((p == 0) == (flags == 1), "size of the part")
            part, at = _take_part(data, at, p)
            frames.append(dict(type="part", abort=flags == 1, channel=channel, part=part))
        elif kind == 7:
            (_, flags, zero, raw, p), at = _take(data, at, "<BBHII")
            require(flags < 2 and zero == 0 and raw and p, "frame of texts")
            require(raw <= TEXTS_MAX and p <= raw + raw // 128 + 128, "size of texts")
            body, at = _take_part(data, at, p)
            frames.append(dict(type="texts", kept=flags == 1, raw_bytes=raw, body=body))
        elif kind in (3, 4, 5, 6):
            layouts = {3: "<QQq", 4: "<Qq", 5: "<Qqqqq", 6: "<Q"}
            (head, *values), at = _take(data, at, layouts[kind])
            require(head == kind, "a zero field")
            if kind == 3:
                _stamps(values[1])
                frames.append(dict(type="ack", received_bytes=values[0], arrived=values[1]))
                continue
            if kind == 6:
                frames.append(dict(type="ack_request"))
                continue
            _stamps(*values)
            names = ("t1", "t2", "t3", "ros")
            frames.append(
                dict(zip(names, values), type="time_request" if kind == 4 else "time_reply")
            )
        else:
            raise Refused(MALFORMED, f"frame type {kind}")
    return frames


def frames_of(channel, origin, sequence, stamp, sample, part=65536, codec="none", body=None, **own):
    """A sample as frames."""
    body = sample if body is None else body
    head = dict(
        type="message",
        codec=codec,
        channel=channel,
        origin=origin,
        sequence=sequence,
        demand=own.get("demand", 0),
        stamp_ns=stamp,
        number=own.get("number", 0),
    )
    yield dict(head, raw_bytes=len(sample), body_bytes=len(body), part=body[:part])
    for at in range(part, len(body), part):
        yield dict(type="part", abort=False, channel=channel, part=body[at : at + part])


def lz4_decompress(body, size):
    """One block of lz4's block format."""
    out, at = bytearray(), 0

    def length(nibble):
        nonlocal at
        total = nibble
        while nibble == 15:
            require(at < len(body), "lz4 cut short")
            at += 1
            total += body[at - 1]
            if body[at - 1] != 255:
                break
        return total

    while True:
        require(at < len(body), "lz4 cut short")
        token = body[at]
        at += 1
        literals = length(token >> 4)
        require(at + literals <= len(body) and len(out) + literals <= size, "lz4 literals")
        out += body[at : at + literals]
        at += literals
        if at == len(body):
            break
        require(at + 2 <= len(body), "lz4 cut short")
        offset = body[at] | body[at + 1] << 8
        at += 2
        count = length(token & 15) + 4
        require(1 <= offset <= len(out) and len(out) + count <= size, "lz4 match")
        piece = bytes(out[-offset:])
        out += (piece * (count // offset + 1))[:count]
    require(len(out) == size, "lz4 of another size")
    return bytes(out)


def _load_zstd():
    name = ctypes.util.find_library("zstd")
    if not name:
        return None
    library = ctypes.CDLL(name)
    for function in (
        "ZSTD_decompress",
        "ZSTD_compress",
        "ZSTD_compressBound",
        "ZSTD_findFrameCompressedSize",
    ):
        getattr(library, function).restype = ctypes.c_size_t
    library.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
    library.ZSTD_createDCtx.restype = ctypes.c_void_p
    library.ZSTD_createCCtx.restype = ctypes.c_void_p
    library.ZSTD_decompressDCtx.restype = ctypes.c_size_t
    library.ZSTD_compress2.restype = ctypes.c_size_t
    return library


ZSTD = _load_zstd()  # None: this machine has no libzstd


def _size(value):
    return ctypes.c_size_t(value)


def zstd_decompress(body, size):
    require(body[:4] == b"\x28\xb5\x2f\xfd", "no zstd frame")
    require(
        ZSTD.ZSTD_findFrameCompressedSize(body, _size(len(body))) == len(body), "not one zstd frame"
    )
    require(ZSTD.ZSTD_getFrameContentSize(body, _size(len(body))) == size, "zstd of another size")
    out = ctypes.create_string_buffer(size)
    require(ZSTD.ZSTD_decompress(out, _size(size), body, _size(len(body))) == size, "zstd broken")
    return out.raw


def zstd_compress(sample):
    room = ZSTD.ZSTD_compressBound(_size(len(sample)))
    out = ctypes.create_string_buffer(room)
    size = ZSTD.ZSTD_compress(out, _size(room), sample, _size(len(sample)), 3)
    return out.raw[:size]


def delta_decompress(body, base, size):
    """A body of zstd_base (no base) or of zstd_delta."""
    require(body[:4] == b"\x28\xb5\x2f\xfd" and body[4] & 4, "no zstd frame with a checksum")
    require(
        ZSTD.ZSTD_findFrameCompressedSize(body, _size(len(body))) == len(body), "not one zstd frame"
    )
    require(ZSTD.ZSTD_getFrameContentSize(body, _size(len(body))) == size, "zstd of another size")
    out = ctypes.create_string_buffer(size)
    context = ctypes.c_void_p(ZSTD.ZSTD_createDCtx())
    ZSTD.ZSTD_DCtx_refPrefix(context, base, _size(len(base)))
    got = ZSTD.ZSTD_decompressDCtx(context, out, _size(size), body, _size(len(body)))
    ZSTD.ZSTD_freeDCtx(context)
    require(got == size, "zstd broken, or of another base")
    return out.raw


class TextHistory:
    """The texts that cross compressed in one direction of a connection."""

    def __init__(self):
        self.texts = b""

    def read(self, frame, named=b""):
        """The texts of a frame; `named`: what this side has kept of an earlier connection."""
        if frame["kept"]:
            require(named, "texts that were not named")
            self.texts = named
        raw = delta_decompress(frame["body"], self.texts, frame["raw_bytes"])
        self.texts = (self.texts + raw)[-TEXTS_KEPT:]
        texts = raw.split(b"\n")
        require(len(texts) <= 64, "too many texts", TOO_LARGE)
        return [text.decode() for text in texts]


def delta_compress(sample, base, checksum=True):
    room = ZSTD.ZSTD_compressBound(_size(len(sample)))
    out = ctypes.create_string_buffer(room)
    context = ctypes.c_void_p(ZSTD.ZSTD_createCCtx())
    ZSTD.ZSTD_CCtx_setParameter(context, 201, int(checksum))  # ZSTD_c_checksumFlag
    ZSTD.ZSTD_CCtx_refPrefix(context, base, _size(len(base)))
    size = ZSTD.ZSTD_compress2(context, out, _size(room), sample, _size(len(sample)))
    ZSTD.ZSTD_freeCCtx(context)
    return out.raw[:size]


def decompress(codec, body, size):
    if codec in ("cloud", "planes"):
        return columns_decode(codec, body, size, zstd_decompress)
    require(codec in CODECS[:3], "a codec that no demand names")
    return (
        body
        if codec == "none"
        else (lz4_decompress if codec == "lz4" else zstd_decompress)(body, size)
    )


class Reassembly:
    """Turns frames into samples, as section 6 requires."""

    def __init__(self):
        self._open = {}  # channel: (first frame, bytearray)
        self._last = {}  # channel: sequence
        self._bases = {}  # (channel, demand, origin): raw
        self.lost = 0

    def go_on(self, last):
        """Channels without any message yet begin after these sequences."""
        self._last.update(last)

    def add(self, frame):
        """The first frame and the sample, when it is whole."""
        channel = frame["channel"]
        if frame["type"] == "part":
            require(channel in self._open, "no message is open", ILLEGAL)
            if frame["abort"]:
                del self._open[channel]
                return None
            head, body = self._open[channel]
            require(
                len(body) + len(frame["part"]) <= head["body_bytes"], "more than the body lacks"
            )
            body += frame["part"]
        else:
            require(channel not in self._open, "a message is open", ILLEGAL)
            ahead = (frame["sequence"] - self._last.get(channel, 0)) % 0xFFFFFFFF
            require(0 < ahead < 1 << 31, "the sequence does not rise", ILLEGAL)
            self.lost += ahead - 1
            self._last[channel] = frame["sequence"]
            require(
                max(frame["raw_bytes"], frame["body_bytes"]) <= SAMPLE_MAX, "too large", TOO_LARGE
            )
            head, body = frame, bytearray(frame["part"])
            self._open[channel] = head, body
            total = sum(each["body_bytes"] for each, _ in self._open.values())
            require(total <= OPEN_MAX, "too much is open", TOO_LARGE)
        if len(body) < head["body_bytes"]:
            return None
        del self._open[channel]
        return head, self._raw(head, bytes(body))

    def _raw(self, head, body):
        if not head["codec"].startswith("zstd_"):
            return decompress(head["codec"], body, head["raw_bytes"])
        key = head["channel"], head["demand"], head["origin"]
        base = b""
        if head["codec"] == "zstd_delta":
            require(key in self._bases, "no base")
            base = self._bases[key]
        raw = self._bases[key] = delta_decompress(body, base, head["raw_bytes"])
        return raw

    def forget(self, channel):
        self._open.pop(channel, None)
