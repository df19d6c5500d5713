"""Two machines that get to know each other by pairing alone."""

import pathlib
import re
import stat
import time

import pytest
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_msgs.msg import String

from actions import Client, FibonacciServer, Goal
from calls import Caller, EchoServer
from graph import WAIT, connect, until
from harness.domains import free_port
from harness.programs import Program, build_dir, ros_environment

LINE = re.compile(r"ros2 run connect_bridge client (?:--robot )?'(wss\+pair://\S+)'")
# Of a program whose output is no terminal.
SHOWN = re.compile(r"The invitation is in '(.+)', since")
LINE_SHOWN = re.compile(r"The registration command of .+ is in '(.+)', since")
RELAY_LINE = re.compile(r"--via '(wss\+relay://\S+)'")


def invitation_of(server):
    """What it has invited with, from the file that only its owner reads."""
    file = pathlib.Path(server.wait_for(SHOWN).group(1))
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    return LINE.search(file.read_text(encoding="utf-8")).group(1)


def relay_line(told):
    """What `relay --robot` has made for the robot, from the file that it names."""
    file = pathlib.Path(LINE_SHOWN.search(told).group(1))
    assert stat.S_IMODE(file.stat().st_mode) == 0o600 and "wss+relay" not in told
    return RELAY_LINE.search(file.read_text(encoding="utf-8")).group(1)


class World:
    """A robot and an operator with a home each; nothing is configured but the port. `robot`: the
    program that runs there."""

    def __init__(self, folder, domains, make_graph, started, robot="server"):
        self.folder, self.started = folder, started
        self.domains = {"robot": domains[0], "operator": domains[1]}
        self.robot, self.operator = (make_graph(d) for d in domains)
        self.robot_runs = robot
        self.port = free_port()

    def home(self, who):
        return self.folder / f"home of {who}"

    def run(self, role, who, *words):
        domain = self.domains["robot" if role == self.robot_runs else "operator"]
        env = ros_environment(domain, ROS_HOME=self.home(who))
        program = Program(who, [build_dir() / role, *words], env, self.folder)
        self.started.append(program)
        return program.start()

    def pair(self, *words, who="robot"):
        """The server that invites, and its invitation."""
        port = ["--ros-args", "-p", f"listen.port:={self.port}"]
        server = self.run("server", who, "--pair", "localhost", *words, *port)
        return server, invitation_of(server)

    def crosses(self, name):
        """A message of the robot arrives at the operator."""
        heard = self.operator.collector(String, name)
        connect(self.robot.publisher(String, name), heard, String(data="hello"))


class Robot:
    """What there is to operate at the robot."""

    def __init__(self, world):
        self.world = world
        self.heard = world.robot.collector(String, "/command")
        self.command = world.operator.publisher(String, "/command")
        self.service = EchoServer(world.robot, "/service")
        self.caller = Caller(world.operator, "/service")
        self.action = FibonacciServer(world.robot, "/action")
        self.goals = Client(world.operator, "/action")
        self.node = world.robot.node("settable", start_parameter_services=True)
        self.node.declare_parameter("speed", 1.0)

    def operate(self):
        connect(self.command, self.heard, String(data="go"))
        self.caller.wait_ready()
        self.caller.ask("call")
        self.caller.wait_answers(1)
        assert self.service.executed == ["call"]
        until(self.goals.server_is_ready, "the action is ready")
        assert Goal(self.goals, 3).handle.accepted
        parameters = AsyncParameterClient(self.world.operator.tester, "settable")
        assert parameters.wait_for_services(WAIT)
        changed = parameters.set_parameters([Parameter("speed", value=2.0)])
        until(changed.done, "an answer of the parameter service")
        assert self.node.get_parameter("speed").value == 2.0

    def stands_still(self):
        self.command.publish(String(data="of who may only look"))
        time.sleep(0.5)
        assert not self.caller.ready()
        assert not self.goals.server_is_ready()
        assert not self.heard.messages
        parameters = AsyncParameterClient(self.world.operator.tester, "settable")
        assert not parameters.services_are_ready()

    def stop(self):
        self.goals.destroy()
        self.action.stop()


@pytest.fixture
def world(request, tmp_path, domains, make_graph):
    """The robot's program is that of the module's ROBOT_RUNS, or the server."""
    started = []
    robot = getattr(request.module, "ROBOT_RUNS", "server")
    yield World(tmp_path, domains(2), make_graph, started, robot)
    for program in started:
        program.kill()
