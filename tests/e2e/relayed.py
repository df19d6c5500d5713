"""A relay, and two ends that are linked by it."""

import contextlib
import json
import socket
import ssl
import subprocess
import time

import pytest

from harness.domains import free_port
from harness.programs import Program, build_dir, ros_environment

ROBOT = "robot7"
NO_SUCH_NAME = bytes([21, 3, 3, 0, 2, 2, 112])


def ctl(*words):
    done = subprocess.run([build_dir() / "ctl", *map(str, words)], check=True, capture_output=True)
    return done.stdout.decode().strip()


class AtRelay:
    """A relay with a robot, and the files for both ends."""

    def __init__(self, folder):
        self.folder, self.port = folder, free_port()
        self.dialled = self.port
        ctl("certs", folder / "relay", "--host", "localhost")
        ctl("certs", folder / "robot", "--host", ROBOT)
        self.token = folder / f"{ROBOT}.token"
        self.token.write_text(ctl("token", ROBOT, "--file", folder / "robots.yaml"))
        self.token.chmod(0o600)
        self.file = folder / "relay.yaml"
        self.write(f"{folder}/relay")
        self.program = self.another(self.file, "relay")

    def another(self, file, name):
        return Program(name, [build_dir() / "relay", file], ros_environment(0), self.folder)

    def write(self, certificates, **listen):
        text = {
            "listen": {"address": "127.0.0.1", "port": self.port, **listen},
            "status": {"listen": f"127.0.0.1:{free_port()}"},
            "tls": {
                "certificate": f"{certificates}/server.crt",
                "private_key": f"{certificates}/server.key",
            },
            "auth": {"token_file": str(self.folder / "robots.yaml")},
        }
        self.file.write_text(json.dumps(text))

    def start(self):
        self.program.start()
        self.program.wait_for("listens on port")

    def server(self):
        """The parameters of the robot's server."""
        relay = {
            "url": f"wss://{ROBOT}@localhost:{self.dialled}/",
            "token_file": str(self.token),
            "ca": f"{self.folder}/relay/ca.crt",
        }
        keys = f"{self.folder}/robot"
        return {
            "listen": {"port": 0, "relay": relay},
            "tls": {"certificate": f"{keys}/server.crt", "private_key": f"{keys}/server.key"},
        }

    def client(self, port=None):
        return {
            "url": f"wss://{ROBOT}@localhost:{port or self.dialled}/",
            "tls": {"ca": f"{self.folder}/robot/ca.crt"},
        }


@pytest.fixture
def relay(tmp_path):
    made = AtRelay(tmp_path)
    made.start()
    yield made
    with contextlib.suppress(RuntimeError):
        made.program.stop()


@pytest.fixture
def joined(make_pair, relay):
    """Makes a pair that is linked by the relay; `client_by`: the port that the client dials."""

    def make(start=True, client_by=None, **both):
        pair = make_pair(start=False)
        pair.server.set_parameters(
            {**pair.server.parameters, **relay.server(), **both}
        )
        pair.client.set_parameters(
            {**pair.client.parameters, **relay.client(port=client_by), **both}
        )
        if start:
            pair.server.start().wait_for("connected to the relay")
            pair.client.start().wait_linked()
        return pair

    return make


def tls_hello(name, protocols=()):
    """The ClientHello of a client, as bytes."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    if protocols:
        context.set_alpn_protocols(list(protocols))
    into, out = ssl.MemoryBIO(), ssl.MemoryBIO()
    line = context.wrap_bio(into, out, server_hostname=name)
    with contextlib.suppress(ssl.SSLWantReadError):
        line.do_handshake()
    return out.read()


def answer_to(port, sent, seconds=8.0):
    """All that comes back, and after how long the connection was closed."""
    begin = time.monotonic()
    with socket.create_connection(("127.0.0.1", port), seconds) as line:
        got = b""
        with contextlib.suppress(ConnectionResetError, BrokenPipeError):
            line.sendall(sent)
            while part := line.recv(4096):
                got += part
    return got, time.monotonic() - begin
