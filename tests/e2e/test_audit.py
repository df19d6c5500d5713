"""The audit log: logins, refusals, channels, calls, goals, changes of rules, and the end."""

import datetime
import json
import socket
import stat

from connect_bridge_test_interfaces.srv import Echo
from std_msgs.msg import String

from actions import Client, FibonacciServer, Goal
from calls import Caller, EchoServer, request_of
from conftest import OPEN
from graph import connect, until
from harness.domains import free_port
from tokens import entry, write_tokens

ANNA = "token-of-anna-0123456789"
RULES = {
    "rules": ["see", "use"],
    "rule": {
        "see": {"export_topics": ["/t/**"], "groups": ["ops"]},
        "use": {"export_services": ["/s/**"], "export_actions": ["/a/**"], "groups": ["ops"]},
    },
}


def lines(file):
    *whole, _ = file.read_text(encoding="ascii").split("\n")  # a write may be under way
    return [json.loads(line) for line in whole]


def found(file, **what):
    return [line for line in lines(file) if all(line.get(k) == v for k, v in what.items())]


def wait_for(file, **what):
    until(lambda: found(file, **what), lambda: f"{what} in {file.read_text()}", 15)
    return found(file, **what)[0]


class World:
    def __init__(self, folder, domains, make_side, make_graph):
        self.folder, self.make_side = folder, make_side
        self.domains = domains(2)
        self.robot, self.operator = (make_graph(d) for d in self.domains)
        self.port = free_port()
        self.audit = folder / "audit.jsonl"
        self.parameters = {
            "listen": {"port": self.port},
            "auth": {"token_file": write_tokens(folder / "tokens.yaml", entry("anna", ANNA))},
            "audit": {"file": str(self.audit)},
            **RULES,
        }

    def serve(self):
        self.server = self.make_side("server", self.domains[0], self.parameters)
        self.server.start().wait_listening()
        return self.server

    def client(self, name="client", token=ANNA):
        parameters = {"url": f"ws://127.0.0.1:{self.port}", "auth": {"token": token}}
        return self.make_side("client", self.domains[1], parameters, name=name).start()


def test_who_did_what(tmp_path, domains, make_side, make_graph):
    world = World(tmp_path, domains, make_side, make_graph)
    world.serve()
    audit = world.audit
    assert stat.S_IMODE(audit.stat().st_mode) == 0o600
    EchoServer(world.robot, "/s/echo")
    FibonacciServer(world.robot, "/a/fib")
    client = world.client()
    client.wait_linked()
    login = wait_for(audit, event="login", identity="anna")
    assert login["groups"] == ["ops"] and login["node"] == "/connect_client"
    assert login["address"].startswith("127.0.0.1:")
    made = datetime.datetime.fromisoformat(login["time"].replace("Z", "+00:00"))
    age = datetime.datetime.now(datetime.timezone.utc) - made
    assert abs(age) < datetime.timedelta(seconds=30)

    publisher = world.robot.publisher(String, "/t/a")
    connect(publisher, world.operator.collector(String, "/t/a"), String(data="x"))
    secret = "nobody-writes-this-down"
    caller = Caller(world.operator, "/s/echo", Echo).wait_ready()
    for _ in range(3):
        caller.call(request_of(secret))
    goals = Client(world.operator, "/a/fib")
    assert Goal(goals, 3).result().result.sequence
    goals.destroy()

    of_anna = {"identity": "anna", "link": login["link"]}
    opened = wait_for(audit, event="channel_opened", name="/t/a", **of_anna)
    assert (opened["direction"], opened["kind"], opened["rule"]) == ("export", "topic", "see")
    wait_for(audit, event="demanded", name="/t/a", **of_anna)
    call = wait_for(audit, event="call", name="/s/echo", **of_anna)
    assert call["rule"] == "use" and call["type"].endswith("/srv/Echo")
    goal = wait_for(audit, event="goal", name="/a/fib", **of_anna)
    assert goal["kind"] == "action" and goal["type"].endswith("/action/Fibonacci")
    until(lambda: len(found(audit, event="call", name="/s/echo", **of_anna)) == 3, "the calls", 5)
    until(lambda: world.server.status().get("audit", {}).get("lines", 0) > 5, "the status", 5)
    assert world.server.status()["audit"]["left_out"] == 0

    stranger = world.client("stranger", token="a-wrong-token-of-nobody")
    refused = wait_for(audit, event="refused", code="login_refused")
    assert refused["address"].startswith("127.0.0.1:") and "link" not in refused
    stranger.stop()

    client.stop()
    wait_for(audit, event="link_lost", **of_anna)
    assert world.server.stop() == 0
    assert lines(audit)[0]["event"] == "started" and lines(audit)[-1]["event"] == "stopped"
    text = audit.read_text(encoding="ascii")
    for word in (secret, ANNA, "a-wrong-token"):
        assert word not in text


def test_a_stranger_forges_no_line_and_fills_no_disk(tmp_path, domains, make_side, make_graph):
    world = World(tmp_path, domains, make_side, make_graph)
    world.serve()
    for _ in range(300):
        with socket.create_connection(("127.0.0.1", world.port)) as s:
            s.sendall(
                b"GET / HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n"
                b"Sec-WebSocket-Protocol: ros2-connect.v1\r\n\r\n"
            )
            s.recv(100)
            # A binary message, masked with zeros, that is not a record.
            text = b'\n{"event":"login","identity":"root"}\n'
            s.sendall(bytes([0x82, 0x80 | len(text), 0, 0, 0, 0]) + text)
    world.client().wait_linked()
    wait_for(world.audit, event="login", identity="anna")
    assert not found(world.audit, identity="root")
    assert len(found(world.audit, event="refused")) < 150


def test_a_file_that_cannot_be_written_is_refused_at_the_start(tmp_path, domains, make_side):
    (domain,) = domains(1)
    side = make_side(
        "server",
        domain,
        {
            "listen": {"port": free_port()},
            "auth": {"token": ANNA},
            "audit": {"file": str(tmp_path / "nowhere" / "audit.jsonl")},
            **OPEN,
        },
    )
    side.start()
    side.wait_for("audit.file: cannot write .*nowhere/audit.jsonl: .*: No such file")
    assert side.process.wait(20) == 2
