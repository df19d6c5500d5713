"""A side on Jazzy and a side on Kilted: topics both ways. Needs both prefixes and both builds.

And everything that a robot and an operator do, with one side or both on any other distribution:
CONNECT_OTHER_SETUP names the file that gives a shell that distribution, with the messages of
tests/interfaces, and CONNECT_BUILD_OTHER the build for it."""

import json
import os
import subprocess
import sys
import time

import pytest

from graph import until
from harness.domains import free_port
from harness.programs import ROOT, Program, ros_environment, ros_parameters
from test_rmw import NODES, RULES, told

BUILDS = {
    "kilted": ROOT / os.environ.get("CONNECT_BUILD_KILTED", "build"),
    "jazzy": ROOT / os.environ.get("CONNECT_BUILD_JAZZY", "build-jazzy"),
    "other": ROOT / os.environ.get("CONNECT_BUILD_OTHER", "build-other"),
}
OTHER_SETUP = os.environ.get("CONNECT_OTHER_SETUP")
# A node that publishes on one topic and reports what it hears on another.
NODE = """
import json, sys, rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node('smoke')
publisher = node.create_publisher(String, sys.argv[1], 10)
heard = lambda message: print(json.dumps(message.data), flush=True)
node.create_subscription(String, sys.argv[2], heard, 10)
node.create_timer(0.1, lambda: publisher.publish(String(data=sys.argv[3])))
rclpy.spin(node)
"""


def environment(distribution, domain):
    """What `. ./env.sh` gives for the prefix of this distribution."""
    clean = {k: v for k, v in os.environ.items() if k in ("HOME", "PATH", "LANG", "TMPDIR")}
    own = str(ROOT / ".ros2")
    clean["PATH"] = ":".join(f for f in clean["PATH"].split(":") if not f.startswith(own))
    setup = OTHER_SETUP if distribution == "other" else ROOT / "env.sh"
    script = f"set +u; . {setup} && exec env -0"
    words = {"CONNECT_BRIDGE_PREFIX": distribution, "BUILD": str(BUILDS[distribution])}
    shown = subprocess.run(
        ["bash", "-c", script], env={**clean, **words}, capture_output=True, check=True, cwd=ROOT
    ).stdout.decode()
    env = dict(line.split("=", 1) for line in shown.split("\0") if "=" in line)
    local = ros_environment(domain)
    return {**env, **{k: local[k] for k in ("ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE")}}


@pytest.mark.skipif(
    bool(os.environ.get("ROS_DISTRO")) and not os.environ.get("CONNECT_BRIDGE_OWN_PREFIX"),
    reason="a ROS distribution is sourced: there is one distribution here",
)
@pytest.mark.parametrize("robot, operator", [("jazzy", "kilted"), ("kilted", "jazzy")])
def test_topics_cross_both_ways(domains, tmp_path, robot, operator):
    for distribution in (robot, operator):
        build = BUILDS[distribution]
        for needed in (build / "server", build / "client", ROOT / ".ros2" / distribution / "bin"):
            if not needed.exists():
                # Where Jazzy was built for this, as in CI, a skip would hide that it failed.
                end = pytest.fail if os.environ.get("CONNECT_WITH_JAZZY") else pytest.skip
                end(f"NOT TESTED: there is no {needed}; `make jazzy` makes it")
    port, (near, far) = free_port(), domains(2)
    sides = {"server": (robot, near), "client": (operator, far)}
    login = {"auth": {"token": "a-token-for-two-distributions"}}
    rule = {"export_topics": ["/t/*"], "import_topics": ["/o/*"]}
    parameters = {
        "server": {"listen": {"port": port}, **login, "rules": ["all"], "rule": {"all": rule}},
        "client": {"url": f"ws://127.0.0.1:{port}", **login},
    }
    talks = {
        "server": ("/t/out", "/o/back", "from the robot"),
        "client": ("/o/back", "/t/out", "from the operator"),
    }
    started = []
    try:
        for role, (distribution, domain) in sides.items():
            env = environment(distribution, domain)
            file = tmp_path / f"{role}.yaml"
            file.write_text(ros_parameters(f"connect_{role}", parameters[role]), encoding="utf-8")
            command = [BUILDS[distribution] / role, "--ros-args", "--params-file", file]
            started.append(Program(role, command, env, tmp_path).start())
            python = ROOT / ".ros2" / distribution / "bin" / "python3"
            node = Program(f"{role}-node", [python, "-c", NODE, *talks[role]], env, tmp_path)
            started.append(node.start())
        nodes = [p for p in started if p.name.endswith("-node")]
        for node, text in zip(nodes, ("from the operator", "from the robot")):
            node.wait_for(json.dumps(text), 30)
        assert started[2].stop() == 0 and started[0].stop() == 0
    except BaseException:
        for program in started:
            print(f"---- {program.name} ----\n{program.text(whole=True)}", file=sys.stderr)
        raise
    finally:
        for program in started:
            program.kill()


@pytest.mark.skipif(not OTHER_SETUP, reason="NOT TESTED: CONNECT_OTHER_SETUP names no distribution")
@pytest.mark.parametrize(
    "robot, operator", [("other", "kilted"), ("kilted", "other"), ("other", "other")]
)
def test_all_kinds_cross(domains, tmp_path, robot, operator):
    port, within = free_port(), dict(zip(("server", "client"), domains(2)))
    login = {"auth": {"token": "a-token-for-two-distributions"}}
    parameters = {
        "server": {"listen": {"port": port}, **login, **RULES},
        "client": {"url": f"ws://127.0.0.1:{port}", **login},
    }
    started = {}
    try:
        for role, distribution in (("server", robot), ("client", operator)):
            env = environment(distribution, within[role])
            file = tmp_path / f"{role}.yaml"
            file.write_text(ros_parameters(f"connect_{role}", parameters[role]), encoding="utf-8")
            command = [BUILDS[distribution] / role, "--ros-args", "--params-file", file]
            started[role] = Program(role, command, env, tmp_path).start()
            whose = {"server": "robot", "client": "operator"}[role]
            nodes = ["python3", "-B", NODES, whose]
            started[whose] = Program(whose, nodes, env, tmp_path).start()
        heard = lambda: told(started["operator"])  # noqa: E731
        what = lambda: f"heard {dict(heard())}"  # noqa: E731
        until(lambda: heard()["result"] and heard()["chat"] and heard()["answer"], what, 40)
        until(lambda: told(started["robot"])["robot heard"], "a message of the operator", 20)
        until(lambda: "/open" in heard()["event"], "an event of the node that a rule opens", 20)
        time.sleep(1)  # in which a duplicate would have come
        found = heard()
        assert sorted(found["static"]) == ["camera", "imu", "lidar"], "latched, each once"
        assert found["answer"] == ["robot"] and found["result"] == [[3]]
        assert found["feedback"] == [[1, 2, 3]], "the first feedback included"
        assert set(found["event"]) == {"/open"}, "no event of a node that no rule opens"
        for role in ("client", "server"):
            assert started[role].stop() == 0
    except BaseException:
        for program in started.values():
            print(f"---- {program.name} ----\n{program.text(whole=True)}", file=sys.stderr)
        raise
    finally:
        for program in started.values():
            program.kill()
