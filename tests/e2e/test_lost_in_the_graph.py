"""What the middleware loses between the bridge and a node is there again soon, and large messages
are not lost there."""

import os
import signal
import sys
import time

import pytest
from connect_bridge_test_interfaces.msg import Blob
from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import Int32

from graph import connect, qos, until
from harness.programs import Program, ros_environment, uses_rmw

FILLING = 1000  # more than wait for a reader that stands still, in shared memory or in a socket
COMMANDS = 20
ROUNDS = 3
PATIENCE = 1.0  # Fast DDS by itself repairs a loss every 3 s
READER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import Int32
rclpy.init()
node = Node("reader")
for name in ("filling", "command"):
    node.create_subscription(
        Int32, "/t/" + name, lambda m, name=name: print(name, m.data, flush=True), 100
    )
rclpy.spin(node)
"""


IMAGE = 1920 * 1080 * 3
IMAGES = 20


@pytest.mark.skipif(not uses_rmw("rmw_fastrtps_cpp"), reason="shared memory of Fast DDS")
def test_images_reach_a_subscriber_that_repairs_nothing(pair):
    # What the publisher loses is repaired, since another subscriber wants that.
    publisher, patient = pair.opened(Blob, "/t/image", Blob(), qos(2))
    collector = pair.operator.collector(
        Blob, "/t/image", qos(2, reliability=ReliabilityPolicy.BEST_EFFORT)
    )
    connect(publisher, collector, Blob())
    collector.clear()
    for number in range(1, IMAGES + 1):
        publisher.publish(Blob(sequence=number, data=bytes(IMAGE)))
        patient.wait_for(lambda image, number=number: image.sequence == number)
    come = [image.sequence for image in collector.messages if image.sequence]
    print(f"{len(come)} of {IMAGES} images came")
    assert len(come) >= IMAGES // 2


@pytest.mark.skipif(not uses_rmw("rmw_fastrtps_cpp"), reason="only Fast DDS waits for so long")
def test_a_command_is_not_late_by_seconds(pair, tmp_path):
    filling, command = (
        pair.robot.publisher(Int32, f"/t/{name}", 100) for name in ("filling", "command")
    )
    env = ros_environment(pair.domains[1])
    reader = Program("reader", [sys.executable, "-c", READER], env, tmp_path).start()

    def say(publisher, numbers):
        """These messages, which the client has published when it returns."""
        topic = publisher.topic_name
        before = pair.client.topic(topic).get("messages", 0)
        for number in numbers:
            publisher.publish(Int32(data=number))
            time.sleep(0.0005)
        passed = lambda: pair.client.topic(topic).get("messages", 0) - before  # noqa: E731
        until(lambda: passed() >= len(numbers), lambda: f"{passed()} on {topic}")

    try:
        for publisher in (filling, command):
            first = lambda p=publisher: p.publish(Int32(data=-1))  # noqa: E731
            heard = f"{publisher.topic_name[3:]} -1\n"
            until(lambda heard=heard: first() or heard in reader.text(), "it reads", step=0.1)
        late = []
        for number in range(ROUNDS):
            first = number * COMMANDS
            os.kill(reader.pid, signal.SIGSTOP)
            say(filling, range(FILLING))
            say(command, range(first, first + COMMANDS))
            time.sleep(number)  # at other times within such a period
            os.kill(reader.pid, signal.SIGCONT)
            goes_on, last = time.monotonic(), f"command {first + COMMANDS - 1}\n"
            until(lambda: last in reader.text(), "the last command")
            late.append(time.monotonic() - goes_on)
        commands = [line for line in reader.text().splitlines() if line.startswith("command")]
        wanted = [f"command {number}" for number in range(ROUNDS * COMMANDS)]
        assert commands[-len(wanted) :] == wanted
        print("all were there", *(f"{seconds:.2f}" for seconds in late), "s after it went on")
        assert max(late) < PATIENCE
    finally:
        reader.kill()
