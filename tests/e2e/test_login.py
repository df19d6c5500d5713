"""Which clients get in, and how a side starts and ends."""

import pathlib
import re
import signal
import socket
import subprocess
import time

import pytest
from std_msgs.msg import String

from conftest import OPEN
from graph import connect, here
from harness.domains import free_port

TOKEN = "correct-horse-battery-staple"


def server_parameters(port, **more):
    return {"listen": {"port": port}, "auth": {"token": TOKEN}, **OPEN, **more}


def client_parameters(port, token=TOKEN, scheme="ws", host="127.0.0.1", **more):
    return {"url": f"{scheme}://{host}:{port}", "auth": {"token": token}, **more}


@pytest.fixture
def alone(domains, make_side, make_graph):
    """A server, and a function that starts clients of it in one other graph."""

    class Alone:
        def __init__(self):
            self.domains = domains(2)
            self.port = free_port()
            self.robot, self.operator = (make_graph(d) for d in self.domains)

        def serve(self, **more):
            self.server = make_side("server", self.domains[0], server_parameters(self.port, **more))
            self.server.start().wait_listening()
            return self.server

        def client(self, name="client", env=(), arguments=(), **more):
            parameters = client_parameters(self.port, **more)
            return make_side(
                "client", self.domains[1], parameters, name=name, env=env, arguments=arguments
            ).start()

        def carries(self, client):
            client.wait_linked()
            publisher = self.robot.publisher(String, "/t/login")
            collector = self.operator.collector(String, "/t/login")
            connect(publisher, collector, String(data="in"))

    return Alone()


def test_a_wrong_token_gets_nothing_and_disturbs_nobody(alone):
    alone.serve()
    self_willed = alone.client(token="a-guess-of-a-stranger")
    self_willed.wait_for(r"login refused")
    alone.robot.publisher(String, "/t/secret")
    time.sleep(1)
    assert not alone.operator.publishers("/t/secret")
    assert self_willed.running(), "it tries again: the token may be corrected at the server"
    assert "a-guess-of-a-stranger" not in alone.server.text() and TOKEN not in alone.server.text()
    alone.carries(alone.client(name="good"))


def test_a_new_certificate_and_a_pin(alone, authority, tmp_path):
    own = {"certificate": str(tmp_path / "own.pem"), "private_key": str(tmp_path / "own.key")}
    for file, made in zip(own.values(), ("server.pem", "server.key")):
        pathlib.Path(file).write_bytes((authority / made).read_bytes())
    alone.serve(tls=own)
    trusting = {"tls": {"ca": str(authority / "ca.pem")}}
    by_name = alone.client("by_name", scheme="wss", host="localhost", **trusting)
    alone.carries(by_name)
    words = ["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    files = ["-keyout", own["private_key"], "-out", own["certificate"], "-subj", "/CN=other"]
    subprocess.run(["openssl", *words, *files], check=True, capture_output=True)
    alone.server.wait_for(r"changed and were read again; certificate of 'CN=other'")
    wrong = alone.client("wrong", scheme="wss", tls={"pin": ["A" * 43 + "="]})
    pin = wrong.wait_for(r"has the pin (\S+), which is not in tls.pin").group(1)
    alone.client("right", scheme="wss", tls={"pin": [pin]}).wait_linked()
    assert by_name.text().count(": connected to") == 1 and "lost the link" not in by_name.text()


# ---- wrong configuration -----------------------------------------------------------------------


def refusal(side):
    side.start()
    assert side.process.wait(10) == 2, side.text()
    return side.text()


@pytest.mark.parametrize("more", [(), ("-p", "listen.port:=0")])
def test_a_file_that_is_for_another_name(domains, make_side, more):
    """This problem is printed first, and alone if nothing else was given."""
    side = make_side(
        "server",
        domains(1)[0],
        server_parameters(free_port()),
        arguments=("--ros-args", "-r", "__node:=other", *more),
    )
    lines = refusal(side).splitlines()
    assert "nothing for /other, only for connect_server: write /other or /** there" in lines[1]
    assert len(lines) == (3 if more else 2), lines


def test_a_file_whose_node_is_misspelt(domains, make_side):
    parameters = {"url": "ws://127.0.0.1:1", "auth": {"token": "a-token-for-one-run"}}
    side = make_side("client", domains(1)[0], parameters, node="connect_cleint")
    assert (
        "nothing for /connect_client, only for connect_cleint: write /connect_client or /** there"
        in refusal(side)
    )


def test_a_port_in_use(domains, make_side):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        said = refusal(make_side("server", domains(1)[0], server_parameters(port)))
    assert str(port) in said and re.search("in use", said)


# ---- the end -----------------------------------------------------------------------------------


@pytest.mark.alone
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT])
def test_both_end_within_a_second(make_pair, how):
    """With a link and messages on it."""
    pair = make_pair()
    publisher, _ = pair.opened(String, "/t/until_the_end", String(data="x"))
    for side in (pair.client, pair.server):
        publisher.publish(String(data="x" * 100_000))
        begin = time.monotonic()
        assert side.stop(how) == 0, side.text()
        took = time.monotonic() - begin
        assert took < here(1.2), f"{side.name} took longer"


def test_one_ctrl_c_may_come_as_many_signals(make_pair):
    """From `ros2 launch` and from the terminal; also in the last steps of the program."""
    pair = make_pair()
    for side in (pair.client, pair.server):
        while side.running():
            side.process.send_signal(signal.SIGINT)
            time.sleep(0.002)
        assert side.process.returncode == 0, side.text()


@pytest.mark.alone
def test_a_client_that_is_still_dialing_ends_within_a_second(domains, make_side):
    with socket.create_server(("127.0.0.1", 0)) as silent:  # accepts, and says nothing
        client = make_side("client", domains(1)[0], client_parameters(silent.getsockname()[1]))
        client.start()
        silent.accept()
        begin = time.monotonic()
        assert client.stop() == 0
        took = time.monotonic() - begin
        assert took < here(1.2)


def test_a_signal_during_the_start(domains, make_side):
    server = make_side("server", domains(1)[0], server_parameters(free_port()))
    for wait in (0.0, 0.02, 0.05, 0.1, 0.2):
        server.start()
        time.sleep(wait)
        begin = time.monotonic()
        assert server.stop() in (0, -signal.SIGTERM)
        took = time.monotonic() - begin
        assert took < here(2)
