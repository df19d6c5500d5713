"""/tf_static: every late subscriber gets every frame exactly once, reconnects included."""

import collections
import time

import pytest
from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy
from tf2_msgs.msg import TFMessage

from conftest import OPEN
from graph import qos, until

LATCHED = qos(1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LISTENER = qos(100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FRAMES = ("lidar", "camera", "imu")
QUIET = 1.0  # in which a duplicate would have come


def static(frame):
    transform = TransformStamped(child_frame_id=frame)
    transform.header.frame_id = "base_link"
    return TFMessage(transforms=[transform])


def publish_frames(pair, frames=FRAMES):
    publishers = []
    for frame in frames:
        node = pair.robot.node(f"{frame}_mount")
        publishers.append(pair.robot.publisher(TFMessage, "/tf_static", LATCHED, node))
        publishers[-1].publish(static(frame))
    return publishers


def frames_of(collector):
    return collections.Counter(
        t.child_frame_id for m in list(collector.messages) for t in m.transforms
    )


def late_subscriber(graph, frames=FRAMES):
    """Joins now; has every frame exactly once."""
    collector = graph.collector(TFMessage, "/tf_static", LISTENER, graph.node("late"))
    until(
        lambda: set(frames_of(collector)) == set(frames),
        lambda: f"all of {frames}, there are {dict(frames_of(collector))}",
    )
    time.sleep(QUIET)
    assert frames_of(collector) == collections.Counter(frames)
    return collector


def test_two_late_subscribers_and_frames_that_come_later(make_pair):
    pair = make_pair()
    publishers = publish_frames(pair)
    early = late_subscriber(pair.operator)
    late_subscriber(pair.operator)
    assert frames_of(early) == collections.Counter(FRAMES), "the first got something again"
    publishers[0].publish(static("lidar"))
    more = publish_frames(pair, ("gps",))
    until(lambda: frames_of(early) == {"lidar": 2, "camera": 1, "imu": 1, "gps": 1}, "the changes")
    assert more


def test_after_a_short_cut_nothing_comes_twice(relayed):
    """The link comes back in time: subscribers that had the frames do not get them again."""
    # On a busy machine a short cut lasts as long as elsewhere a dead link.
    patient = {"dead_after": 60.0}
    pair, relay = relayed(server={**OPEN, **patient}, client=patient)
    publish_frames(pair)
    early = late_subscriber(pair.operator)
    for _ in range(2):
        before = relay.connections
        relay.break_connections()
        until(lambda: relay.connections > before, "a new connection")
        late_subscriber(pair.operator)
    assert frames_of(early) == collections.Counter(FRAMES)


def test_after_a_dead_link_late_subscribers_have_each_once(relayed):
    pair, relay = relayed()
    publish_frames(pair)
    late_subscriber(pair.operator)
    relay.cut()
    pair.operator.wait_publishers("/tf_static", 0)
    time.sleep(0.5)
    relay.heal()
    pair.operator.wait_publishers("/tf_static", len(FRAMES))
    late_subscriber(pair.operator)


@pytest.mark.parametrize("which", ["server", "client"])
def test_after_a_restart_late_subscribers_have_each_once(make_pair, which):
    pair = make_pair()
    publish_frames(pair)
    late_subscriber(pair.operator)
    side = getattr(pair, which)
    side.kill()
    side.start()
    pair.server.wait_listening()
    pair.client.wait_linked()
    late_subscriber(pair.operator)
