"""`ctl doctor` has nothing to say where all is well: no fault, no hint."""

import json
import pathlib
import subprocess
import tempfile
import time

import pytest
from geometry_msgs.msg import PoseStamped, Twist
from harness.domains import free_port
from harness.programs import build_dir
from std_msgs.msg import String

from graph import connect
from relayed import ctl, joined, relay  # noqa: F401
from tokens import entry, write_tokens

# After this time a link is expected to carry something.
SETTLED = 14


def findings(where, env=None):
    made = subprocess.run(
        [str(build_dir() / "ctl"), "doctor", "--json", str(where)],
        capture_output=True,
        text=True,
        timeout=60,
        env=env,
        check=False,
    )
    found = json.loads(made.stdout)["findings"]
    return [(one["id"], one["subject"], one["detail"]) for one in found]


@pytest.fixture
def sockets(make_pair):
    """A pair whose sockets are in a folder of its own."""
    with tempfile.TemporaryDirectory(prefix="cb") as runtime:

        def make(**parameters):
            pair = make_pair(env={"XDG_RUNTIME_DIR": runtime}, **parameters)
            pair.at = sorted(pathlib.Path(runtime).glob("connect_bridge/*.status"))
            return pair

        yield make


def nothing_to_say(wheres, env=None):
    time.sleep(SETTLED)
    for where in wheres:
        assert findings(where, env) == []


def publish_for_a_while(publisher, message, seconds=3):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        publisher.publish(message)
        time.sleep(0.05)


# The robot has topics that no rule names, and one that nobody looks at.
def test_the_readme_s_robot_and_operator(sockets):
    pair = sockets(
        server={
            "rules": ["look", "drive"],
            "rule": {
                "look": {"export_topics": ["/t/**"]},
                "drive": {"import_topics": ["/cmd_vel"]},
            },
        },
        client={
            "rules": ["all"],
            "rule": {"all": {"import_topics": ["/t/**"], "export_topics": ["/cmd_vel"]}},
        },
    )
    for topic in ("/odom", "/joint_states", "/t/nobody_looks"):
        pair.robot.publisher(String, topic)
    publisher, _ = pair.opened(String, "/t/chatter", String(data="hello"))
    pair.opened(Twist, "/cmd_vel", Twist(), backward=True)
    publish_for_a_while(publisher, String(data="hello"))
    # The shell of the operator has no domain, as in README.
    nothing_to_say(pair.at)


# RViz has a tool that publishes, and the robot takes nothing of it.
def test_an_operator_who_only_looks(sockets):
    pair = sockets(
        server={"rules": ["look"], "rule": {"look": {"export_topics": ["/t/**"]}}}, client={}
    )
    pair.operator.publisher(PoseStamped, "/goal_pose")
    publisher, _ = pair.opened(String, "/t/scan", String(data="hello"))
    publish_for_a_while(publisher, String(data="hello"))
    nothing_to_say(pair.at)


# Two machines: TLS, and an address for all.
def test_with_tls_at_all_addresses(make_pair, tmp_path):
    ctl("certs", tmp_path / "keys", "--host", "localhost")
    pair, at = make_pair(start=False), []
    for side in (pair.server, pair.client):
        at.append(f"127.0.0.1:{free_port()}")
        side.set_parameters({**side.parameters, "status": {"listen": at[-1]}})
    port = free_port()
    made = tmp_path / "keys"
    keys = {"certificate": f"{made}/server.crt", "private_key": f"{made}/server.key"}
    pair.server.set_parameters(
        {**pair.server.parameters, "listen": {"address": "*", "port": port}, "tls": keys}
    )
    pair.client.set_parameters(
        {
            **pair.client.parameters,
            "url": f"wss://localhost:{port}",
            "tls": {"ca": f"{made}/ca.crt"},
        }
    )
    pair.bridge.start()
    pair.opened(String, "/t/scan", String(data="hello"))
    nothing_to_say(at)


def test_by_a_relay(joined, relay):  # noqa: F811
    pair = joined(start=False)
    at = []
    for side in (pair.server, pair.client):
        at.append(f"127.0.0.1:{free_port()}")
        side.set_parameters({**side.parameters, "status": {"listen": at[-1]}})
    pair.server.start().wait_for("connected to the relay")
    pair.client.start().wait_linked()
    pair.opened(String, "/t/scan", String(data="hello"))
    address = json.loads(relay.file.read_text())["status"]["listen"]
    nothing_to_say([*at, address])


def test_many_robots_at_one_operator(make_side, make_graph, domains, tmp_path):
    names = ["robot7", "robot8", "robot9"]
    *at_robots, at_server = domains(len(names) + 1)
    tokens = write_tokens(
        tmp_path / "tokens.yaml", *(entry(name, f"the-token-of-{name}") for name in names)
    )
    port, statuses = free_port(), [f"127.0.0.1:{free_port()}" for _ in range(len(names) + 1)]

    def rule(towards, away):
        look = {f"{towards}_topics": ["/cmd"], f"{away}_topics": ["/scan"]}
        return {"rules": ["all"], "rule": {"all": look}, "robot": "client"}

    parameters = {
        "listen": {"port": port},
        "auth": {"token_file": str(tokens)},
        "prefix": "by_identity",
        "status": {"listen": statuses[-1]},
        **rule("export", "import"),
    }
    make_side("server", at_server, parameters).start().wait_listening()
    here, kept = make_graph(at_server), []
    for name, domain, status in zip(names, at_robots, statuses):
        parameters = {
            "url": f"ws://127.0.0.1:{port}",
            "auth": {"token": f"the-token-of-{name}"},
            "status": {"listen": status},
            **rule("import", "export"),
        }
        make_side("client", domain, parameters, name=name).start().wait_linked()
        graph = make_graph(domain)
        scans, scan = here.collector(String, f"/{name}/scan"), graph.publisher(String, "/scan")
        cmds, cmd = graph.collector(String, "/cmd"), here.publisher(String, f"/{name}/cmd")
        connect(scan, scans, String(data=name))
        connect(cmd, cmds, String(data=name))
        kept += [graph, scans, scan, cmds, cmd]
    nothing_to_say(statuses)
