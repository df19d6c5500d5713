"""Shared by the tests of the peer: the server with its graph, a stream, and messages to send."""

import contextlib
import json
import os
import pathlib
import struct
import sys
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "e2e"), str(HERE.parents[1] / "tools")]
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"  # of the contexts in this process

import pytest  # noqa: E402
from graph import Graph, until  # noqa: E402
from harness.domains import free_port, release_domains, take_domains  # noqa: E402
from harness.programs import Side  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from tokens import entry, write_tokens  # noqa: E402
from websockets.exceptions import ConnectionClosed  # noqa: E402

from connect_packets import ZSTD, encode_packet  # noqa: E402
from connect_peer import Peer, open_socket  # noqa: E402
from connect_records import encode_hello  # noqa: E402

TOKEN = b"token-of-the-python-peer"
STRING, BYTES, TWIST = (
    "std_msgs/msg/String",
    "std_msgs/msg/UInt8MultiArray",
    "geometry_msgs/msg/Twist",
)
# One identity tries here what earns an end, again and again.
LIMITS = {"offences_per_minute": 1_000_000}
RULES = {
    "rules": ["lz4", "zstd", "slow", "timed", "resumed", "all"],
    "rule": {
        "lz4": {"export_topics": ["/t/lz4"], "compression": "lz4"},
        "zstd": {
            "export_topics": ["/t/zstd"],
            "export_services": ["/s/zstd/*"],
            "compression": "zstd",
        },
        "slow": {"export_services": ["/s/slow/*"], "calls_max": 1},
        "timed": {"export_services": ["/s/timed/*"], "call_timeout": 0.5},
        # A robot asks for nothing else that was lost.
        "resumed": {"import_topics": ["/o/resumed"], "resume": True},
        "all": {
            "compression": "none",  # a peer is slow to answer, as if the path were long
            "export_topics": ["/t/**"],
            "import_topics": ["/o/**", "/cmd_vel"],
            "export_services": ["/s/**"],
            "import_services": ["/p/**"],
            "export_actions": ["/a/**"],
            "import_actions": ["/b/**"],
            "parameters": ["/open_node"],
        },
    },
}
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
without_zstd = pytest.mark.skipif(ZSTD is None, reason="this machine has no libzstd")


def vectors(name):
    return json.loads((HERE.parent / "vectors" / f"{name}.json").read_text(encoding="utf-8"))


def named(entries):
    return pytest.mark.parametrize("vector", entries, ids=[entry["name"] for entry in entries])


def cdr_string(text):
    data = text.encode() + b"\0"
    return b"\0\1\0\0" + struct.pack("<I", len(data)) + data


def string_of(cdr):
    assert cdr[:4] in (b"\0\1\0\0", b"\0\1\0\1", b"\0\1\0\2", b"\0\1\0\3"), cdr[:4].hex()
    (size,) = struct.unpack_from("<I", cdr, 4)
    assert cdr[7 + size] == 0
    return cdr[8 : 7 + size].decode()


def cdr_bytes(data):
    return b"\0\1\0\0" + struct.pack("<III", 0, 0, len(data)) + data


def event_of(node, second=1, order="<"):
    """A ParameterEvent without parameters."""
    text = node.encode() + b"\0"
    data = struct.pack(f"{order}iII", second, 0, len(text)) + text
    data += bytes(-len(data) % 4) + bytes(12)
    return (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") + data


def bytes_of(cdr):
    (size,) = struct.unpack_from("<I", cdr, 12)
    return cdr[16 : 16 + size]


def token_of(identity):
    return f"token-of-{identity}-alone".encode()


def token_file(folder, tokens):
    """A server's file with the hashes of these: identity -> token."""
    entries = [entry(identity, token.decode(), ()) for identity, token in tokens.items()]
    return write_tokens(folder / "tokens.yaml", *entries)


class World:
    """The server with its graph. `parameters` are added to those that it has for all tests; with
    `identities` each of them logs in with token_of() of it, in place of TOKEN."""

    def __init__(self, folder, identities=(), **parameters):
        self.domains = take_domains(1)
        self.graph = Graph(self.domains[0])
        self.port = free_port()
        self.url = f"ws://127.0.0.1:{self.port}"
        listen = {"address": "127.0.0.1", "port": self.port}
        auth = {"method": "token", "token": TOKEN.decode()}
        if identities:
            tokens = {identity: token_of(identity) for identity in identities}
            auth = {"method": "token", "token_file": token_file(folder, tokens)}
        self.server = Side(
            "server",
            self.domains[0],
            {
                "listen": listen,
                "auth": auth,
                "limits": LIMITS,
                "connections_max": 500,
                **RULES,
                **parameters,
            },
            folder,
        )
        self.server.start().wait_listening()

    def close(self):
        code = self.server.stop()
        self.graph.close()
        release_domains(self.domains)
        assert code == 0, self.server.text()


class Ticker:
    """A publisher that publishes every 20 ms, and a peer that must receive it all the time."""

    def __init__(self, world):
        self._publisher = world.graph.publisher(String, "/t/tick")
        self._peer = Peer(world.url, TOKEN)
        self._channel = self._peer.find("/t/tick")
        self._peer.demand(self._channel)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self.goes_on()

    def _run(self):
        while not self._stop.wait(0.02):
            self._publisher.publish(String(data="tick"))

    def goes_on(self):
        have = len(self._peer.samples.get(self._channel, ()))
        self._peer.wait_samples(self._channel, have + 2)

    def stop(self):
        self._stop.set()
        self._thread.join()
        assert self._peer.closed is None
        self._peer.close()


def closed_with(socket, timeout=8.0):
    """The code with which the server closes; nothing else may arrive before."""
    with pytest.raises(ConnectionClosed) as closed:
        got = socket.recv(timeout=timeout)
        pytest.fail(f"the server sent {got!r}")
    assert closed.value.rcvd, "no close frame"
    assert len(closed.value.rcvd.reason.encode()) <= 120
    return closed.value.rcvd.code


def say(world, *messages):
    """The close code for these messages before login."""
    socket = open_socket(world.url)
    with contextlib.suppress(ConnectionClosed):
        for message in messages:
            socket.send(message)
    return closed_with(socket)


SIDE = bytes(range(1, 17))
HELLO = encode_hello(side=SIDE)


BAD_BYTES = vectors("malformed")
BAD_TEXTS = vectors("malformed_control")


def packet(*frames):
    return encode_packet(frames)


def message(channel, sequence, part, body_bytes=None, **more):
    size = len(part) if body_bytes is None else body_bytes
    head = dict(
        type="message",
        codec="none",
        channel=channel,
        origin=1,
        sequence=sequence,
        demand=1,
        stamp_ns=1,
        number=0,
    )
    return dict(head, raw_bytes=size, body_bytes=size, part=part, **more)


def part_of(channel, part, abort=False):
    return dict(type="part", abort=abort, channel=channel, part=part)


OFFER = [("/o/states", STRING, "volatile")]


def publish_until(publisher, make, arrived):
    """Publishes repeatedly until a message has arrived."""

    def go():
        publisher.publish(make())
        time.sleep(0.02)
        return arrived()

    until(go, "a message that crosses")
