"""The examples of README.md, run as they are printed.

A line `<!-- test: ... -->` above a block says what it is:
  PLACE: file NAME      a file in the folder of this place
  PLACE: ends           a script for a shell in this folder, which must succeed
  PLACE: stays          the same, but its last command runs until the end of the section
  PLACE: printed        what the last script that ended printed there, whole
  not run: REASON
What follows a `;` is for people.
"""

import os
import pathlib
import re
import signal

import pytest
from geometry_msgs.msg import Twist
from rclpy.parameter import Parameter
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool

from graph import until
from harness.domains import free_port
from harness.programs import ROOT, Program, ros_environment

STAND_IN = pathlib.Path(__file__).resolve().parent / "stand_in"
LISTED = re.compile(r"<!-- test: (.*?) -->")
# Log lines of a side that is ready for others, and of one that has reached its peer.
READY = {"server": r"listening on ", "client": r": connected to "}


def sections():
    """Heading -> the blocks below it, each with its first line, what it is, and its text."""
    found, heading, marker, block = {}, "", "", None
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, 1):
        if block is not None and line != "```":
            block[2].append(line)
        elif block is not None:
            found.setdefault(heading, []).append((block[0], block[1], "\n".join(block[2]) + "\n"))
            marker, block = "", None
        elif line.startswith("```"):
            assert marker or line == "```", f"README.md:{number}: no test: line above this block"
            block = (number, marker or "not run: a picture", [])
        elif line.startswith("## "):
            heading = line[3:]
        elif line.strip():
            marked = LISTED.fullmatch(line)
            marker = marked.group(1).split(";")[0] if marked else ""
    return found


class Shell(Program):
    """A terminal: what is typed there, and all that it started, ends with it."""

    def __init__(self, name, script, env, folder):
        super().__init__(name, ["bash", "-ec", f"cd '{folder}'\n{script}"], env, folder.parent)

    def stop(self, how=signal.SIGTERM, timeout=10.0):
        if self.running():
            os.killpg(self.pid, how)
        return super().stop(how, timeout)


class Section:
    """Plays the blocks of one section in their order."""

    def __init__(self, folder, domains):
        self.folder, self.domains = folder, domains
        self.shells, self.printed = [], {}
        self.replaced = {
            "9090": str(free_port()),
            "ROS_DOMAIN_ID=1 ": f"ROS_DOMAIN_ID={domains[0]} ",
            "ROS_DOMAIN_ID=2 ": f"ROS_DOMAIN_ID={domains[1]} ",
            "robot.local": "localhost",
        }

    def play(self, blocks):
        for number, marker, text in blocks:
            if marker.startswith("not run: "):
                continue
            place, what = marker.split(": ", 1)
            for old, new in self.replaced.items():
                text = text.replace(old, new)
            (self.folder / place).mkdir(exist_ok=True)
            self.step(f"README.md:{number}", place, what, text)

    def step(self, where, place, what, text):
        if what.startswith("file "):
            (self.folder / place / what[5:]).write_text(text, encoding="utf-8")
        elif what == "printed":
            assert self.printed[place] == text, f"{where}: something else was printed"
        else:
            assert what in ("ends", "stays"), f"{where}: what is '{what}'?"
            shell = self.shell(where, place, text)
            if what == "stays":
                named = re.search(r"connect_bridge (server|client) ", text)
                if named:
                    shell.wait_for(READY[named.group(1)], 30)
                return
            until(lambda: not shell.running(), lambda: f"an end of {where}", 120)
            self.printed[place] = shell.text()
            assert shell.process.returncode == 0, f"{where}: failed\n{shell.text()}"

    def shell(self, where, place, text):
        domain = self.domains[0 if place == "robot" else 1]
        path = f"{STAND_IN}:{ROOT / 'tools' / 'ros2'}:{os.environ['PATH']}"
        env = ros_environment(domain, PATH=path, SCP_HOST=self.folder / "robot")
        name = f"{place}{len(self.shells)}"
        self.shells.append(Shell(name, text, env, self.folder / place).start())
        return self.shells[-1]

    def close(self):
        for shell in reversed(self.shells):
            shell.stop()


@pytest.fixture
def section(tmp_path, domains):
    made = Section(tmp_path, domains(2))
    yield made
    made.close()


def test_every_block_says_what_it_is():
    blocks = sections()
    assert len(blocks["The first five minutes"]) == 7
    assert len(blocks["Two machines, with files"]) == 7
    assert [marker[:8] for _, marker, _ in blocks["Two machines, two commands"]] == ["not run:"]


def test_the_first_five_minutes(section):
    section.play(sections()["The first five minutes"])
    assert section.printed["here"] == "data: hello from the robot\n---\n"


def test_two_machines(section, make_graph):
    robot = make_graph(section.domains[0])
    scan = robot.publisher(LaserScan, "/scan")
    robot.tester.create_timer(0.1, lambda: scan.publish(LaserScan()))
    driven = robot.collector(Twist, "/cmd_vel")
    called = []

    def enable(request, response):
        called.append(request.data)
        response.success = True
        return response

    robot.tester.create_service(SetBool, "/arm/enable", enable)
    arm = robot.node("arm_controller", start_parameter_services=True)
    arm.declare_parameter("speed", 0.1)
    section.play(sections()["Two machines, with files"])
    said = section.printed["operator"]
    assert "/scan\n" in said and "success=True" in said and "Set parameter successful" in said
    assert called == [True]
    assert driven.wait(1)[0].linear.x == 0.2
    assert arm.get_parameter("speed").value == Parameter("speed", value=0.5).value
