"""Who steers a robot: stamps in its clock, one driver at a time, and halts."""

import pathlib
import signal
import subprocess
import sys
import threading
import time

import pytest
from geometry_msgs.msg import Twist, TwistStamped
from std_srvs.srv import SetBool

from calls import Caller
from graph import until
from harness.programs import Program, ros_environment, uses_rmw

pytestmark = pytest.mark.alone
HERE = pathlib.Path(__file__).resolve().parent
# As of diff_drive_controller, whose model is below.
TIMEOUT = 0.5
# The error of the measured offset, and the delays of a busy machine.
BOUND = 0.3


def driving(**treatment):
    rule = {"import_topics": ["/cmd_vel"], **treatment}
    return {"rules": ["drive"], "rule": {"drive": rule}}


class DiffDrive:
    """How diff_drive_controller judges commands: it ignores old ones, and brakes when the stamp of
    the last one is older than `cmd_vel_timeout`. Its clock is that of this machine."""

    def __init__(self, graph):
        self.drove = []  # times at which the wheels turned
        self.commands = []
        self._last = None
        self._node = graph.tester
        self._done = threading.Event()
        graph.tester.create_subscription(TwistStamped, "/cmd_vel", self._command, 1)
        threading.Thread(target=self._update, daemon=True).start()

    def _age(self, message):
        stamp = message.header.stamp
        return time.time() - (stamp.sec + stamp.nanosec / 1e9)

    def _command(self, message):
        self.commands.append((time.monotonic(), message))
        if self._age(message) <= TIMEOUT:
            self._last = message

    def _update(self):
        while not self._done.wait(0.02):
            last = self._last
            if last and self._age(last) <= TIMEOUT and last.twist.linear.x:
                self.drove.append(time.monotonic())

    def close(self):
        self._done.set()


@pytest.fixture
def clock_ahead(tmp_path):
    """clock_ahead(seconds): the environment of programs with such a clock."""
    library = tmp_path / "clock_ahead.so"
    command = ["c++", "-shared", "-fPIC", "-o", library, HERE / "clock_ahead.cpp"]
    subprocess.run(command, check=True)
    return lambda seconds: {"LD_PRELOAD": str(library), "CLOCK_AHEAD": str(seconds)}


@pytest.fixture
def teleop(tmp_path):
    """teleop(domain, *words, **environment): starts one."""
    running = []

    def start(domain, *words, **environment):
        command = [sys.executable, HERE / "teleop.py", *words]
        env = ros_environment(domain, **environment)
        program = Program(f"teleop{len(running)}", command, env, tmp_path)
        running.append(program.start())
        return program

    yield start
    for program in running:
        program.kill()


@pytest.mark.parametrize("ahead", [5, -5, 0])
def test_a_robot_drives_by_its_own_clock(make_pair, clock_ahead, teleop, ahead):
    """Without stamps in the robot's clock it drives 5.5 s on, or never."""
    pair = make_pair(server=driving(wheel=False), start=False)
    pair.client.env.update(clock_ahead(ahead))
    robot = DiffDrive(pair.robot)
    pair.bridge.start()
    driver = teleop(pair.domains[1], "2.0", "0.5", **clock_ahead(ahead))
    driver.wait_for("let go", 30)
    time.sleep(6.5)
    robot.close()
    last = robot.commands[-1][0]
    turned = [at for at in robot.drove if at <= last]
    after = max(robot.drove, default=last) - last
    print(f"{ahead} s ahead: {len(robot.commands)} commands, drives {after:.2f} s after the last")
    assert len(robot.commands) > 20
    assert turned and last - turned[0] > 1.0
    assert after <= TIMEOUT + BOUND


def test_silence_halts_and_a_held_stick_lets_go_first(relayed):
    pair, relay = relayed(server=driving(halt_after=0.3))
    stick = pair.operator.publisher(Twist, "/cmd_vel", 1)
    robot = pair.robot.collector(Twist, "/cmd_vel", 10)
    until(lambda: stick.get_subscription_count() and pair.robot.publishers("/cmd_vel"), "a mirror")
    held = threading.Event()
    done = threading.Event()

    def lean():
        while not done.wait(0.05):
            message = Twist()
            message.linear.x = 0.5 if held.is_set() else 0.0
            stick.publish(message)

    thread = threading.Thread(target=lean, daemon=True)
    thread.start()
    held.set()
    robot.wait_for(lambda m: m.linear.x > 0, "a command")
    time.sleep(1)
    assert robot.messages[-1].linear.x > 0
    relay.stall()
    until(lambda: robot.messages[-1].linear.x == 0, "a zero", 2)
    time.sleep(0.3)
    zeros = [at for at, m in zip(robot.times, robot.messages) if m.linear.x == 0]
    moving = [at for at, m in zip(robot.times, robot.messages) if m.linear.x > 0]
    print(f"a zero {zeros[-3] - moving[-1]:.3f} s after the last command, then after "
          f"{zeros[-2] - zeros[-3]:.3f} and {zeros[-1] - zeros[-2]:.3f} s")
    assert 0.25 < zeros[-3] - moving[-1] < 0.3 + BOUND
    assert zeros[-1] - zeros[-3] < 0.2 + BOUND
    relay.heal()
    until(lambda: pair.server.topic("/cmd_vel").get("dropped", {}).get("wheel"), "drops", 20)
    assert pair.server.topic("/cmd_vel").get("wheel") == "halted"
    until(lambda: pair.client.topic("/cmd_vel").get("wheel") == "halted", "the state there")
    robot.clear()
    time.sleep(1)
    assert not [m for m in robot.messages if m.linear.x > 0]
    held.clear()
    robot.wait_for(lambda m: m.linear.x == 0, "a neutral")
    held.set()
    robot.wait_for(lambda m: m.linear.x > 0, "a command")
    done.set()
    thread.join()


def test_two_clients_drive_one_after_the_other(make_pair, make_side, make_graph, domains):
    pair = make_pair(server=driving(halt_after=0.5))
    (domain,) = domains(1)
    other = make_side("client", domain, {}, name="other", node="connect_client")
    other.set_parameters({**pair.client.parameters, "status_file": str(other.status_file)})
    other.start().wait_linked()
    robot = pair.robot.collector(Twist, "/cmd_vel", 100)
    graphs = (pair.operator, make_graph(domain))
    sticks = [graph.publisher(Twist, "/cmd_vel", 1) for graph in graphs]
    pair.robot.wait_publishers("/cmd_vel", 2)
    for stick in sticks:
        until(stick.get_subscription_count, "a demand")

    def drive(stick, speed, seconds=0.0):
        end = time.monotonic() + seconds
        while True:
            message = Twist()
            message.linear.x = speed
            stick.publish(message)
            time.sleep(0.05)
            if time.monotonic() >= end:
                return

    leaning = threading.Thread(target=drive, args=(sticks[0], 0.1, 3.0))
    leaning.start()
    robot.wait_for(lambda m: m.linear.x == 0.1, "the first driver")
    robot.clear()
    drive(sticks[1], 0.2, 0.5)
    assert not [m for m in robot.messages if m.linear.x == 0.2]
    assert [m for m in robot.messages if m.linear.x == 0.1]
    # Somebody else's stop works, once its publisher said nothing for a second and a half.
    time.sleep(1.7)
    drive(sticks[1], 0.0)
    robot.wait_for(lambda m: m.linear.x == 0, "a zero")
    time.sleep(0.2)
    robot.clear()
    leaning.join()
    assert not [m for m in robot.messages if m.linear.x == 0.1]
    time.sleep(1)
    if uses_rmw("rmw_cyclonedds_cpp"):  # does not number samples
        drive(sticks[1], 0.0)
    drive(sticks[1], 0.2, 0.2)
    robot.wait_for(lambda m: m.linear.x == 0.2, "the second driver")


def test_single_commands_and_slow_rates_work(make_pair):
    """As `ros2 topic pub --once` and `--rate 2` publish."""
    pair = make_pair(server=driving(halt_after=1.0))
    robot = pair.robot.collector(Twist, "/cmd_vel", 10)
    for speed in (0.1, 0.2, 0.3):
        node = pair.operator.node(f"once_{speed:g}".replace(".", "_"))
        once = pair.operator.publisher(Twist, "/cmd_vel", 10, node=node)
        until(once.get_subscription_count, "a demand")
        message = Twist()
        message.linear.x = speed
        once.publish(message)
        robot.wait_for(lambda m, speed=speed: m.linear.x == speed, f"{speed} m/s")
        time.sleep(0.5)
        pair.operator.remove(node)
        robot.wait_for(lambda m: m.linear.x == 0, "a halt")
        robot.clear()
        time.sleep(1.2)
    rate = pair.operator.publisher(Twist, "/cmd_vel", 10)
    until(rate.get_subscription_count, "a demand")
    for _ in range(6):
        message = Twist()
        message.linear.x = 0.4
        rate.publish(message)
        time.sleep(0.5)
    robot.wait_for(lambda m: m.linear.x == 0.4, "a command")
    assert len([m for m in robot.messages if m.linear.x == 0.4]) == 6


@pytest.fixture
def leaning():
    """leaning(graph): a stick that is held there; its `speed` may be changed."""

    class Stick:
        def __init__(self, graph):
            self.speed = 0.5
            self._publisher = graph.publisher(Twist, "/cmd_vel", 1)
            self._done = threading.Event()
            self._thread = threading.Thread(target=self._lean, daemon=True)
            self._thread.start()

        def _lean(self):
            while not self._done.wait(0.05):
                message = Twist()
                message.linear.x = self.speed
                self._publisher.publish(message)

        def close(self):
            self._done.set()
            self._thread.join()

    sticks = []

    def make(graph):
        sticks.append(Stick(graph))
        return sticks[-1]

    yield make
    for stick in sticks:
        stick.close()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_client_that_dies_or_stands_still_is_halted(make_pair, leaning, how):
    """Nothing moves after it, also when the process goes on with what it had kept."""
    pair = make_pair(server=driving(halt_after=0.3))
    robot = pair.robot.collector(Twist, "/cmd_vel", 10)
    leaning(pair.operator)
    robot.wait_for(lambda m: m.linear.x > 0, "a command")
    time.sleep(0.5)
    began = time.monotonic()
    pair.client.process.send_signal(how)
    until(lambda: robot.messages[-1].linear.x == 0, "a zero", 3)
    print(f"a zero {time.monotonic() - began:.2f} s after {how.name}")
    assert time.monotonic() - began < 0.3 + BOUND
    robot.clear()
    time.sleep(1)
    if how == signal.SIGSTOP:
        pair.client.process.send_signal(signal.SIGCONT)
        time.sleep(1)
    assert not [m for m in robot.messages if m.linear.x > 0]
    if how == signal.SIGKILL:
        pair.client.kill()
        pair.client.start().wait_linked()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_server_that_dies_or_stands_still_says_nothing(make_pair, leaning, how):
    """Nobody publishes a zero then: the base needs a watchdog of its own."""
    pair = make_pair(server=driving(halt_after=0.3))
    robot = pair.robot.collector(Twist, "/cmd_vel", 10)
    stick = leaning(pair.operator)
    robot.wait_for(lambda m: m.linear.x > 0, "a command")
    time.sleep(0.5)
    pair.server.process.send_signal(how)
    time.sleep(0.3)
    robot.clear()
    time.sleep(1.5)
    assert not robot.messages
    if how == signal.SIGKILL:
        pair.server.kill()
        pair.server.start().wait_listening()
    else:
        pair.server.process.send_signal(signal.SIGCONT)
        time.sleep(1)  # commands of that time are old
    robot.clear()  # of a halt's zeros, which are no neutral
    stick.speed = 0.0
    robot.wait_for(lambda m: m.linear.x == 0, "a neutral", 20)
    robot.clear()
    stick.speed = 0.5
    robot.wait_for(lambda m: m.linear.x > 0, "a command", 20)


def test_the_service_takes_and_leaves_the_wheel(make_pair, leaning):
    """It is not exported, whatever the rules say."""
    imported = {"import_topics": ["/**"], "import_services": ["/**"]}
    exported = {"export_topics": ["/**"], "export_services": ["/**"]}
    pair = make_pair(
        server={"rules": ["all"], "rule": {"all": imported}},
        client={"rules": ["all"], "rule": {"all": exported}},
    )
    switch = Caller(pair.operator, "/connect_client/drive", SetBool).wait_ready()
    answer = switch.call(SetBool.Request(data=True))
    assert not answer.success and "nothing to steer" in answer.message
    robot = pair.robot.collector(Twist, "/cmd_vel", 10)
    stick = leaning(pair.operator)
    robot.wait_for(lambda m: m.linear.x > 0, "a command")
    stick.speed = 0.0
    until(lambda: pair.client.topic("/cmd_vel").get("wheel") == "free", "a free wheel", 10)
    answer = switch.call(SetBool.Request(data=True))
    assert (answer.success, answer.message) == (True, "you drive /cmd_vel")
    answer = switch.call(SetBool.Request(data=False))
    assert (answer.success, answer.message) == (True, "nobody drives /cmd_vel")
    names = [name for name, _ in pair.robot.tester.get_service_names_and_types()]
    assert "/connect_client/drive" not in names
