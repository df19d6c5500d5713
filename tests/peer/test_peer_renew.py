"""A login is renewed on the open connection: docs/protocol.md sections 3 and 5."""

import contextlib
import time

import pytest
from websockets.exceptions import ConnectionClosed

from peer_world import TOKEN

RIGHT = TOKEN.decode()


def test_a_login_is_renewed_and_the_link_goes_on(world, served, peer):
    mine = peer()
    assert mine.renew(RIGHT)
    mine.until(lambda: mine.complete, "the first round")
    assert mine.closed is None


@pytest.mark.parametrize(
    "credential, method", [("wrong", "token"), ("", "token"), (RIGHT, "none")]
)
def test_a_refused_renewal_changes_nothing(world, served, peer, credential, method):
    mine = peer()
    assert not mine.renew(credential, method)
    time.sleep(0.5)
    assert mine.closed is None
    assert mine.renew(RIGHT)


def test_renewals_in_a_flood_end_the_connection(world, served, peer):
    mine = peer()
    for _ in range(16):
        mine.renew(RIGHT)
    mine.send_control(type="renew", method="token", credential=RIGHT)
    assert mine.wait_closed() == 4006


def test_a_renewal_before_the_last_was_answered(world, served, peer):
    mine = peer()
    with contextlib.suppress(ConnectionClosed):  # the server may end it before all are sent
        for _ in range(40):  # so many are too many, should each be answered before the next
            mine.send_control(type="renew", method="token", credential="x" * 3900)
    assert mine.wait_closed() in (4006, 4009)


def test_a_server_takes_no_answer_that_it_did_not_ask_for(world, served, peer):
    mine = peer()
    mine.send_control(type="renewed", accepted=True)
    assert mine.renew(RIGHT)
