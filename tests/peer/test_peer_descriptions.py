"""What types are made of: what the server tells, and what it does with what it is told."""

import time

import pytest
from graph import until
from std_msgs.msg import String

from connect_types import FLOAT64, INT32, STRING, description_text, hash_of
from peer_world import STRING as STRING_TYPE

POINT = description_text("made_up/msg/Point", [("x", FLOAT64), ("label", STRING)])


@pytest.fixture
def mine(peer):
    made = peer()
    made.until(lambda: made.complete, "the first round")
    made.known[hash_of(POINT)] = POINT
    return made


def offer_point(mine, name="/o/point", text=POINT):
    return mine.offer(name, "made_up/msg/Point", type_hash=hash_of(text))


def stays(mine):
    time.sleep(0.5)
    assert mine.closed is None


def test_the_server_describes_what_it_offers(world, served, mine):
    world.graph.publisher(String, "/t/described")
    channel = mine.find("/t/described")
    (text,) = mine.describe(channel)
    assert text == description_text(STRING_TYPE, [("data", STRING)])
    assert hash_of(text) == mine.offers[channel]["type_hash"]
    assert mine.describe(channel) == [text]  # it may be asked again


def test_the_server_asks_once_about_a_type_that_it_has_not(world, served, mine):
    channels = [offer_point(mine, f"/o/point{number}") for number in range(3)]
    mine.until(lambda: mine.asked, "a question")
    stays(mine)
    assert len(mine.asked) == 1 and mine.asked[0] in channels


def test_what_is_installed_is_not_asked_about(world, served, mine):
    kind = mine.offers[mine.find("/t/tick")]
    mine.offer("/o/known", kind["type"], type_hash=kind["type_hash"])
    world.graph.wait_publishers("/o/known", 1)
    stays(mine)
    assert not mine.asked


def test_another_definition_is_told_in_one_line(world, served, mine):
    text = description_text(STRING_TYPE, [("data", STRING), ("number", INT32)])
    mine.known[hash_of(text)] = text
    lines = lambda: world.server.text().count("only in the peer's definition")  # noqa: E731
    before = lines()
    for number in range(3):
        channel = mine.offer(f"/o/other{number}", STRING_TYPE, type_hash=hash_of(text))
        mine.until(lambda c=channel: c in mine.declined, "decline")
        assert mine.declined[channel][0] == "type_mismatch"
    until(lambda: lines() == before + 1, "the line")
    stays(mine)
    assert lines() == before + 1
    assert "the field 'number' (int32) is only in the peer's definition" in world.server.text()


@pytest.mark.parametrize(
    "known",
    [
        None,
        POINT.replace('"x"', '"x y"'),  # no name of a field
        POINT.replace(f'"type_id": {FLOAT64}', '"type_id": 40'),
        POINT.replace("made_up", "other"),
        "{}",
    ],
    ids=["unknown", "name", "kind", "another type", "no description"],
)
def test_what_cannot_be_used_is_not_known(world, served, mine, known):
    text = known or POINT
    mine.known = {hash_of(text): known}
    offer_point(mine, text=text)
    mine.until(lambda: mine.asked, "a question")
    stays(mine)


@pytest.mark.parametrize(
    "told, code",
    [(POINT + " ", 4002), ("x", 4002), ("x" * 262_145, 4006)],
    ids=["a blank more", "no JSON", "too long"],
)
def test_another_text_than_the_hash_has_is_refused(world, served, mine, told, code):
    mine.known = {hash_of(POINT): told}
    offer_point(mine)
    assert mine.wait_closed() == code


def test_what_was_not_asked_for_is_refused(world, served, mine):
    kind = mine.offers[mine.find("/t/tick")]
    channel = mine.offer("/o/unasked", kind["type"], type_hash=kind["type_hash"])
    mine.send_control(type="description", channel=channel)
    assert mine.wait_closed() == 4009


def test_an_answer_twice_is_refused(world, served, mine):
    channel = offer_point(mine)
    mine.until(lambda: mine.asked, "a question")
    mine.send_control(type="description", channel=channel, text=POINT)
    assert mine.wait_closed() == 4009


@pytest.mark.parametrize(
    "ask, code",
    [
        (lambda there: [4_000_000_000], 4010),
        (lambda there: [there, there], 4009),
        (lambda there: [there] * 9, 4006),
    ],
    ids=["what was never offered", "twice at a time", "too many at a time"],
)
def test_questions_that_are_refused(world, served, mine, ask, code):
    mine.send_control(type="describe", channels=ask(mine.find("/t/tick")))
    assert mine.wait_closed() == code


def test_a_flood_of_questions_holds_nobody_up(world, served, mine):
    """Each is answered; beyond the pace, that it is not known."""
    channel = mine.find("/t/tick")
    told = [mine.describe(channel)[0] for _ in range(300)]
    assert all(text == told[0] for text in told if text)
    stays(mine)


def test_a_peer_that_does_not_answer_costs_nothing_but_the_check(world, served, peer):
    mute = peer()
    mute.until(lambda: mute.complete, "the first round")
    mute._on_describe = lambda message: mute.asked.extend(message["channels"])
    for number in range(30):
        text = description_text(f"made_up/msg/Thing{number}", [("x", FLOAT64)])
        mute.offer(f"/o/mute{number}", f"made_up/msg/Thing{number}", type_hash=hash_of(text))
    world.graph.wait_publishers("/o/mute29", 1)
    stays(mute)
    assert len(mute.asked) == 8
