"""The three ways of docs/reach.md, with a carrier's NAT before every end that has no address:
nothing gets in, and a connection on which nothing passes for 30 s is forgotten without a word."""

import pathlib
import subprocess
import sys
import time

import pytest

from graph import here, until
from harness import nat
from harness.domains import release_domains, take_domains
from harness.nat import ADDRESS, FORGETS, OPERATOR, OPERATOR_NAT, PUBLIC, ROBOT, ROBOT_NAT, Nat
from harness.programs import Program, build_dir
from harness.worker import Missing, Worker
from pairing import invitation_of, relay_line

PARTS = 3
PORT = 4711
AT_PLACE = pathlib.Path(__file__).with_name("at_place.py")
LTE = {"up": 18e6, "down": 58e6, "delay": 0.02}
SOON = 10  # s: from nothing to the first message
BACK = 2  # s: after the path is there again


class Bed:
    """Nothing is configured at any end: each program has the home of a new user."""

    def __init__(self, folder):
        self.folder = folder
        self.nat = Nat(folder)
        self.nat.wan.set(**LTE)
        self.domains = take_domains(2)
        self._began = []

    def environment(self, who):
        return nat.environment(self.domains[who == "operator"], f"{self.folder}/{who}")

    def run(self, place, who, *words):
        command = [*self.nat.within(place), build_dir() / words[0], *words[1:]]
        program = Program(f"{len(self._began)}-{who}", command, self.environment(who), self.folder)
        self._began.append(program.kill)
        return program.start()

    def nodes(self, place, who):
        command = [*self.nat.within(place), sys.executable, "-B", AT_PLACE]
        worker = Worker(
            f"{len(self._began)}-nodes", command, self.environment(who), self.folder
        ).start()
        self._began.append(worker.close)
        worker.ready()
        return worker

    def relay(self):
        """It runs; the line for the robot."""
        place = f"robot7@{ADDRESS}:{PORT}"
        command = [build_dir() / "relay", "--robot", place]
        made = subprocess.run(
            command, env=self.environment("relay"), check=True, capture_output=True, text=True
        )
        self.start_relay()
        return relay_line(made.stdout)

    def start_relay(self):
        self.relay_program = self.run(PUBLIC, "relay", "relay")
        self.relay_program.wait_for("listens on port")

    def close(self):
        for end in reversed(self._began):
            end()
        self.nat.close()
        release_domains(self.domains)


@pytest.fixture
def bed(tmp_path):
    try:
        made = Bed(tmp_path)
    except Missing as error:
        pytest.skip(f"NOT TESTED: no NAT on this machine: {error}")
    yield made
    made.close()


class Ends:
    """Nodes at both ends: the robot talks, and may be told and asked something."""

    def __init__(self, bed, robot=ROBOT, operator=OPERATOR):
        self.robot = bed.nodes(robot, "robot")
        self.operator = bed.nodes(operator, "operator")
        self.robot.ask("talk /state")
        self.robot.ask("serve /service")
        self.operator.ask("talk /command")
        for end, topic in ((self.operator, "/state"), (self.robot, "/command")):
            end.ask(f"heard {topic}")

    def hears(self, topic="/state", since=0.0, seconds=15.0):
        """Until something arrives that was published after then."""
        end = self.operator if topic == "/state" else self.robot
        until(lambda: end.ask(f"heard {topic}")["last"] > since, f"a message of {topic}", seconds)

    def operates(self):
        self.hears("/command")
        until(lambda: self.operator.ask("ready /service")["ready"], "the service at the operator")
        self.operator.ask("ask /service first")
        until(lambda: self.operator.ask("answers /service")["names"], "an answer")


def port(number=PORT):
    return ("--ros-args", "-p", f"listen.port:={number}")


def test_who_has_an_address_is_dialled_by_the_operator(bed):
    ends = Ends(bed, robot=PUBLIC)
    begin = time.monotonic()
    server = bed.run(PUBLIC, "robot", "server", "--pair", ADDRESS, "--operate", *port())
    bed.run(OPERATOR, "operator", "client", invitation_of(server))
    ends.hears()
    assert time.monotonic() - begin < here(SOON)
    ends.operates()


def test_the_robot_dials(bed):
    ends = Ends(bed, operator=PUBLIC)
    begin = time.monotonic()
    server = bed.run(PUBLIC, "operator", "server", "--pair", ADDRESS, "--drive", *port())
    bed.run(ROBOT, "robot", "client", "--robot", "--operate", invitation_of(server))
    ends.hears()
    assert time.monotonic() - begin < here(SOON)
    ends.operates()


def test_both_dial_a_relay(bed):
    ends = Ends(bed)
    via = bed.relay()
    begin = time.monotonic()
    server = bed.run(ROBOT, "robot", "server", "--pair", "--via", via, "--operate")
    bed.run(OPERATOR, "operator", "client", invitation_of(server))
    ends.hears()
    assert time.monotonic() - begin < here(SOON)
    ends.operates()


def test_the_operators_server_waits_at_a_relay(bed):
    ends = Ends(bed)
    via = bed.relay()
    begin = time.monotonic()
    server = bed.run(OPERATOR, "operator", "server", "--pair", "--drive", "--via", via)
    bed.run(ROBOT, "robot", "client", "--robot", "--operate", invitation_of(server))
    ends.hears()
    assert time.monotonic() - begin < here(SOON)
    ends.operates()


class Paired:
    """Both at a relay, with a call under way twenty times a second while it is lost."""

    def __init__(self, bed):
        self.bed = bed
        self.ends = Ends(bed)
        self.via = bed.relay()
        self.server = bed.run(ROBOT, "robot", "server", "--pair", "--via", self.via, "--operate")
        self.client = bed.run(OPERATOR, "operator", "client", invitation_of(self.server))
        self.ends.hears()
        self.ends.operates()
        self.asked = 0

    def ask(self, seconds=1.0):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.asked += 1
            self.ends.operator.ask(f"ask /service {self.asked}")
            time.sleep(0.05)

    def is_back(self, seconds):
        """Messages that are published from now on arrive within so long; no call ran twice."""
        begin = time.monotonic()
        self.ends.hears(since=begin, seconds=here(seconds) + 10)
        took = time.monotonic() - begin
        assert took < here(seconds), f"{took:.1f} s"
        executed = self.ends.robot.ask("executed /service")["names"]
        assert len(executed) == len(set(executed)), "a call ran twice"
        return took


# A link that says nothing is given up after dead_after, 3 s; the path is there again before.
@pytest.mark.parametrize("who", [ROBOT_NAT, OPERATOR_NAT])
def test_a_nat_gets_another_address(bed, who):
    pair = Paired(bed)
    pair.ask()
    bed.nat.readdress(who, 77)
    pair.ask()
    print(f"back after {pair.is_back(3 + BACK):.1f} s")


def test_the_robot_gets_another_address(bed):
    pair = Paired(bed)
    pair.ask()
    bed.nat.run(
        ROBOT,
        "ip addr flush dev wan0\nip addr add 10.77.0.9/24 dev wan0\n"
        "ip route replace default via 10.77.0.2",
    )
    print(f"back after {pair.is_back(3 + BACK):.1f} s")


def test_after_a_restart_all_meet_again(bed):
    pair = Paired(bed)
    pair.ask()
    bed.relay_program.stop()
    pair.ask()
    bed.start_relay()
    print(f"the relay: back after {pair.is_back(BACK):.1f} s")
    bed.nat.wan.cut()
    pair.ask(4)
    bed.nat.wan.heal()
    print(f"the path: back after {pair.is_back(BACK + 1):.1f} s")
    pair.client.stop()
    pair.client = bed.run(OPERATOR, "operator", "client")
    print(f"the operator: {pair.is_back(BACK + 3):.1f} s")
    pair.server.stop()
    pair.server = bed.run(ROBOT, "robot", "server")
    print(f"the robot: {pair.is_back(BACK + 3):.1f} s")


@pytest.mark.slow
def test_a_nat_that_forgets_leaves_an_idle_robot_reachable(bed):
    pair = Paired(bed)
    pair.client.stop()
    time.sleep(FORGETS + 10)  # the robot has nobody to talk to
    begin = time.monotonic()
    bed.run(OPERATOR, "operator", "client").wait_for(": connected to ")
    assert time.monotonic() - begin < here(5)
    pair.is_back(BACK + 1)
