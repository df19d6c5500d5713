"""/clock: relayed newest-only, or published by the importing side itself."""

import threading
import time

import pytest
from rclpy.qos import ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from graph import qos, until

pytestmark = pytest.mark.alone

CLOCK_QOS = qos(1, reliability=ReliabilityPolicy.BEST_EFFORT)  # as nodes with use_sim_time have it
PUBLISH = {
    "rules": ["time"],
    "rule": {"time": {"import_topics": ["/clock"], "clock": "publish"}},
}


def seconds(message):
    return message.clock.sec + message.clock.nanosec / 1e9


class Simulator:
    """Publishes /clock at 100 Hz, from 1000 s on, at a speed of its own."""

    def __init__(self, graph, speed=0.5):
        self._speed = speed
        self._publisher = graph.publisher(Clock, "/clock", qos(1))
        self._begin = time.monotonic()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def now(self):
        return 1000 + (time.monotonic() - self._begin) * self._speed

    def _run(self):
        while not self._stop.wait(0.01):
            message = Clock()
            message.clock.sec = int(self.now())
            message.clock.nanosec = int(self.now() % 1 * 1e9)
            self._publisher.publish(message)

    def stop(self):
        self._stop.set()
        self._thread.join()


def check(collector, now, tolerance):
    """Rate, order and value of what has been collected in two seconds."""
    collector.wait(1)
    collector.clear()
    errors = []
    begin = time.monotonic()
    seen = 0
    while time.monotonic() - begin < 2:
        if len(collector.messages) > seen:
            seen = len(collector.messages)
            errors.append(abs(seconds(collector.messages[-1]) - now()))
        time.sleep(0.001)
    values = [seconds(m) for m in collector.messages]
    assert values == sorted(values), "time went backwards"
    assert 100 < len(values) <= 220, len(values)
    errors.sort()
    assert errors[len(errors) // 2] < tolerance, f"off by {errors[len(errors) // 2]} s"


def test_relay(make_pair):
    pair = make_pair()
    simulator = Simulator(pair.robot)
    collector = pair.operator.collector(Clock, "/clock", CLOCK_QOS)
    check(collector, simulator.now, 0.05)
    simulator.stop()


def test_publish_the_robots_simulated_time(make_pair):
    pair = make_pair(
        server={
            "use_sim_time": True,
            "rules": ["time"],
            "rule": {"time": {"export_topics": ["/clock"]}},
        },
        client=PUBLISH,
    )
    simulator = Simulator(pair.robot)
    collector = pair.operator.collector(Clock, "/clock", CLOCK_QOS)
    check(collector, simulator.now, 0.05)
    simulator.stop()
    assert len(pair.operator.publishers("/clock")) == 1


def test_publish_the_time_of_the_robots_clock(make_pair):
    """Though the server itself does not use simulated time; also to reliable subscribers. Nothing
    is published before the simulator is there."""
    pair = make_pair(client=PUBLISH)
    collector = pair.operator.collector(Clock, "/clock", 10)
    until(lambda: pair.operator.publishers("/clock"), "the client publishes /clock")
    time.sleep(2)  # more than one time request
    assert not collector.messages
    simulator = Simulator(pair.robot, speed=2.0)
    collector.wait_for(lambda m: seconds(m) < 10_000, "simulated time")
    assert max(seconds(m) for m in collector.messages) < 10_000
    check(collector, simulator.now, 0.05)
    simulator.stop()
    assert not pair.robot.publishers("/clock")[1:], "nothing goes back"


def test_publish_the_robots_system_time(make_pair):
    """Its rules export no /clock, so it is its node's time that counts."""
    pair = make_pair(
        server={"rules": ["t"], "rule": {"t": {"export_topics": ["/t/**"]}}}, client=PUBLISH
    )
    collector = pair.operator.collector(Clock, "/clock", CLOCK_QOS)
    check(collector, time.time, 0.05)
    assert pair.client.stop() == 0
    until(lambda: not pair.operator.publishers("/clock"), "it ends with the client")
