"""Strangers at the port: closed, each within its time, while others are served."""

import contextlib
import os
import socket
import threading
import time

import pytest
from connect_bridge_test_interfaces.msg import Blob
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect as dial

from conftest import OPEN
from graph import until

PROTOCOL = "ros2-connect.v1"
HTTP_TIMEOUT = 5.0  # for what comes before it


class Stream:
    """A message every 20 ms from robot to operator; how long it ever paused."""

    def __init__(self, pair):
        self._publisher, self._collector = pair.opened(Blob, "/t/served", Blob())
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while not self._stop.wait(0.02):
            self._publisher.publish(Blob(data=bytes(1000)))

    def longest_pause(self):
        times = list(self._collector.times)
        return max(b - a for a, b in zip(times, times[1:]))

    def stop(self):
        self._stop.set()
        self._thread.join()


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """A pair with a stream; checks at the end of each test that the stream never paused long."""
    from conftest import Pair

    pair = Pair(tmp_path_factory.mktemp("served"), server=OPEN)
    stream = Stream(pair)
    yield pair
    stream.stop()
    pause = stream.longest_pause()
    connects = pair.client.links()[0]["connects"]
    pair.close()
    assert pause < 1.0, f"the stream paused for {pause:.2f} s"
    assert connects == 1, "the good link broke"


def closed_after(connection, timeout=8.0):
    """Seconds until the server has closed a raw connection."""
    begin = time.monotonic()
    connection.settimeout(timeout)
    try:
        while connection.recv(4096):
            pass
    except ConnectionError:
        pass
    except TimeoutError:
        raise AssertionError(f"still open after {timeout} s") from None
    return time.monotonic() - begin


def raw(pair):
    return socket.create_connection(("127.0.0.1", pair.bridge.port))


def websocket(pair, **options):
    options = {"subprotocols": [PROTOCOL], "compression": None, **options}
    return dial(f"ws://127.0.0.1:{pair.bridge.port}", **options)


def close_of(connection, timeout=8.0):
    """The code and reason with which the server closed."""
    with pytest.raises(ConnectionClosed) as closed:
        while True:
            connection.recv(timeout)
    assert closed.value.rcvd, "no close frame: the server just went away"
    return closed.value.rcvd.code, closed.value.rcvd.reason


@pytest.mark.parametrize(
    "noise",
    [
        b"\x00" * 1000,
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"\xab" * 200,
        b"GET / HTTP/1.1\r\nHost: x\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999999\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X-Long: " + b"y" * 200_000,
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20_000,
        b"SSH-2.0-OpenSSH_9.2\r\n",
    ],
    ids=["zeros", "tls", "plain-get", "post", "long-header", "many-headers", "ssh"],
)
def test_what_is_no_websocket(served, noise):
    with raw(served) as connection:
        try:
            connection.sendall(noise)
        except ConnectionError:
            return  # closed already
        assert closed_after(connection) < HTTP_TIMEOUT + 2


def test_random_bytes(served):
    for _ in range(50):
        with raw(served) as connection:
            try:
                connection.sendall(os.urandom(2000) + b"\r\n\r\n")
            except ConnectionError:
                continue
            assert closed_after(connection) < HTTP_TIMEOUT + 2


@pytest.mark.parametrize(
    "first",
    [
        "{}",
        b"",
        b"\x00",
        b"\xff" * 100,
        b"\x00" * 5000,
        os.urandom(3000),
        "x" * 100_000,
        b"\x01" * 5_000_000,
    ],
    ids=["text", "empty", "zero", "ones", "too-long", "random", "long-text", "5MB"],
)
def test_a_bad_first_message_is_closed_with_a_code(served, first):
    connection = websocket(served, max_size=None)
    try:
        connection.send(first)
    except ConnectionClosed:
        pass
    code, reason = close_of(connection)
    # A message that is larger than any login never reaches our code: Beast closes with 1009.
    assert code == 1009 or (code >= 4000 and reason), (code, reason)


def test_a_slow_http_request(served):
    """Single bytes do not keep a connection open for longer than five seconds."""
    with raw(served) as connection:
        begin = time.monotonic()
        with pytest.raises((ConnectionError, AssertionError)):
            for byte in b"GET / HTTP/1.1\r\nHost: localhost\r\n" * 4:
                connection.sendall(bytes([byte]))
                connection.settimeout(0.1)
                try:
                    assert connection.recv(1), "closed"
                except TimeoutError:
                    pass
        assert time.monotonic() - begin < HTTP_TIMEOUT + 2


def test_a_hundred_slow_ones_at_once(served):
    """They cost little, and the next valid client still gets in."""
    before, files = served.server.resident_bytes(), open_files(served.server)
    crowd = []
    for _ in range(100):
        connection = raw(served)
        crowd.append(connection)
        with contextlib.suppress(ConnectionError):  # so many at once are not all let in
            connection.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n")
    assert served.server.resident_bytes() - before < 10 << 20
    for connection in crowd:
        closed_after(connection)
        connection.close()
    until(lambda: open_files(served.server) <= files, "the server has let all of them go", 10)


def open_files(side):
    return len(os.listdir(f"/proc/{side.pid}/fd"))
