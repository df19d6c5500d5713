"""Fixtures: the real server, and peers that dial it."""

import contextlib
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import pytest  # noqa: E402

from std_srvs.srv import SetBool  # noqa: E402

from connect_peer import Peer  # noqa: E402
from peer_services import Service, in_graph  # noqa: E402
from peer_world import TOKEN, Ticker, World  # noqa: E402


@pytest.fixture(scope="module")
def world(request, tmp_path_factory):
    """For all tests of a file; SERVER of the file has parameters of the server."""
    made = World(tmp_path_factory.mktemp("world"), **getattr(request.module, "SERVER", {}))
    yield made
    made.close()


@pytest.fixture
def peer(world):
    """peer(...): logged in; closed at the end."""
    with contextlib.ExitStack() as stack:

        def make(**options):
            made = Peer(world.url, TOKEN, **options)
            stack.callback(made.close)
            return made

        yield make


@pytest.fixture(scope="module")
def ticker(world):
    made = Ticker(world)
    yield made
    made.stop()


@pytest.fixture
def served(ticker):
    yield
    ticker.goes_on()


@pytest.fixture
def service(world):
    made = []

    def make(*arguments, **options):
        made.append(Service(world, *arguments, **options))
        return made[-1]

    yield make
    for each in made:
        each.close()


@pytest.fixture
def client(world):
    made = []

    def make(name, kind=SetBool):
        made.append(world.graph.tester.create_client(kind, name))
        return made[-1]

    yield make
    for each in made:
        in_graph(world, world.graph.tester.destroy_client, each)
