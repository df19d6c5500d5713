"""Server and client dial a relay, since nobody can dial them (docs/protocol.md, "Relay")."""

import contextlib
import hashlib
import os
import pathlib
import select
import socket
import subprocess
import threading
import time

from connect_bridge_test_interfaces.msg import Blob
from geometry_msgs.msg import Twist

from graph import until
from harness.domains import free_port
from harness.programs import Program, build_dir
from pairing import World, invitation_of, relay_line
from relayed import ROBOT, answer_to, ctl, joined, relay, tls_hello  # noqa: F401

SECRET = "a content that nobody on the way may see"


def test_topics_cross_both_ways(joined, relay, topic):
    pair = joined()
    pair.opened(Blob, topic, Blob())
    pair.opened(Twist, "/cmd_vel", Twist(), backward=True)
    link = pair.server.status()["links"][0]
    assert link["peer"].startswith("127.0.0.1"), "the visitor's address"
    assert f"{ROBOT} is connected" in relay.program.text()


def test_the_relay_starts_again(joined, relay, topic):
    pair = joined(dead_after=3.0)
    publisher, collector = pair.opened(Blob, topic, Blob())
    assert relay.program.stop() == 0
    relay.start()
    began = time.monotonic()
    pair.client.wait_for(r": connected to (.|\n)*: connected to ")
    assert time.monotonic() - began < 2.0 + 1.0  # the busy machine has the second
    publisher.publish(Blob(sequence=7))
    until(lambda: any(m.sequence == 7 for m in collector.messages), "the message after it")


def test_a_client_says_that_the_robot_is_not_there(make_side, relay, domains):
    client = make_side("client", domains(1)[0], {**relay.client(), "auth": {"token": "x" * 20}})
    client.start().wait_for(f"no '{ROBOT}' is connected to the relay there")


def test_junk_harms_nobody(joined, relay, topic):
    pair = joined()
    publisher, collector = pair.opened(Blob, topic, Blob())
    hello = tls_hello(ROBOT)
    control = tls_hello(ROBOT, ["ros2-connect-relay.v1"])
    long = b"\x16\x03\x01\x40\x00\x01\x00\x3f\xfc" + bytes(20000)
    for junk in (b"GET / HTTP/1.1\r\n\r\n", os.urandom(20000), long, b"\x16\x03\x01\x00\x00"):
        assert answer_to(relay.port, junk)[0] == b""
    # A ticket that nobody has been given.
    stolen = tls_hello(ROBOT, ["ros2-connect-ticket.v1", "0" * 64])
    assert answer_to(relay.port, stolen)[0] == b""
    # Half a hello, and a control connection that goes on with no TLS.
    waiting = [socket.create_connection(("127.0.0.1", relay.port)) for _ in range(40)]
    for line in waiting:
        line.sendall(hello[: len(hello) // 2])
    got, seconds = answer_to(relay.port, control)
    assert got.startswith(b"\x16\x03") and 4 < seconds < 8
    until(lambda: all(is_closed(line) for line in waiting), "the end of those who are slow")
    publisher.publish(Blob(sequence=9))
    until(lambda: any(m.sequence == 9 for m in collector.messages), "a message after all that")
    assert pair.client.text().count("lost the link") == 0
    assert relay.program.running()


def is_closed(line):
    readable, _, _ = select.select([line], [], [], 0)
    with contextlib.suppress(ConnectionResetError):
        return bool(readable) and line.recv(1) == b""
    return True


class Liar:
    """Stands between and does what a hostile relay can: bends bytes, and keeps what it saw."""

    def __init__(self, to):
        self.to = to
        self.seen = bytearray()
        self.bend = False
        self.instead = None  # send the next connection there
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                near, _ = self.listener.accept()
                far = socket.create_connection(("127.0.0.1", self.instead or self.to))
                for pair in ((near, far), (far, near)):
                    threading.Thread(target=self._carry, args=pair, daemon=True).start()

    def _carry(self, source, sink):
        with contextlib.suppress(OSError):
            while part := bytearray(source.recv(16384)):
                self.seen += part
                if self.bend:
                    part[len(part) // 2] ^= 4
                sink.sendall(part)
            sink.shutdown(socket.SHUT_WR)
            return
        for line in (source, sink):
            line.close()


def test_a_relay_that_bends_bytes_gets_a_lost_link(joined, relay, topic):
    liar = Liar(relay.port)
    pair = joined(client_by=liar.port)
    publisher, collector = pair.opened(Blob, topic, Blob())
    text = SECRET.encode()
    publisher.publish(Blob(sequence=2, data=list(text)))
    until(lambda: any(m.sequence == 2 for m in collector.messages), "the message")
    assert text not in liar.seen, "the relay sees what is said"
    liar.bend = True
    publisher.publish(Blob(sequence=3, data=list(text)))
    pair.client.wait_for("lost the link")
    assert all(m.sequence != 3 or bytes(m.data) == text for m in collector.messages)
    liar.bend = False
    until(lambda: pair.client.text().count(": connected to ") > 1, "the link again")
    publisher.publish(Blob(sequence=4))
    until(lambda: any(m.sequence == 4 for m in collector.messages), "a message after it")


def test_a_relay_that_joins_with_another_robot_gets_nothing(joined, make_side, relay, domains):
    """Another server, with another key: it is told from the client's own."""
    ctl("certs", relay.folder / "other", "--host", ROBOT)
    keys = f"{relay.folder}/other"
    port = free_port()
    other = make_side(
        "server",
        domains(1)[0],
        {
            "listen": {"port": port},
            "tls": {"certificate": f"{keys}/server.crt", "private_key": f"{keys}/server.key"},
            "auth": {"token": "a-token-for-one-run"},
        },
        name="other",
    )
    other.start().wait_listening()
    liar = Liar(relay.port)
    liar.instead = port
    pair = joined(start=False, client_by=liar.port)
    pair.server.start().wait_for("connected to the relay")
    pair.client.start().wait_for("the server's certificate is from an unknown authority")
    assert ": connected to" not in other.text()


def test_pairing_takes_two_commands_and_no_file(tmp_path, domains, make_graph):
    """Of robot and operator; the relay is made by two of its own."""
    env = dict(os.environ, HOME=str(tmp_path))
    begun = []
    world = World(tmp_path, domains(2), make_graph, begun)
    try:
        place = f"{ROBOT}@localhost:{free_port()}"
        command = [build_dir() / "relay", "--robot", place]
        told = subprocess.run(command, env=env, check=True, capture_output=True).stdout.decode()
        line = relay_line(told)
        assert line.startswith(f"wss+relay://{place}/#")
        relay = Program("relay", [build_dir() / "relay"], env, tmp_path)
        begun.append(relay)
        relay.start().wait_for("listens on port")
        begin = time.monotonic()
        port = ["--ros-args", "-p", "listen.port:=0"]
        server = world.run("server", "robot", "--pair", "--via", line, *port)
        invitation = invitation_of(server)
        assert invitation.startswith(f"wss+pair://{place}/#")
        client = world.run("client", "operator", invitation)
        client.wait_for("paired: from now on")
        world.crosses("/first")
        print(f"the first message after {time.monotonic() - begin:.1f} s")
        token = line.split("#")[1].split(".")[0]
        # The line works once: the name is this robot's, by a token of its own.
        tokens = (tmp_path / ".connect_relay" / "robots.yaml").read_text()
        assert hashlib.sha256(token.encode()).hexdigest() not in tokens
        thief = world.run("server", "thief", "--pair", "--via", line, *port)
        thief.wait_for("it refuses the token .* or the registration command was used already")
        thief.stop()
        # What the thief started with before stays.
        assert not list(world.home("thief").rglob("params.yaml"))
        words = (pathlib.Path("/proc") / str(server.pid) / "cmdline").read_text()
        assert token not in words and token not in server.text() + relay.text()
        client.stop()
        server.stop()
        world.run("server", "robot").wait_for("connected to the relay")
        world.run("client", "operator").wait_for(": connected to ")
        world.crosses("/second")
    finally:
        for program in begun:
            program.kill()
