"""Where a server listens, and how a client reaches it."""

import contextlib
import socket
import subprocess
import sys

import pytest
from connect_bridge_test_interfaces.msg import Blob

from harness.domains import free_port
from proxies import ForwardProxy

# Does what systemd does for a socket unit: the program gets a listening socket as number 3.
ACTIVATED = """
import os, socket, sys
listener = socket.create_server(("127.0.0.1", int(sys.argv[1])))
os.dup2(listener.fileno(), 3)
os.set_inheritable(3, True)
os.environ.update(LISTEN_PID=str(os.getpid()), LISTEN_FDS="1")
os.execv(sys.argv[2], sys.argv[2:])
"""

# Gives a program an /etc/hosts of its own.
OWN_HOSTS = ["unshare", "--mount", "sh", "-c", 'mount --bind "$0" /etc/hosts && exec "$@"']


def black_hole(address):
    """A listener whose queue is full: further connections get no answer."""
    listener, filling = socket.socket(), socket.socket()
    listener.bind(address)
    listener.listen(0)
    filling.connect(address)
    return [listener, filling]


def test_several_addresses(make_pair, topic):
    pair = make_pair(start=False)
    port = pair.bridge.port
    listen = {"address": "127.0.0.1, ::1", "port": port}
    pair.server.set_parameters({**pair.server.parameters, "listen": listen})
    pair.bridge.start()
    assert f"listening on ws://127.0.0.1:{port}/, ws://[::1]:{port}/\n" in pair.server.text()
    pair.opened(Blob, topic, Blob())
    assert pair.client.stop() == 0
    pair.client.set_parameters({**pair.client.parameters, "url": f"ws://[::1]:{port}"})
    pair.client.start().wait_linked()
    pair.server.wait_for(r": connected to /connect_client at \[::1\]:")
    pair.opened(Blob, f"{topic}_6", Blob())


def test_a_socket_of_systemd(make_pair, topic):
    port = free_port()
    within = ([sys.executable, "-c", ACTIVATED, str(port)], [])
    pair = make_pair(
        within=within, client={"url": f"ws://127.0.0.1:{port}"}, start=False
    )
    listen = {"listen": {"address": "systemd"}, "allow_plaintext": True}
    pair.server.set_parameters({**pair.server.parameters, **listen})
    pair.bridge.start()
    assert f"listening on ws://127.0.0.1:{port}/\n" in pair.server.text()
    pair.opened(Blob, topic, Blob())


def test_without_a_socket_of_systemd(make_side, domains):
    login = {"auth": {"token": "a-token-for-one-run"}, "allow_plaintext": True}
    server = make_side("server", domains(1)[0], {"listen": {"address": "systemd"}, **login})
    server.start().wait_for("systemd has passed no socket to this process")
    assert server.process.wait(10) == 2


def test_a_name_of_which_most_addresses_are_dead(make_pair, topic, tmp_path):
    """Each of them alone would take a second, and all of them longer than a dial may take."""
    dead, good, port = [f"127.0.0.{i}" for i in range(2, 8)], "127.0.0.9", free_port()
    hosts = tmp_path / "hosts"
    names = [f"{one} robot.test\n" for one in [*dead, good]]
    # rmw_zenoh_cpp listens at localhost.
    hosts.write_text("".join(["127.0.0.1 localhost\n", *names]), encoding="ascii")
    own = [*OWN_HOSTS, str(hosts)]
    if subprocess.run([*own, "true"], capture_output=True).returncode != 0:
        pytest.skip("no mount namespaces on this machine")
    client = {"url": f"ws://robot.test:{port}", "allow_plaintext": True}
    pair = make_pair(within=([], own), client=client, start=False)
    listen = {"listen": {"address": good, "port": port}}
    pair.server.set_parameters({**pair.server.parameters, **listen})
    with contextlib.ExitStack() as open_sockets:
        for address in dead:
            for one in black_hole((address, port)):
                open_sockets.enter_context(one)
        pair.bridge.start()
        assert "cannot connect" not in pair.client.text()
    pair.opened(Blob, topic, Blob())


@pytest.fixture
def forward(make_pair, authority, tmp_path):
    """A pair that is not started yet, whose client has a proxy to dial through."""
    pair = make_pair(start=False)
    proxy = ForwardProxy.made(tmp_path, free_port(), pair.bridge.port, authority)
    files = {"certificate": authority / "server.pem", "private_key": authority / "server.key"}
    tls = {key: str(file) for key, file in files.items()}
    pair.server.set_parameters({**pair.server.parameters, "tls": tls})
    pair.client.set_parameters(
        {
            **pair.client.parameters,
            "url": f"wss://localhost:{pair.bridge.port}",
            "tls": {"ca": str(authority / "ca.pem")},
            "http_proxy": f"http://127.0.0.1:{proxy.port}",
            "http_proxy_login": proxy.login,
        }
    )
    pair.proxy = proxy.start()
    yield pair
    proxy.stop()
    proxy.users.unlink()


def test_a_client_dials_through_a_proxy(forward, topic):
    forward.bridge.start()
    forward.opened(Blob, topic, Blob())
    forward.proxy.restart()
    forward.client.wait_for("lost the link(.|\n)*: connected to")
    assert forward.proxy.login not in forward.client.text()


def test_a_proxy_that_refuses(forward):
    forward.server.start().wait_listening()
    parameters = dict(forward.client.parameters, http_proxy_login="anna:wrong")
    forward.client.set_parameters(parameters)
    by = rf"by the proxy 127\.0\.0\.1:{forward.proxy.port}: "
    forward.client.start().wait_for(by + r"it refuses this login \(http_proxy_login\); trying")
    forward.client.stop()
    del parameters["http_proxy_login"]
    forward.client.set_parameters(parameters)
    forward.client.start().wait_for(by + r"it wants a login \(http_proxy_login\); trying")
    forward.client.stop()
    login = {"http_proxy_login": forward.proxy.login, "url": f"wss://localhost:{free_port()}"}
    forward.client.set_parameters({**parameters, **login})
    forward.client.start().wait_for(by + r"it refuses CONNECT with HTTP 403 Forbidden; trying")
