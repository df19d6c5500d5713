"""The robot dials: server --pair --drive at the operator, client --robot at the robot."""

import re
import subprocess
import time

import yaml
from std_msgs.msg import String

from calls import Caller, EchoServer
from graph import connect, until
from harness.programs import build_dir
from pairing import Robot, invitation_of, world  # noqa: F401

ROBOT_RUNS = "client"
_PAIRED = "paired: from now on"
_LINKED = ": connected to "


def invite(world):
    """The operator's server, and what it prints for the robot."""
    return world.pair("--drive", who="operator")


def test_two_commands_show_the_robot_and_both_start_without_words_later(world):
    robot = Robot(world)
    begin = time.monotonic()
    server, line = invite(world)
    assert line.startswith(f"wss+pair://localhost:{world.port}/#")
    client = world.run("client", "robot", "--robot", line)
    client.wait_for(_PAIRED)
    world.crosses("/first")
    print(f"the first message after {time.monotonic() - begin:.1f} s")
    robot.stands_still()
    # A word that was not said at the pairing opens nothing later.
    client.stop()
    more = world.run("client", "robot", "--robot", "--operate", line)
    more.wait_for("has paired already, without --operate")
    assert more.process.wait(10) == 2
    server.stop()
    world.run("server", "operator").wait_for("listening on")
    world.run("client", "robot").wait_for(_LINKED)
    world.crosses("/second")
    robot.stands_still()
    robot.stop()


def test_a_robot_whose_owner_says_so_is_operated(world):
    robot = Robot(world)
    server, line = invite(world)
    client = world.run("client", "robot", "--robot", "--operate", line)
    client.wait_for(_PAIRED)
    world.crosses("/state")
    robot.operate()
    # Nothing of the operator's own is there for the robot to call.
    EchoServer(world.operator, "/desk")
    back = Caller(world.robot, "/desk")
    time.sleep(0.5)
    assert not back.ready()
    client.stop()
    server.stop()
    world.run("server", "operator").wait_for("listening on")
    world.run("client", "robot").wait_for(_LINKED)
    connect(robot.command, robot.heard, String(data="again"))
    robot.stop()


def test_the_robots_rules_may_name_who_drives(world):
    robot = Robot(world)
    _, line = invite(world)
    client = world.run("client", "robot", "--robot", "--operate", line)
    client.wait_for(": connected to .*, which rules call operator")
    robot.operate()
    client.stop()
    file = world.home("robot") / "connect_bridge" / "connect_client" / "params.yaml"
    for name, drives in (("somebody else", False), ("operator", True)):
        only = f'rule.operate.identities: ["{name}"]\n    rule.operate.import_topics'
        key = r"(rule.operate.identities: .*\n    )?rule.operate.import_topics"
        file.write_text(re.sub(key, only, file.read_text()))
        client = world.run("client", "robot", "--ros-args")
        client.wait_for(_LINKED)
        world.crosses(f"/state{drives}")
        until(lambda: robot.caller.ready() == drives, "the right to call")
        asks = ["explain", file, "--service", "/service", "--identity", "operator"]
        told = subprocess.run([build_dir() / "ctl", *asks], capture_output=True, text=True)
        assert ("/service: allowed" in told.stdout) == drives, told.stdout
        client.stop()
    robot.stop()


def refused(program, text):
    program.wait_for(text)
    assert program.process.wait(10) == 2


def test_a_second_robot_does_not_mix_with_the_first(world):
    server, line = invite(world)
    world.run("client", "robot", "--robot", line).wait_for(_PAIRED)
    again = world.run("server", "operator", "--pair", "localhost", "--drive")
    refused(again, "this server has a robot already")
    (tokens,) = world.home("operator").rglob("tokens.yaml")
    (entry,) = yaml.safe_load(tokens.read_text())
    assert f"'{tokens}'" in again.text()
    # Of the one before, say with a new disk, there is a way back.
    command = [build_dir() / "ctl", "token", entry["identity"], "--remove", "--file", tokens]
    subprocess.run(command, check=True)
    again = world.run("server", "operator", "--pair", "localhost", "--drive")
    line = invitation_of(again)
    assert again.process.wait(10) == 0
    world.run("client", "robot again", "--robot", line).wait_for(_PAIRED)
