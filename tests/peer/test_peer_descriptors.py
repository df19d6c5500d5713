"""A withdrawal while somebody holds all descriptors that connections may have."""

import resource

import pytest
from websockets.exceptions import WebSocketException

from connect_peer import Peer
from graph import until
from peer_world import World, token_file, token_of

DESCRIPTORS = 160
GREEDY, OTHER = "greedy", "other"


@pytest.fixture
def world(tmp_path):
    made = World(tmp_path, (GREEDY, OTHER))
    yield made
    made.close()


def all_links(url):
    """As many as there are places."""
    links = []
    try:
        while len(links) < DESCRIPTORS:
            links.append(Peer(url, token_of(GREEDY)))
    except (OSError, EOFError, WebSocketException) as refused:
        print(f"{len(links)} links, then {refused!r}")
    return links


def test_a_withdrawal_takes_effect_when_connections_hold_all_descriptors(world, tmp_path):
    # The start would refuse so few.
    resource.prlimit(world.server.pid, resource.RLIMIT_NOFILE, (DESCRIPTORS, DESCRIPTORS))
    links = all_links(world.url)
    assert 20 < len(links) < DESCRIPTORS
    world.server.wait_for("cannot accept connections now")
    token_file(tmp_path, {OTHER: token_of(OTHER)})
    until(lambda: all(link.closed for link in links), "no link stays", timeout=4.0)
    assert "cannot be read" not in world.server.text()
    Peer(world.url, token_of(OTHER)).close()
