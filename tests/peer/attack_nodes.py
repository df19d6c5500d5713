#!/usr/bin/env python3
"""The robot's nodes that some attacks need: attack_nodes.py ATTACK DOMAIN. They listen to what it
sends, or publish what it demands, until the standard input ends. They do not attack, so they have a
process and a priority of their own. Run by attack_scene.py."""

import contextlib
import itertools
import os
import pathlib
import select
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(HERE), str(HERE.parent / "e2e"), str(HERE.parents[1] / "tools")]

from attack_peers import LARGE_NAMES, LATCHED, LOST_NAMES  # noqa: E402
from graph import Graph  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from std_msgs.msg import String, UInt8MultiArray  # noqa: E402

CAMERA_PERIOD = 0.04
LARGE_BYTES = 1 << 20


@contextlib.contextmanager
def graph(domain, name):
    """A graph of these nodes, while the standard input is open."""
    robot = Graph(domain, name=name)
    yield robot
    robot.close()


def until_the_end(period=None):
    """Yields each `period`, or never; ends with the standard input."""
    print("ready", flush=True)
    for turn in itertools.count():
        if select.select([sys.stdin], [], [], period)[0]:
            return
        yield turn


def listen(domain, names):
    with graph(domain, "listener") as robot:
        for name in names:
            robot.tester.create_subscription(UInt8MultiArray, name, lambda _: None, 1, raw=True)
        for _ in until_the_end():
            pass


def bomb(domain):
    listen(domain, ["/o/bomb"])


def unfinished(domain):
    listen(domain, LARGE_NAMES)


def never_reads(domain):
    """A camera: 25 MB/s."""
    with graph(domain, "camera") as robot:
        publisher = robot.publisher(UInt8MultiArray, "/t/large", 5)
        large = UInt8MultiArray(data=os.urandom(LARGE_BYTES))
        for _ in until_the_end(CAMERA_PERIOD):
            publisher.publish(large)


def lost(domain):
    """A node that starts, listens to what is offered, and ends, twice a second."""
    for turn in until_the_end(0.25):
        with graph(domain, f"comes_and_goes{turn}") as robot:
            for name in LOST_NAMES:
                robot.tester.create_subscription(String, name, lambda _: None, 1, raw=True)
            time.sleep(0.25)


def gone(domain):
    """1,200 events a second."""
    with graph(domain, "events") as robot:
        publisher = robot.publisher(String, "/t/events", 1000)
        event = String(data="x" * 50)
        for _ in until_the_end(0.005):
            for _ in range(6):
                publisher.publish(event)


def toggles(domain):
    """Latched topics."""
    with graph(domain, "latched") as robot:
        qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        publishers = [robot.publisher(String, f"/t/latched{n}", qos) for n in range(LATCHED)]
        for publisher in publishers:
            publisher.publish(String(data="x" * 1000))
        for _ in until_the_end():
            pass


NODES = {
    "bomb": bomb,
    "large": unfinished,
    "unfinished": unfinished,
    "never_reads": never_reads,
    "lost": lost,
    "unplaced": lost,
    "gone": gone,
    "readers": never_reads,
    "toggles": toggles,
}

if __name__ == "__main__":
    NODES[sys.argv[1]](int(sys.argv[2]))
