"""The recipes of docs/recipes.md, with stand-ins for the programs that they are for: each name of
their lists is allowed as the list says, and then crosses."""

import json
import subprocess
import time

import pytest
from connect_bridge_test_interfaces.srv import Echo
from rcl_interfaces.srv import GetParameters
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

import actions
from calls import Caller, EchoServer, request_of
from graph import WAIT, until
from harness.programs import build_dir
from recipes import PROMISES, recipes

RECIPES = recipes()
FILES = [name for name, recipe in RECIPES.items() if recipe.names]
RUN = [name for name in FILES if "From the robots" not in RECIPES[name].names]  # test_robots.py


def ctl(folder, *words):
    return subprocess.run([build_dir() / "ctl", *words], cwd=folder, capture_output=True, text=True,
                          timeout=30)


@pytest.fixture
def folder(tmp_path):
    made = ctl(tmp_path, "token", "anna", "--file", "tokens.yaml")
    assert made.returncode == 0, made.stderr
    for name in ("anna.token", "robot7.token"):
        (tmp_path / name).write_text(made.stdout, encoding="ascii")
        (tmp_path / name).chmod(0o600)
    certs = ctl(tmp_path, "certs", ".", "--host", "robot01.local")
    assert certs.returncode == 0, certs.stderr
    return tmp_path


def test_the_page_has_the_recipes():
    rules = ["nav2", "moveit", "ros2_control", "gazebo", "fleet", "lte"]
    assert FILES == [*rules, "supervision", "mux", "modems", "record"]
    for name in FILES:
        lists = RECIPES[name].names
        assert lists["Never"] and sum(map(len, lists.values())) >= 4, name


@pytest.mark.parametrize("name", RECIPES)
def test_each_file_is_understood(name, folder):
    file = folder / "recipe.yaml"
    role = "client" if " at the client" in name else "server"
    for parameters in RECIPES[name].nodes().values():
        file.write_text(json.dumps({"/**": parameters}), encoding="utf-8")
        checked = ctl(folder, "check", file, "--role", role)
        assert checked.returncode == 0, checked.stderr
        assert "warning" not in checked.stdout


@pytest.mark.parametrize("name", FILES)
def test_the_rules_allow_what_the_lists_promise(name, folder):
    file = folder / "recipe.yaml"
    file.write_text(RECIPES[name].text, encoding="utf-8")

    def allows(option, value, direction, *who):
        words = (option, value, "--direction", direction, "--role", "server", *who)
        return ctl(folder, "explain", file, *words).returncode == 0

    for head, names in RECIPES[name].names.items():
        for value in names:
            if head == "Never":
                assert not allows("--topic", value, "export"), value
                assert not allows("--topic", value, "import"), value
                continue
            option, direction, who = PROMISES[head]
            assert allows(option, value, direction, *who), f"{head}: {value}"
            if who:
                assert not allows(option, value, direction), f"not for all: {value}"


def arrive(publishers, collectors):
    """Publishes until each collector has something."""
    end = time.monotonic() + WAIT
    while missing := [c.topic for c in collectors if not c.messages]:
        assert time.monotonic() < end, f"nothing arrives of {missing}"
        for publisher in publishers:
            publisher.publish(String(data=publisher.topic))
        time.sleep(0.05)
    for collector in collectors:
        assert {m.data for m in collector.messages} == {collector.topic}


@pytest.mark.parametrize("name", RUN)
def test_what_a_recipe_promises_crosses(name, make_pair):
    recipe, names = RECIPES[name], RECIPES[name].names
    at_client = RECIPES.get(f"{name} at the client")
    pair = make_pair(server=recipe.at_a_pair(), client=at_client.at_a_pair() if at_client else {})
    robot, operator = pair.robot, pair.operator
    down, up, never = (names.get(head, []) for head in ("To the operator", "To the robot", "Never"))
    publishers = [robot.publisher(String, topic) for topic in (*down, *never)]
    publishers += [operator.publisher(String, topic) for topic in up]
    collectors = [operator.collector(String, topic) for topic in down]
    collectors += [robot.collector(String, topic) for topic in up]
    silent = [operator.collector(String, topic) for topic in never]
    servers = [EchoServer(robot, service) for service in names.get("Services", [])]
    goals = [actions.FibonacciServer(robot, action) for action in names.get("Actions", [])]
    for node in names.get("Parameters", []):
        made = robot.node(node.strip("/"), start_parameter_services=True)
        made.declare_parameter("speed", 3)
    arrive(publishers, collectors)
    for server in servers:
        caller = Caller(operator, server.service, Echo).wait_ready()
        assert caller.call(request_of("one")).calls == 1
    for action in names.get("Actions", []):
        client = actions.Client(operator, action)
        until(client.server_is_ready, f"{action} is there")
        assert list(actions.Goal(client, 3).result().result.sequence) == [0, 1, 1, 2]
    for node in names.get("Parameters", []):
        caller = Caller(operator, f"{node}/get_parameters", GetParameters).wait_ready()
        answer = caller.call(GetParameters.Request(names=["speed"]))
        assert [value.integer_value for value in answer.values] == [3]
    assert not any(collector.messages for collector in silent)
    assert not set(never) & set(operator.topics())
    assert len(goals) == len(names.get("Actions", []))


def test_the_time_of_a_simulator_arrives(make_pair):
    pair = make_pair(server=RECIPES["gazebo"].at_a_pair(),
                     client=RECIPES["gazebo at the client"].at_a_pair())
    simulator = pair.robot.publisher(Clock, "/clock")
    here = pair.operator.collector(Clock, "/clock")
    time_there = Clock()
    end = time.monotonic() + WAIT
    while not any(message.clock.sec >= 1000 for message in list(here.messages)):
        assert time.monotonic() < end, "no time of the simulator"
        time_there.clock.sec = 1000 + int(time.monotonic() - end + WAIT)
        simulator.publish(time_there)
        time.sleep(0.02)


def test_a_viewer_at_the_operator_costs_what_it_opens(make_pair):
    """As foxglove_bridge, which lists all topics and subscribes when somebody opens one."""
    pair = make_pair(server=RECIPES["nav2"].at_a_pair())
    publishers = [pair.robot.publisher(String, topic) for topic in ("/scan", "/map")]
    until(lambda: {"/scan", "/map"} <= set(pair.operator.topics()), "the viewer's list")
    opened = pair.operator.collector(String, "/scan")
    arrive(publishers, [opened])
    until(lambda: pair.server.topic("/scan", "export").get("messages"), "the status")
    assert pair.server.topic("/map", "export")["messages"] == 0
