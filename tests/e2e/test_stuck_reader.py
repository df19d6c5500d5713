"""A reliable reader at the operator that stands still: a publisher that waits for it must not hold
up the bridge."""

import os
import signal
import sys
import time

import pytest
from rclpy.qos import HistoryPolicy, QoSProfile
from std_msgs.msg import Int32, UInt8MultiArray
from std_srvs.srv import Trigger

from graph import until
from harness.programs import Program, ros_environment

SERVER = {
    "rules": ["all"],
    "rule": {"all": {"export_topics": ["/t/**"], "export_services": ["/s/**"]}},
}
LARGE = UInt8MultiArray(data=bytes(100_000))
STANDS = 8.0  # seconds; after 10 s Cyclone DDS forgets the reader
READER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import UInt8MultiArray
rclpy.init()
node = Node("stuck")
node.create_subscription(UInt8MultiArray, "/t/large", lambda _: print("heard", flush=True), 10)
rclpy.spin(node)
"""


@pytest.mark.slow
@pytest.mark.parametrize("history", [HistoryPolicy.KEEP_LAST, HistoryPolicy.KEEP_ALL])
def test_other_topics_and_calls_pass(make_pair, tmp_path, history):
    pair = make_pair(server=SERVER)
    robot, operator = pair.robot, pair.operator
    large = robot.publisher(
        UInt8MultiArray, "/t/large", QoSProfile(depth=10, history=history), robot.node("camera")
    )
    small, collector = pair.opened(Int32, "/t/small", Int32(data=-1), 1000)
    robot.tester.create_service(Trigger, "/s/ask", lambda _, response: response)
    client = operator.tester.create_client(Trigger, "/s/ask")
    env = ros_environment(pair.domains[1])
    reader = Program("reader", [sys.executable, "-c", READER], env, tmp_path).start()
    try:
        until(lambda: large.publish(LARGE) or "heard" in reader.text(), "it reads", step=0.1)
        until(client.service_is_ready, "the service")
        taken = pair.client.topic("/t/large").get("messages", 0)
        collector.clear()
        os.kill(reader.pid, signal.SIGSTOP)
        begin, sent, waits, lags = time.monotonic(), 0, [], []
        while time.monotonic() < begin + STANDS:
            large.publish(LARGE)
            small.publish(Int32(data=sent))
            sent += 1
            asked = time.monotonic()
            answer = client.call_async(Trigger.Request())
            until(answer.done, "an answer while a reader stands still", step=0.002)
            waits.append(time.monotonic() - asked)
            lags.append(pair.client.status().get("loop_lag_ms", 0))
            time.sleep(0.02)
        collector.wait(sent)
        assert [m.data for m in collector.messages] == list(range(sent))
        # The large ones were published, too: those of the last second may not be counted yet.
        passed = lambda: pair.client.topic("/t/large").get("messages", 0) - taken  # noqa: E731
        until(lambda: passed() > 0.9 * sent, lambda: f"{passed()} of {sent} large ones")
        print(
            f"{history.name}: {sent} large ones; the longest call {1000 * max(waits):.0f} ms, "
            f"the loop held up for {max(lags):.0f} ms at most"
        )
        # One that keeps all would wait until its reader is forgotten: Cyclone's 10 s.
        assert max(lags) < 3000 and max(waits) < 3
    finally:
        reader.kill()
