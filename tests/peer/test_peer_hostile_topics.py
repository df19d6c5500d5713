"""What a peer may try with the topics that it offers."""

import itertools
import time

import pytest
import rclpy
from graph import here, until
from rcl_interfaces.msg import ParameterEvent
from rclpy.qos import HistoryPolicy, QoSProfile
from std_msgs.msg import String

from connect_control import PARAMETER_EVENTS
from connect_peer import Peer
from peer_world import STRING, TOKEN, cdr_string, event_of, message

DEAD_AFTER = 60.0  # nothing here is about that, and a machine may be busy
SERVER = {
    "dead_after": DEAD_AFTER,
    "rules": ["aged", "all"],
    "rule": {
        "aged": {"import_topics": ["/o/aged"], "max_age": 5.0},
        "all": {"import_topics": ["/o/**"], "import_parameters": ["/far", "/tester"]},
    },
}


@pytest.fixture
def mine(peer):
    made = peer(dead_after=DEAD_AFTER)
    made.until(lambda: made.complete, "the first round")
    return made


def dropped(world, topic, reason):
    return world.server.topic(topic).get("dropped", {}).get(reason, 0)


def origin(mine, number=1, node="/python", **qos):
    gid = (mine.side + number.to_bytes(4, "big")).ljust(24, b"\0").hex()
    return {"origin": number, "gid": gid, "node": node, "qos": qos}


def offered(mine, name, kind, **qos):
    """The channel of a topic with an origin of this quality of service, once it is demanded."""
    mine.offer(name, kind, origins=[origin(mine, **qos)])
    return mine.channel_of(name)


def answers(mine):
    t1 = mine.ask_time()
    mine.until(lambda: any(reply["t1"] == t1 for reply in mine.times), "a time reply", timeout=60)


def arrived(mine, channel, sample, collector):
    """Publishes until something has come through."""

    def go():
        mine.publish(channel, sample, part=300_000)
        time.sleep(0.02)
        return collector.messages

    until(go, f"a message on {collector.topic}")


def test_events_are_of_the_node_that_was_opened(world, mine):
    """Every node acts upon an event with its name, so that name is what the right is about."""
    collector = world.graph.collector(ParameterEvent, PARAMETER_EVENTS)
    both = [origin(mine, 1, "/far"), origin(mine, 2, "/tester")]
    mine.offer(PARAMETER_EVENTS, "rcl_interfaces/msg/ParameterEvent", origins=both)
    channel = mine.channel_of(PARAMETER_EVENTS)
    arrived(mine, channel, event_of("/far"), collector)
    time.sleep(1)  # a graph knows an endpoint before the name of its node
    mine.publish(channel, event_of("/tester", 2))
    mine.publish(channel, event_of("/tester", 3), origin=2)  # it lives there
    mine.publish(channel, event_of("/far", 4, ">"))  # nodes read this, too
    mine.publish(channel, event_of("/far", 5))
    collector.wait_for(lambda event: event.stamp.sec == 5)
    until(lambda: dropped(world, PARAMETER_EVENTS, "not_permitted") == 3, "three that are counted")
    assert {event.stamp.sec for event in collector.messages if event.stamp.sec < 10} == {1, 5}
    collector.close()


def test_a_subscriber_that_hangs_holds_nobody_up(world, mine):
    """It keeps all and takes nothing: what a publisher that keeps all, too, says beyond 5000 would
    wait for it, 0.1 s each."""
    hung = rclpy.create_node("hung", context=world.graph.context, enable_rosout=False)
    keep_all = QoSProfile(depth=10, history=HistoryPolicy.KEEP_ALL)
    subscription = hung.create_subscription(String, "/o/hung", print, keep_all)
    channel = offered(mine, "/o/hung", STRING, reliability="reliable", history="keep_all")
    until(lambda: subscription.get_publisher_count() == 1, "the mirror's publisher")

    def published(count):
        until(
            lambda: world.server.topic("/o/hung").get("messages") == count,
            lambda: f"a status of {count} messages, but {world.server.topic('/o/hung')}",
        )

    mine.send_packet([message(channel, 1, cdr_string(""))])
    published(1)  # until then more would wait for the subscribers of the new mirror
    for begin in range(2, 7002, 1000):
        mine.send_packet([message(channel, n, cdr_string("")) for n in range(begin, begin + 1000)])
    answers(mine)
    published(7001)
    hung.destroy_node()


class Shifted(Peer):
    """Its clock is wrong by `shift` nanoseconds, and what it says of the time with it."""

    shift = 0

    def send_packet(self, frames):
        for frame in frames:
            if frame["type"] == "time_reply":
                frame["t2"] += self.shift
                frame["t3"] += self.shift
        super().send_packet(frames)


def test_a_clock_that_is_set_does_not_end_a_topic_with_an_age(world):
    """Of an old offset of the clocks all messages are too old; a new one is found soon."""
    collector = world.graph.collector(String, "/o/aged")
    mine = Shifted(world.url, TOKEN, dead_after=DEAD_AFTER)
    mine.until(lambda: mine.complete, "the first round")
    channel = offered(mine, "/o/aged", STRING)
    numbers = itertools.count()

    def arrives(before):
        mine.publish(channel, cdr_string(str(next(numbers))), stamp=time.time_ns() + mine.shift)
        time.sleep(0.05)
        return len(collector.messages) > before

    until(lambda: arrives(0), "a message")
    mine.until(lambda: len(mine.asked_at) > 2, "requests for the time")
    soon = here(8)  # now: the offset of before does not last
    mine.shift = -3600 * 10**9
    before = len(collector.messages)
    until(lambda: arrives(before), "a message by the new clock", timeout=soon)
    until(lambda: dropped(world, "/o/aged", "max_age"), "one that was too old by the old offset")
    mine.close()
    collector.close()
