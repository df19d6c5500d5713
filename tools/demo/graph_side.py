"""Common to the robot's and the operator's process: subscribers that measure and report."""

import json
import os
import select
import sys
import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Image
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

REPORT_SECONDS = 0.5

STATIC_QOS = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
# Topic -> type, QoS. A real camera publishes best effort; tf and commands are reliable.
TOPICS = {
    "/chatter": (String, QoSProfile(depth=10)),
    "/camera/image": (Image, qos_profile_sensor_data),
    "/tf": (TFMessage, QoSProfile(depth=100)),
    "/tf_static": (TFMessage, STATIC_QOS),
    "/cmd_vel": (Twist, QoSProfile(depth=1)),
}


# What the operator calls at the robot: a service, an action, and a node with a parameter.
CALLS = ("/arm/enable", "/lookup", "/talker")


class Tally:
    """How many calls were answered, and how long that took."""

    def __init__(self):
        self._counts = {name: {"done": 0, "late": []} for name in CALLS}

    def done(self, name, begun):
        self._counts[name]["done"] += 1
        self._counts[name]["late"].append(1000 * (time.monotonic() - begun))

    def report(self):
        calls = {}
        for name, count in self._counts.items():
            late, count["late"] = count["late"], []
            calls[name] = {
                "done": count["done"],
                "late_ms": late,
            }
        return calls


def sent_at(message):
    """When the message was published, in seconds of the system clock."""
    if isinstance(message, String):
        return float(message.data.rsplit(" ", 1)[1])
    if isinstance(message, Twist):
        return message.linear.z  # a Twist has no stamp, and a robot on wheels does not fly
    header = message.transforms[0].header if isinstance(message, TFMessage) else message.header
    return header.stamp.sec + header.stamp.nanosec / 1e9


class Watcher(Node):
    """One subscriber per topic, as in any other node of this graph."""

    def __init__(self, context, tally):
        super().__init__("watcher", context=context)
        self._tally = tally
        self._counts = {topic: {"messages": 0, "bytes": 0, "late": []} for topic in TOPICS}
        self._frames = set()
        self._watching = [
            self.create_subscription(
                kind,
                topic,
                lambda raw, topic=topic, kind=kind: self._received(topic, kind, raw),
                QoSProfile(depth=100, reliability=qos.reliability, durability=qos.durability),
                raw=True,
            )
            for topic, (kind, qos) in TOPICS.items()
        ]

    def _received(self, topic, kind, raw):
        count = self._counts[topic]
        message = deserialize_message(raw, kind)
        count["messages"] += 1
        count["bytes"] += len(raw)
        if topic == "/tf_static":
            self._frames.update(transform.child_frame_id for transform in message.transforms)
        else:
            count["late"].append(1000 * (time.time() - sent_at(message)))

    def report(self):
        topics = {}
        for topic, count in self._counts.items():
            late, count["late"] = count["late"], []
            topics[topic] = {
                "messages": count["messages"],
                "bytes": count["bytes"],
                "late_ms": late,
            }
        return {
            "time": time.monotonic(),
            "topics": topics,
            "frames": sorted(self._frames),
            "calls": self._tally.report(),
        }


def _parent_has_gone():
    return select.select([sys.stdin], [], [], 0)[0] and not os.read(sys.stdin.fileno(), 1)


def run(make_nodes):
    """Runs the nodes of make_nodes(context, tally), and a watcher, until stdin closes."""
    context = rclpy.Context()
    rclpy.init(context=context)
    executor = SingleThreadedExecutor(context=context)
    tally = Tally()
    watcher = Watcher(context, tally)
    for node in (*make_nodes(context, tally), watcher):
        executor.add_node(node)

    def tell():
        if _parent_has_gone():
            context.try_shutdown()
        else:
            print(json.dumps(watcher.report()), flush=True)

    watcher.create_timer(REPORT_SECONDS, tell)
    try:
        while context.ok():
            executor.spin_once(timeout_sec=REPORT_SECONDS)
    except (BrokenPipeError, rclpy.executors.ExternalShutdownException, KeyboardInterrupt):
        pass
    context.try_shutdown()
