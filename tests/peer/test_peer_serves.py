"""The peer serves: callers of the server's graph get its answers."""

from rcl_interfaces.srv import GetParameters
from std_srvs.srv import SetBool

from connect_peer import Peer
from peer_services import (
    GET_PARAMETERS,
    NO_VALUES,
    SET_BOOL,
    caller_again,
    flip,
    names_request,
    ready,
    result_of,
    set_bool_response,
)
from peer_world import TOKEN


def test_a_service_of_the_peer(world, peer, client):
    mine = peer()
    mine.until(lambda: mine.complete, "opening")
    channel = mine.serve("/p/flip", SET_BOOL, flip, ready=False)
    caller = client("/p/flip")
    mine.until(lambda: mine.served[channel].requests, "attach")
    # The server makes its mirror when it knows that it can be called, and not before.
    t1 = mine.ask_time()
    mine.until(lambda: any(reply["t1"] == t1 for reply in mine.times), "a time reply")
    assert not caller.service_is_ready()
    mine.become_ready(channel)
    ready(caller)
    answer = result_of(caller.call_async(SetBool.Request(data=False)))
    assert answer.success and answer.message.startswith("got ")
    assert not result_of(caller.call_async(SetBool.Request(data=True))).success
    calls = [call for call, _ in mine.served[channel].got]
    assert calls == sorted(set(calls)) and len(calls) == 2
    mine.withdraw(channel)
    ready(caller, False)


def test_parts_both_ways(world, peer, client):
    mine = peer()
    mine.until(lambda: mine.complete, "opening")
    text = "long " * 60_000
    asked = mine.serve("/p/names", GET_PARAMETERS, lambda request: NO_VALUES)
    told = mine.serve("/p/told", SET_BOOL, None)
    names, teller = client("/p/names", GetParameters), client("/p/told")
    ready(names)
    ready(teller)
    assert list(result_of(names.call_async(GetParameters.Request(names=[text]))).values) == []
    ((_, request),) = mine.served[asked].got
    assert request[4:].rstrip(b"\0") == names_request(text)[4:].rstrip(b"\0")
    futures = [teller.call_async(SetBool.Request(data=True)) for _ in range(2)]
    (first, _), (second, _) = mine.wait_requests(told, 2)
    # The other order; the second in small parts.
    mine.respond(told, second, set_bool_response(True, text), part=999)
    assert result_of(futures[1]).message == text
    mine.respond(told, first, set_bool_response(True, "short"))
    assert result_of(futures[0]).message == "short"


def test_a_call_that_is_refused_has_no_answer(world, peer, client):
    mine = peer()
    mine.until(lambda: mine.complete, "opening")
    channel = mine.serve("/p/refused", SET_BOOL, None)
    caller = client("/p/refused")
    ready(caller)
    futures = [caller.call_async(SetBool.Request(data=True)) for _ in range(2)]
    (first, _), (second, _) = mine.wait_requests(channel, 2)
    mine.refuse(channel, first, "word_of_tomorrow")
    mine.respond(channel, second, set_bool_response(True, "fine"))
    # A second answer, and one to a call that was never made, are dropped.
    for call in (first, second, 4_000_000_000):
        for frame in mine.frames_for(channel, set_bool_response(True, "wrong"), origin=call):
            mine.send_packet([frame])
    assert result_of(futures[1]).message == "fine"
    assert result_of(caller_again(mine, channel, caller)).message == "again"
    assert not futures[0].done()


def test_a_withdraw_is_answered(world, peer, client):
    """Answered by a withdraw of `requests`, however many requests crossed it. Repeated, since
    destroying a mirror while requests arrive is a difficult case for the middleware."""
    mine = peer()
    mine.until(lambda: mine.complete, "opening")
    caller = client("/p/ended")
    for epoch in range(1, 11):
        channel = mine.serve("/p/ended", SET_BOOL, None, epoch=epoch)
        ready(caller)
        requests = mine.served[channel].requests
        for _ in range(20):
            caller.call_async(SetBool.Request(data=True))
        mine.withdraw(channel)
        mine.until(lambda: requests in mine.withdrawn, "withdraw of the requests")
        assert not mine.expects(requests)
        ready(caller, False)
    # Offered again with another epoch, it is attached again.
    mine.serve("/p/ended", SET_BOOL, flip, epoch=11)
    ready(caller)
    assert result_of(caller.call_async(SetBool.Request(data=False))).success


def continued(peer, old, name):
    """The link goes on, and the service is offered again in the first round."""
    new = peer(
        session=old.welcome["session"],
        side=old.side,
        first_round=lambda new: new.serve(name, SET_BOOL, None, epoch=99, ready=False),
    )
    assert new.welcome["session"] == old.welcome["session"]
    return new, new.until(lambda: new.served, "offer") and min(new.served)


def test_the_same_epoch_goes_on_after_a_loss(world, peer, client):
    """The mirror stays, a request that had not arrived is sent again, an answer is waited for."""
    old = Peer(world.url, TOKEN)
    old.until(lambda: old.complete, "opening")
    channel = old.serve("/p/kept", SET_BOOL, None, epoch=99)
    caller = client("/p/kept")
    ready(caller)
    futures = [caller.call_async(SetBool.Request(data=True))]
    (first, _) = old.wait_requests(channel)[0]
    old.drop()
    futures.append(caller.call_async(SetBool.Request(data=False)))
    new, again = continued(peer, old, "/p/kept")
    served = new.served[again]
    served.seen, served.open = first, [first]
    new.become_ready(again)
    ((second, request),) = new.wait_requests(again)
    assert second > first and request[4:5] == b"\0"
    for call, text in ((second, "second"), (first, "first")):
        new.respond(again, call, set_bool_response(True, text))
    assert [result_of(future).message for future in futures] == ["first", "second"]
    assert len(served.got) == 1


def test_what_is_missing_in_attached_is_given_up(world, peer, client):
    old = Peer(world.url, TOKEN)
    old.until(lambda: old.complete, "opening")
    channel = old.serve("/p/lost", SET_BOOL, None, epoch=99)
    caller = client("/p/lost")
    ready(caller)
    future = caller.call_async(SetBool.Request(data=True))
    (first, _) = old.wait_requests(channel)[0]
    old.drop()
    new, again = continued(peer, old, "/p/lost")
    new.served[again].seen = first
    # A call that the server does not know is one whose answer is not wanted any more.
    new.served[again].open = [first + 500] if first > 500 else []
    new.become_ready(again)
    answer = caller_again(new, again, caller)
    assert result_of(answer).message == "again"
    for frame in new.frames_for(again, set_bool_response(True, "late"), origin=first):
        new.send_packet([frame])
    assert result_of(caller_again(new, again, caller)).message == "again"
    assert not future.done()
    assert [call for call, _ in new.served[again].got] == [first + 1, first + 2]
