"""`ctl certs`, and logins by certificate."""

import subprocess

import pytest
from std_msgs.msg import String

from graph import connect
from harness.domains import free_port
from harness.programs import build_dir


def certs(folder, *words):
    command = [str(build_dir() / "ctl"), "certs", str(folder), *words]
    return subprocess.run(command, text=True, capture_output=True)


@pytest.fixture
def folder(tmp_path):
    made = certs(tmp_path / "certs", "--host", "localhost", "--client", "alice", "--group", "ops")
    assert made.returncode == 0, made.stderr
    assert "tls: {certificate:" in made.stdout and "tls: {ca:" in made.stdout
    assert f"Keep {tmp_path / 'certs'}/ca.key elsewhere, not on the robot" in made.stdout
    return tmp_path / "certs"


def test_a_group_is_for_clients(tmp_path):
    refused = certs(tmp_path / "certs", "--host", "localhost", "--group", "ops")
    assert refused.returncode == 2 and "--client" in refused.stderr
    assert not (tmp_path / "certs").exists()


def test_a_certificate_is_a_login(folder, domains, make_side, make_graph):
    near, far = domains(2)
    robot, operator = make_graph(near), make_graph(far)
    port = free_port()
    assert certs(folder, "--client", "bob").returncode == 0
    ca = str(folder / "ca.crt")

    def own(name):
        key, certificate = (str(folder / f"{name}.{end}") for end in ("key", "crt"))
        return {"ca": ca, "certificate": certificate, "private_key": key}

    def client(name, **more):
        parameters = {"url": f"wss://localhost:{port}", "auth": {"method": "certificate"}, **more}
        return make_side("client", far, parameters, name=name).start()

    server = make_side(
        "server",
        near,
        {
            "listen": {"port": port},
            "auth": {"method": "certificate"},
            "tls": own("server"),
            "rules": ["ops"],
            "rule": {"ops": {"export_topics": ["/t/**"], "groups": ["ops"]}},
        },
    )
    server.start().wait_listening()
    bob = client("bob", tls=own("client-bob"))
    server.wait_for("as bob")
    robot.publisher(String, "/t/login")
    # Bob is in no group: he sees nothing.
    bob.wait_linked()
    assert not operator.publishers("/t/login")
    bob.stop()
    alice = client("alice", tls=own("client-alice"))
    alice.wait_linked()
    server.wait_for("as alice")
    publisher = robot.publisher(String, "/t/more")
    collector = operator.collector(String, "/t/more")
    connect(publisher, collector, String(data="in"))
    token = client("token", auth={"token": "x" * 20}, tls=own("client-alice"))
    token.wait_for("login refused")
