"""The peer calls real services: requests, answers, and their outcome."""

import time

import pytest
from graph import until
from rcl_interfaces.srv import GetParameters
from std_msgs.msg import String
from std_srvs.srv import SetBool

from connect_packets import ZSTD, zstd_compress
from connect_peer import Peer
from peer_services import (
    FALSE,
    NO_VALUES,
    SET_BOOL,
    TRUE,
    answer_of,
    attached,
    in_graph,
    names_request,
)
from peer_world import TOKEN, part_of, without_zstd


def test_a_call(world, peer, service):
    real = service("/s/flip")
    mine = peer(services=["/s/**"])
    channel = mine.find("/s/flip")
    offer = mine.offers[channel]
    assert (offer["kind"], offer["type"], offer["priority"]) == ("service", SET_BOOL, "high")
    assert offer["epoch"] and offer.get("node") in ("/tester", "", None)
    flip = mine.attach(channel)
    assert flip.attached["type_hash"].startswith("RIHS01_")
    assert flip.attached.get("seen", 0) == 0 and flip.attached["calls"] == []
    assert answer_of(mine.call(flip, TRUE)) == (True, "number 1")
    assert answer_of(mine.call(flip, FALSE)) == (False, "number 2")
    assert answer_of(mine.call(flip, TRUE, call=1000)) == (True, "number 3")
    assert len(real.requests) == 3


def test_a_request_in_parts_between_those_of_another(world, peer, service):
    real = service("/s/names", GetParameters)
    mine = peer(services=["/s/**"])
    names = attached(mine, "/s/names")
    texts = [letter * 300_000 for letter in "ab"]
    first, second = (names_request(text) for text in texts)
    parts = list(mine.frames_for(names.requests, first, origin=1, part=7001))
    # An aborted request is not executed, but its number counts.
    begun = list(mine.frames_for(names.requests, second, origin=2, part=1000))[:5]
    abort = part_of(names.requests, b"", True)
    names.last = 2  # before the first answer can come: beyond it there are no calls
    mine.send_packet(parts[:20])
    mine.send_packet(parts[20:])
    mine.send_packet([*begun, abort])
    assert mine.call(names, second, part=65536) == NO_VALUES
    mine.until(lambda: 1 in names.answers, "the first answer")
    assert [list(request.names) for request in real.requests] == [[texts[0]], [texts[1]]]
    assert 2 not in names.answers and 2 not in names.refused


def test_a_large_answer_comes_in_parts(world, peer):
    node = world.graph.tester
    text = "long " * 60_000

    def answer(request, response):
        response.message = text
        return response

    real = node.create_service(SetBool, "/s/long", answer)
    mine = peer(services=["/s/**"])
    long = attached(mine, "/s/long")
    assert answer_of(mine.call(long, TRUE)) == (False, text)
    parts = [kind for number, kind, _ in mine.frames if number == long.channel]
    # Their sizes follow the link's rate; none has more than 256 KiB.
    assert parts[0] == "message" and parts[1:] == ["part"] * (len(parts) - 1) and len(parts) > 1
    in_graph(world, node.destroy_service, real)


@pytest.mark.parametrize("codec", ["none", pytest.param("zstd", marks=without_zstd)])
def test_compressed_calls(world, peer, codec):
    """Requests in any compression, answers as the server's rule says."""
    node = world.graph.tester
    got = []

    def answer(request, response):
        got.append(list(request.names))
        return response

    real = node.create_service(GetParameters, f"/s/{codec}/names", answer)
    text = "again and again, " * 5000

    def tell(request, response):
        response.message = text
        return response

    teller = node.create_service(SetBool, "/s/zstd/tell", tell)
    mine = peer(services=["/s/**"])
    names = attached(mine, f"/s/{codec}/names")
    request = names_request(text)
    body = {"codec": codec, "body": zstd_compress(request)} if codec != "none" else {}
    assert mine.call(names, request, **body) == NO_VALUES
    assert got == [[text]]
    if ZSTD:
        told = attached(mine, "/s/zstd/tell")
        assert answer_of(mine.call(told, TRUE))[1] == text
        assert sum(size for number, _, size in mine.frames if number == told.channel) < len(text)
    for each in (real, teller):
        in_graph(world, node.destroy_service, each)


def test_answers_come_in_any_order(world, peer, service):
    real = service("/s/held", hold=True)
    mine = peer(services=["/s/**"])
    held = attached(mine, "/s/held")
    for _ in range(3):
        mine.request(held, TRUE)
    until(lambda: len(real.held) == 3, "three requests")
    for index in (2, 0, 1):
        real.go_on(index)
        mine.until(lambda: index + 1 in held.answers, f"answer {index + 1}")
    assert len(real.requests) == 3


def test_no_call_is_executed_twice(world, peer, service):
    """Numbers that do not rise are dropped."""
    real = service("/s/twice")
    mine = peer(services=["/s/**"])
    twice = attached(mine, "/s/twice")
    mine.call(twice, TRUE, call=5)
    for number in (5, 4, 1):
        mine.request(twice, TRUE, call=number)
    assert answer_of(mine.call(twice, TRUE, call=6)) == (True, "number 2")
    assert len(real.requests) == 2 and set(twice.answers) == {5, 6}


def test_calls_wait_for_their_turn_and_a_forgotten_one_makes_room(world, peer, service):
    real = service("/s/slow/one", hold=True)  # calls_max: 1
    mine = peer(services=["/s/**"])
    one = attached(mine, "/s/slow/one")
    for _ in range(3):
        mine.request(one, TRUE)
    until(lambda: real.requests, "a request")
    # A call to another service, behind these, has been answered, and still there is one.
    service("/s/other")
    mine.call(attached(mine, "/s/other"), TRUE)
    assert len(real.requests) == 1
    mine.send_control(type="forget", channel=one.channel, calls=[1, 2, 77])
    until(lambda: len(real.requests) == 2, "the third call")
    real.go_on(1)
    mine.until(lambda: 3 in one.answers, "the third answer")
    assert set(one.answers) == {3} and not one.refused


def test_a_time_limit(world, peer, service):
    service("/s/timed/never", hold=True)  # call_timeout: 0.5
    mine = peer(services=["/s/**"])
    never = attached(mine, "/s/timed/never")
    begin = time.monotonic()
    call = mine.request(never, TRUE)
    mine.until(lambda: call in never.refused, "refuse")
    assert never.refused == {call: "timeout"} and time.monotonic() - begin >= 0.4


def test_a_request_that_is_none(world, peer, service):
    real = service("/s/strict", GetParameters)
    mine = peer(services=["/s/**"])
    strict = attached(mine, "/s/strict")
    for data in (b"", b"\0\1\0\0", b"\0\1\0\0\xff\xff\xff\xff", b"no cdr at all"):
        call = mine.request(strict, data)
        mine.until(lambda: call in strict.refused, f"refuse of {data!r}")
        assert strict.refused[call] == "failed"
    assert mine.call(strict, names_request("a")) == NO_VALUES
    assert len(real.requests) == 1


def test_an_answer_beyond_the_limit_is_refused(world, peer):
    node = world.graph.tester

    def answer(request, response):
        response.message = "x" * (5000 if request.data else 10)
        return response

    real = node.create_service(SetBool, "/s/sized", answer)
    mine = peer(services=["/s/**"], message_bytes_max=1000)
    sized = attached(mine, "/s/sized")
    call = mine.request(sized, TRUE)
    mine.until(lambda: call in sized.refused, "refuse")
    assert sized.refused[call] == "limit"
    assert answer_of(mine.call(sized, FALSE)) == (False, "x" * 10)
    in_graph(world, node.destroy_service, real)


def test_a_topic_beyond_the_limit_is_not_sent(world, peer):
    publisher = world.graph.publisher(String, "/t/sized")
    mine = peer(message_bytes_max=1000)
    channel = mine.find("/t/sized")
    mine.demand(channel)

    def small_arrives():
        publisher.publish(String(data="x" * 2000))
        publisher.publish(String(data="small"))
        time.sleep(0.02)
        return mine.samples.get(channel)

    until(small_arrives, "a small sample")
    assert all(len(sample.data) < 1000 for sample in mine.samples[channel])
    world.graph.tester.destroy_publisher(publisher)


def test_the_server_of_a_service_goes_and_comes(world, peer, service):
    first = service("/s/restart")
    mine = peer(services=["/s/**"])
    channel = mine.find("/s/restart")
    restart = mine.attach(channel)
    epoch = mine.offers[channel]["epoch"]
    mine.call(restart, TRUE)
    first.close()
    mine.until(lambda: channel in mine.withdrawn, "withdraw")
    assert mine.ended == {restart.requests}
    second = service("/s/restart")
    again = mine.find("/s/restart")
    assert again > channel and mine.offers[again]["epoch"] != epoch
    restart = mine.attach(again)
    assert restart.attached.get("seen", 0) == 0
    assert answer_of(mine.call(restart, TRUE)) == (True, "number 1")
    assert len(second.requests) == 1


class Slow(Peer):
    """Answers a withdraw only when it is told to."""

    def _service_withdrawn(self, number):
        self.slow = self.attachments.pop(number, None)


def test_requests_that_cross_the_withdraw_are_accepted(world, service):
    real = service("/s/crossing")
    mine = Slow(world.url, TOKEN, services=["/s/**"])
    crossing = attached(mine, "/s/crossing")
    channel = crossing.channel
    real.close()
    mine.until(lambda: channel in mine.withdrawn, "withdraw")
    mine.request(crossing, TRUE)
    big = list(mine.frames_for(crossing.requests, TRUE * 1000, origin=9, part=100))
    mine.send_packet(big[:3])
    mine.send_control(type="forget", channel=channel, calls=[1])
    mine.send_control(type="attach", channel=channel, requests=mine.next_number())
    mine.send_control(type="withdraw", channels=[crossing.requests, mine.last_number])
    mine.ask_time()
    mine.until(lambda: mine.times, "a time reply")
    # From now on it is not a channel.
    mine.request(crossing, TRUE)
    assert mine.wait_closed() == 4010


def test_an_importer_that_detaches_may_attach_again(world, peer, service):
    real = service("/s/again", hold=True)
    mine = peer(services=["/s/**"])
    first = attached(mine, "/s/again")
    mine.request(first, TRUE)
    until(lambda: real.held, "a request")
    mine.detach(first)
    second = mine.attach(first.channel)
    assert second.requests != first.requests and second.attached["calls"] == []
    assert second.attached["seen"] == 1  # the same epoch: the numbers go on
    call = mine.request(second, FALSE)
    until(lambda: len(real.held) == 2, "another request")
    for index in range(2):
        real.go_on(index)
    mine.until(lambda: call in second.answers, "answer")
    assert call == 2 and set(second.answers) == {2}


def test_calls_outlive_a_connection(world, peer, service):
    """One is answered while there is no connection, one afterwards, and none is executed twice."""
    real = service("/s/kept", hold=True)
    side = None
    old = Peer(world.url, TOKEN, services=["/s/**"])
    kept = attached(old, "/s/kept")
    epoch = old.offers[kept.channel]["epoch"]
    for _ in range(2):
        old.request(kept, TRUE)
    until(lambda: len(real.held) == 2, "two requests")
    side = old.side
    old.drop()
    real.go_on(0)
    new = peer(services=["/s/**"], session=old.welcome["session"], side=side)
    assert new.welcome["session"] == old.welcome["session"]
    channel = new.find("/s/kept")
    assert new.offers[channel]["epoch"] == epoch
    kept = new.attach(channel)
    assert kept.attached["seen"] == 2
    assert set(kept.attached["calls"]) in ({1, 2}, {2})  # an answer is there or will come
    # Sent again, as if this side did not know that they had arrived.
    for call in (1, 2):
        new.request(kept, TRUE, call=call)
    new.until(lambda: 1 in kept.answers, "the answer that was kept")
    real.go_on(1)
    new.until(lambda: 2 in kept.answers, "the answer that was waited for")
    third = new.request(kept, TRUE)
    until(lambda: len(real.held) == 3, "a third request")
    real.go_on(2)
    new.until(lambda: third in kept.answers, "the third answer")
    assert len(real.requests) == 3
