"""Two machines that get to know each other by pairing alone."""

import pathlib
import re
import stat

import pytest
from std_msgs.msg import String

from graph import connect
from harness.domains import free_port
from harness.programs import Program, build_dir, ros_environment

LINE = re.compile(r"ros2 run connect_bridge client (?:--robot )?'(wss\+pair://\S+)'")
# Of a program whose output is no terminal.
SHOWN = re.compile(r"The invitation is in '(.+)', since")


def invitation_of(server):
    """What it has invited with, from the file that only its owner reads."""
    file = pathlib.Path(server.wait_for(SHOWN).group(1))
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    return LINE.search(file.read_text(encoding="utf-8")).group(1)


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


@pytest.fixture
def world(request, tmp_path, domains, make_graph):
    """The robot's program is that of the module's ROBOT_RUNS, or the server."""
    started = []
    robot = getattr(request.module, "ROBOT_RUNS", "server")
    yield World(tmp_path, domains(2), make_graph, started, robot)
    for program in started:
        program.kill()
