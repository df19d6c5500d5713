"""Behind nginx, HAProxy, Apache httpd and Caddy, configured as docs/proxies.md shows.

A kind of proxy is skipped where the program is not there (tools/setup/proxies.sh fetches them)."""

import array
import concurrent.futures
import contextlib
import socket
import ssl
import time

import pytest
import yaml
from connect_bridge_test_interfaces.msg import Blob

from graph import qos, until
from harness.domains import free_port
from proxies import PROXIES, HaProxy, HaProxyTcp, Nginx, blocks
from test_restarts import Ticker

PARTS = 3
LARGE = (64 << 20) - 64  # bytes of data; the message is just within max_message_size
LIMIT = 16  # connections of an address, on the page
EVERY = pytest.mark.parametrize("kind", PROXIES, ids=lambda kind: kind.block)


def shown_parameters(kind):
    """The server's parameters on the page, but for the token."""
    shown = blocks()
    text = shown.get(f"server of {kind.block}", shown["server"])
    parameters = yaml.safe_load(text)["/**"]["ros__parameters"]
    del parameters["auth"]
    return parameters


@pytest.fixture
def behind(make_pair, authority, tmp_path):
    """Makes a proxy of a kind and a pair that is linked through it."""
    with contextlib.ExitStack() as stack:

        def make(kind, seconds=60, **both):
            pair = make_pair(start=False)
            proxy = kind.made(tmp_path, free_port(), pair.bridge.port, authority, seconds)
            parameters = shown_parameters(kind)
            parameters["listen"]["port"] = pair.bridge.port
            if "tls" in parameters:
                parameters["tls"] = {
                    "certificate": str(authority / "server.pem"),
                    "private_key": str(authority / "server.key"),
                }
            pair.server.set_parameters({**pair.server.parameters, **parameters, **both})
            pair.client.set_parameters(
                {
                    **pair.client.parameters,
                    **both,
                    "url": f"wss://localhost:{proxy.port}/robot7",
                    "tls": {"ca": str(authority / "ca.pem")},
                }
            )
            stack.callback(proxy.stop)
            proxy.start()
            pair.proxy = proxy
            pair.bridge.start()
            return pair

        yield make


def losses(pair):
    return pair.client.text().count("lost the link")


@EVERY
def test_a_topic_crosses_and_the_link_is_never_idle(behind, topic, kind):
    """It carries nothing but signs of life for longer than the proxy's timeouts."""
    pair = behind(kind, seconds=2)
    publisher, collector = pair.opened(Blob, topic, Blob(), qos(2))
    time.sleep(3.5)
    publisher.publish(Blob(sequence=1))
    assert collector.wait(1)[0].sequence == 1
    assert losses(pair) == 0, pair.client.text()
    peer = pair.server.status()["links"][0]["peer"]
    assert peer.startswith("127.0.0.1"), "the client's address, told by the proxy"
    assert "listen." not in pair.server.text() and "does not say in" not in pair.server.text()


@EVERY
def test_a_message_of_64_mib(behind, topic, kind):
    pair = behind(kind, dead_after=20.0)  # a busy machine may stand still for seconds
    publisher, collector = pair.opened(Blob, topic, Blob(), qos(2))
    publisher.publish(Blob(data=array.array("B", bytes(LARGE))))
    assert len(collector.wait(1, 120)[0].data) == LARGE


@pytest.mark.slow
@EVERY
def test_the_proxy_is_reloaded_and_restarted_under_load(behind, topic, kind):
    pair = behind(kind)
    publisher = pair.robot.publisher(Blob, topic, qos(100))
    collector = pair.operator.collector(Blob, topic, qos(100))
    ticker = Ticker(publisher)
    collector.wait(10)

    def goes_on(what):
        said = ticker.sequence
        until(lambda: collector.messages[-1].sequence > said + 10, f"messages after {what}")

    pair.proxy.reload()
    time.sleep(1)
    goes_on("a reload")
    lost = losses(pair)
    if kind.keeps:
        assert lost == 0, pair.client.text()
    pair.proxy.restart()
    goes_on("a restart")
    until(lambda: losses(pair) > lost, "the cut of the restart in the log")
    ticker.stop()
    seen = [m.sequence for m in collector.messages]
    assert seen == sorted(set(seen)), "a message came twice, or overtook another"


def upgrade(proxy, source, context):
    """A WebSocket through the proxy, from this address, that never logs in; or nothing."""
    with contextlib.suppress(OSError):
        raw = socket.create_connection(("127.0.0.1", proxy.port), 5, source_address=(source, 0))
        line = context.wrap_socket(raw, server_hostname="localhost")
        line.sendall(
            b"GET /robot7 HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\n"
            b"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
            b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            b"Sec-WebSocket-Protocol: ros2-connect.v1\r\nX-Forwarded-For: 192.0.2.66\r\n\r\n"
        )
        if line.recv(64).startswith(b"HTTP/1.1 101"):
            return line
    return None


@pytest.mark.parametrize("kind", [Nginx, HaProxy, HaProxyTcp], ids=lambda kind: kind.block)
def test_who_connects_too_often_keeps_nobody_else_out(behind, topic, authority, kind):
    """The proxy's limit of connections is one for an address, as the server's limits are."""
    pair = behind(kind)
    context = ssl.create_default_context(cafile=str(authority / "ca.pem"))
    with concurrent.futures.ThreadPoolExecutor(2 * LIMIT) as threads:
        flood = threads.map(lambda _: upgrade(pair.proxy, "127.0.0.2", context), range(2 * LIMIT))
        opened = [line for line in flood if line]
    assert LIMIT <= len(opened) < 2 * LIMIT
    assert upgrade(pair.proxy, "127.0.0.3", context), "another address is not counted with them"
    assert pair.client.stop() == 0
    pair.client.start().wait_linked()
    pair.opened(Blob, topic, Blob())
    pair.server.wait_for(r"closing 127\.0\.0\.2\b")
    assert "192.0.2.66" not in pair.server.text(), "what a client has written is believed"


def test_what_the_page_shows_is_tested():
    shown = set(blocks())
    assert shown == {"server", "server of haproxy_tcp"} | {kind.block for kind in PROXIES}
