"""Listeners at the other side: what the server sends, and what it does with what it receives."""

import time

import pytest
from graph import until
from std_msgs.msg import String

from peer_world import STRING, string_of


def subscribed(world, topic):
    """The server's own subscription of a topic."""
    return [s for s in world.graph.subscriptions(topic) if s.node_name == "connect_server"]


def test_the_server_tells_who_listens(world, peer):
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    node = world.graph.node("base")
    world.graph.collector(String, "/o/told", node=node)
    world.graph.collector(String, "/hidden/untold", node=node)
    other = world.graph.collector(String, "/o/told")
    mine.until(lambda: mine.listeners_of("/o/told"), "a listener")
    (told,) = mine.listeners_of("/o/told")
    assert told["type"] == STRING
    assert not mine.listeners_of("/hidden/untold") and not mine.listeners_of("/t/tick")
    world.graph.remove(node)
    time.sleep(1)
    assert mine.listeners_of("/o/told") == [told], "there is another one"
    other.close()
    mine.until(lambda: not mine.listeners_of("/o/told"), "nobody who listens")


def test_a_subscription_stands_before_the_first_publisher(world, peer):
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    mine.listen(1, "/t/awaited", STRING)
    until(lambda: subscribed(world, "/t/awaited"), "the server's subscription")
    publisher = world.graph.publisher(String, "/t/awaited")
    until(publisher.get_subscription_count, "a subscription")
    publisher.publish(String(data="first"))
    channel = mine.find("/t/awaited")
    time.sleep(0.5)  # as if the path were long
    mine.demand(channel)
    (sample,) = mine.wait_samples(channel)
    assert string_of(sample.data) == "first"
    world.graph.tester.destroy_publisher(publisher)
    mine.send_control(type="listeners", added=[], removed=[1])
    until(lambda: not subscribed(world, "/t/awaited"), "no subscription")


@pytest.mark.parametrize(
    "name, kind",
    [
        ("/private", STRING),  # no rule exports it
        ("/_connect_bridge/claims", "rcl_interfaces/msg/Log"),
        ("/t/b/_action/feedback", "example_interfaces/action/Fibonacci_FeedbackMessage"),
        ("t/relative", STRING),
        ("/t//twice", STRING),
        ("/t/odd", "no type"),
        ("/t/a_service", "std_srvs/srv/SetBool"),
    ],
)
def test_without_a_right_it_is_ignored(world, served, peer, name, kind):
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    mine.listen(1, name, kind)
    mine.listen(2, "/t/after", STRING)
    until(lambda: subscribed(world, "/t/after"), "what it may have")
    names = [topic for topic, _ in world.graph.tester.get_topic_names_and_types()]
    assert name == "/_connect_bridge/claims" or name not in names
    assert mine.closed is None


def test_it_goes_with_the_connection(world, peer):
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    mine.listen(1, "/t/for_a_moment", STRING)
    until(lambda: subscribed(world, "/t/for_a_moment"), "a subscription")
    mine.drop()
    until(lambda: not subscribed(world, "/t/for_a_moment"), "no subscription")


def test_a_number_in_use_is_refused(world, served, peer):
    mine = peer()
    mine.listen(1, "/t/a", STRING)
    mine.listen(1, "/t/b", STRING, removed=[1])  # in its place
    mine.listen(1, "/t/a", STRING)
    assert mine.wait_closed() == 4009


def test_too_many_are_refused(world, served, peer):
    mine = peer()
    for first in range(1, 1025, 64):
        added = [
            {"listener": n, "name": "/t/crowd", "type": STRING}
            for n in range(first, first + 64)
        ]
        mine.send_control(type="listeners", added=added, removed=[])
    until(lambda: subscribed(world, "/t/crowd"), "one subscription for all")
    assert len(world.graph.subscriptions("/t/crowd")) == 1 and mine.closed is None
    mine.listen(1025, "/t/crowd", STRING)
    assert mine.wait_closed() == 4006


def test_of_a_type_that_the_topic_does_not_have(world, served, peer):
    """The publisher's own type is served."""
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    mine.listen(1, "/t/contested", "std_msgs/msg/Int32")
    until(lambda: subscribed(world, "/t/contested"), "the wrong subscription")
    publisher = world.graph.publisher(String, "/t/contested")
    channel = mine.find("/t/contested")
    mine.demand(channel)
    until(
        lambda: [s.topic_type for s in subscribed(world, "/t/contested")] == [STRING],
        "a subscription of the right type",
    )
    until(publisher.get_subscription_count, "a subscription")
    publisher.publish(String(data="right"))
    (sample,) = mine.wait_samples(channel)
    assert string_of(sample.data) == "right"
