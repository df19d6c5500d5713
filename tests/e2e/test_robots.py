"""Two robots of one kind dial one server: each is below its own name there (`prefix:
by_identity`)."""

import pytest
from harness.domains import free_port
from rclpy.parameter_client import AsyncParameterClient
from std_msgs.msg import Int32, String

from calls import Caller, EchoServer
from graph import connect, until
from tokens import entry, write_tokens

ROBOTS = ["robot7", "robot8"]


def rule(towards, away):
    return {
        "rules": ["all"],
        "rule": {
            "all": {
                f"{towards}_topics": ["/cmd"],
                f"{away}_topics": ["/scan"],
                f"{away}_services": ["/flip"],
                "parameters": ["/driver"],
            }
        },
        "robot": "client",
    }


@pytest.fixture
def fleet(make_side, make_graph, domains, tmp_path):
    """The server's graph, and those of the robots."""
    *at_robots, at_server = domains(3)
    entries = [entry(name, f"the-token-of-{name}") for name in ROBOTS]
    tokens, port = write_tokens(tmp_path / "tokens.yaml", *entries), free_port()
    parameters = {"listen": {"port": port}, "auth": {"token_file": tokens}}
    server = make_side(
        "server", at_server, {**parameters, "prefix": "by_identity", **rule("export", "import")}
    )
    server.start().wait_listening()

    for name, domain in zip(ROBOTS, at_robots):
        parameters = {
            "url": f"ws://127.0.0.1:{port}",
            "auth": {"token": f"the-token-of-{name}"},
            **rule("import", "export"),
        }
        make_side("client", domain, parameters, name=name).start().wait_linked()
    return make_graph(at_server), [make_graph(domain) for domain in at_robots]


def test_two_robots_of_one_kind_do_not_mix(fleet):
    here, robots = fleet
    mixed = []
    for name, graph in zip(ROBOTS, robots):
        scans, scan = here.collector(String, f"/{name}/scan"), graph.publisher(String, "/scan")
        cmds, cmd = graph.collector(Int32, "/cmd"), here.publisher(Int32, f"/{name}/cmd")
        connect(scan, scans, String(data=name))
        connect(cmd, cmds, Int32(data=0))
        mixed.append((name, scan, scans, cmd, cmds))
    for name, scan, _, cmd, _ in mixed:
        scan.publish(String(data=name))
        cmd.publish(Int32(data=int(name[-1])))
    for name, _, scans, _, cmds in mixed:
        assert [m.data for m in scans.wait()] == [name]
        assert [m.data for m in cmds.wait()] == [int(name[-1])]

    servers = [EchoServer(graph, "/flip") for graph in robots]
    for name, server_of in zip(ROBOTS, servers):
        caller = Caller(here, f"/{name}/flip")
        until(caller.ready, f"the service of {name}")
        caller.ask(name)
        caller.wait_answers(1)
        assert server_of.executed == [name]

    for speed, graph in enumerate(robots):
        node = graph.node("driver", start_parameter_services=True)
        node.declare_parameter("speed", speed + 1)
    for speed, name in enumerate(ROBOTS):
        client = AsyncParameterClient(here.tester, f"/{name}/driver")
        until(client.services_are_ready, f"the parameters of {name}")
        future = client.get_parameters(["speed"])
        until(future.done, "an answer")
        assert future.result().values[0].integer_value == speed + 1
    shown = {
        f"{space.rstrip('/')}/{name}"
        for name, space in here.tester.get_node_names_and_namespaces()
    }
    assert {f"/{name}/driver" for name in ROBOTS} <= shown
