"""`ask` and `answer`: what the server says of what it does not offer, and what it asks itself."""

import contextlib
import time

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool
from websockets.exceptions import ConnectionClosed

from connect_records import ILLEGAL, TOO_LARGE
from peer_world import STRING, TWIST

SET_BOOL = "std_srvs/srv/SetBool"


def test_rules_are_asked_before_the_graph(world, peer):
    world.graph.publisher(String, "/t/here")
    world.graph.publisher(String, "/private/here")
    mine = peer()
    mine.find("/t/here")
    asked = [
        ("topic", "/t/here", STRING),
        ("topic", "/t/here", TWIST),
        ("topic", "/t/nowhere", STRING),
        ("topic", "/private/here", STRING),
        ("topic", "/private/nowhere", STRING),
        ("service", "/s/nowhere", SET_BOOL),
        ("service", "/private/nowhere", SET_BOOL),
        ("topic", "/t//odd", STRING),
        ("topic", "/t/a/_action/status", STRING),
        ("stream", "/t/here", STRING),
    ]
    assert mine.codes_for(*asked) == [
        "there",
        "other_type",
        "absent",
        "not_permitted",
        "not_permitted",
        "absent",
        "not_permitted",
        "not_permitted",
        "not_permitted",
        "unsupported",
    ]


def test_what_a_node_wants_is_asked_for(world, peer):
    node = world.graph.node("waiting")
    world.graph.collector(String, "/o/wanted", node=node)
    world.graph.collector(String, "/o/_hidden", node=node)
    world.graph.collector(String, "/t/here_too", node=node)
    world.graph.publisher(String, "/t/here_too")
    node.create_client(SetBool, "/p/wanted")
    mine = peer()
    mine.answer_with = "not_permitted"
    mine.until(lambda: len(mine.asked_for) >= 2, "a question")
    wanted = {("topic", "/o/wanted", STRING), ("service", "/p/wanted", SET_BOOL)}
    assert wanted <= set(mine.asked_for)
    assert not [name for _, name, _ in mine.asked_for if name in ("/o/_hidden", "/t/here_too")]


def test_questions_without_end_end_the_link(world, peer):
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    with contextlib.suppress(ConnectionClosed):  # before the last of them, perhaps
        for _ in range(30):
            mine.ask(("topic", "/t/nowhere", STRING))
    assert mine.wait_closed() == TOO_LARGE


@pytest.mark.parametrize("count", [0, 2])
def test_an_answer_to_nothing_ends_the_link(world, peer, count):
    mine = peer()
    mine.until(lambda: mine.complete, "the first round")
    time.sleep(0.1)
    mine.send_control(type="answer", codes=["absent"] * count)
    assert mine.wait_closed() == ILLEGAL
