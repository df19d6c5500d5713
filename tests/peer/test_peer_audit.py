"""The audit log beside peers that fill it: what matters is recorded, or refused."""

import json

import pytest
from graph import until

from connect_peer import Peer
from peer_services import TRUE, Service, answer_of, attached
from peer_world import STRING, World, token_of

JUNK = 4096  # what may be offered at a time


@pytest.fixture
def audited(tmp_path):
    made = World(
        tmp_path,
        identities=("anna", "flood"),
        audit={"file": str(tmp_path / "audit.jsonl"), "required": True},
    )
    made.audit = tmp_path / "audit.jsonl"
    yield made
    made.close()


def found(world, **what):
    *whole, _ = world.audit.read_text(encoding="ascii").split("\n")  # a write may be under way
    lines = [json.loads(line) for line in whole]
    return [line for line in lines if all(line.get(k) == v for k, v in what.items())]


def offer_junk(peer, count, withdraw=False):
    """Topics that no rule allows: a line for each."""
    channels = [
        {"channel": peer.next_number(), "kind": "topic", "type": STRING, "origins": []}
        for _ in range(count)
    ]
    for channel in channels:
        channel["name"] = f"/junk/t{channel['channel']}"
    for i in range(0, count, 256):
        peer.send_control(type="offer", channels=channels[i : i + 256])
    if withdraw:
        peer.send_control(type="withdraw", channels=[c["channel"] for c in channels])
    return [c["channel"] for c in channels]


def test_junk_between_calls_hides_none_of_them(audited):
    real = Service(audited, "/s/arm")
    peer = Peer(audited.url, token_of("anna"), services=["/s/**"])
    arm = attached(peer, "/s/arm")
    for _ in range(3):
        offer_junk(peer, 2000, withdraw=True)
    for _ in range(50):
        offer_junk(peer, 40, withdraw=True)
        answer_of(peer.call(arm, TRUE))
    assert len(real.requests) == 50
    until(lambda: len(found(audited, event="call", name="/s/arm")) == 50, "50 calls", 5)
    until(lambda: found(audited, event="left_out", identity="anna", of="channels"), "the rest", 15)
    assert not found(audited, event="left_out", of="calls")
    peer.close()
    real.close()


def test_who_floods_it_displaces_nobody_else(audited):
    flood = [Peer(audited.url, token_of("flood")) for _ in range(10)]
    for peer in flood:
        offer_junk(peer, JUNK)
    anna = Peer(audited.url, token_of("anna"))
    until(lambda: found(audited, event="login", identity="anna"), "the login", 5)
    until(lambda: found(audited, event="left_out", identity="flood", of="channels"), "flood", 15)
    assert len(found(audited, event="login", identity="flood")) == 10
    assert "the audit log" not in audited.server.text(), "the disk is not to blame"
    for peer in [*flood, anna]:
        peer.close()


def test_a_call_that_cannot_be_recorded_is_refused(audited):
    real = Service(audited, "/s/arm")
    peer = Peer(audited.url, token_of("anna"), services=["/s/**"])
    arm = attached(peer, "/s/arm")
    answer_of(peer.call(arm, TRUE))

    audited.audit.rename(audited.audit.with_suffix(".1"))
    audited.audit.mkdir()
    Peer(audited.url, token_of("flood")).close()  # causes the next line
    audited.server.wait_for("the audit log cannot be written, its lines wait: .*Is a directory")
    number = peer.request(arm, TRUE)
    peer.until(lambda: number in arm.refused, "the refusal")
    assert len(real.requests) == 1

    audited.audit.rmdir()
    audited.server.wait_for("the audit log can be written again")
    answer_of(peer.call(arm, TRUE))
    until(lambda: len(found(audited, event="call")) == 1, "the call", 5)
    peer.close()
    real.close()
