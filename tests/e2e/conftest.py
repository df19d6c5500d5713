"""Fixtures: the real server and client, each between rclpy nodes of its own domain id."""

import contextlib
import os
import pathlib
import subprocess
import sys

sys.dont_write_bytecode = True
sys.path[:0] = [
    str(pathlib.Path(__file__).resolve().parents[2] / "tools"),
    str(pathlib.Path(__file__).resolve().parent),
]
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"  # of the contexts in this process

import pytest  # noqa: E402

from calls import servers_graph  # noqa: E402
from graph import Graph, connect  # noqa: E402
from lacking import PACKAGES, take_away  # noqa: E402
from relay import Relay  # noqa: E402
from harness.domains import free_port, release_domains, take_domains  # noqa: E402
from harness.programs import Bridge, Side, build_dir  # noqa: E402

# /t/** goes from robot to operator, /o/** the other way.
OPEN = {
    "rules": ["all"],
    "rule": {
        "all": {
            "export_topics": ["/t/**", "/tf", "/tf_static", "/clock"],
            "import_topics": ["/o/**", "/cmd_vel"],
        }
    },
}
_live = []  # everything with a log to print when a test fails


def pytest_configure(config):
    for name in ("server", "client"):
        if not (build_dir() / name).exists():
            pytest.exit(f"{build_dir() / name} is not built", returncode=3)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    outcome = yield
    report = outcome.get_result()
    if report.failed:
        for program in _live:
            with contextlib.suppress(OSError):
                log = program.text(whole=True)
                report.sections.append((f"log of {program.name}", log[-12000:]))


class Pair:
    """A robot's graph, an operator's graph and the bridge between them."""

    def __init__(self, folder, server=None, client=None, start=True, domains=None, **more):
        self._taken = [] if domains else take_domains(2)
        self.domains = domains or self._taken
        self.robot = self.operator = self.bridge = None
        self.expects_failure = False
        try:
            self.robot = Graph(self.domains[0])
            self.operator = Graph(self.domains[1])
            self.bridge = Bridge(
                *self.domains, free_port(), server or OPEN, client or {}, folder=folder, **more
            )
            for side in self.bridge.sides if os.environ.get("CONNECT_LACKING") else ():
                take_away(PACKAGES, side)
            _live.extend(self.bridge.sides)
            if start:
                self.bridge.start()
        except BaseException:
            self.close()
            raise

    @property
    def server(self):
        return self.bridge.server

    @property
    def client(self):
        return self.bridge.client

    def opened(self, kind, topic, message, qos=10, backward=False):
        """A publisher on one side and a collector on the other, after the first message has
        crossed."""
        near, far = (self.operator, self.robot) if backward else (self.robot, self.operator)
        publisher, collector = near.publisher(kind, topic, qos), far.collector(kind, topic, qos)
        connect(publisher, collector, message)
        return publisher, collector

    def close(self):
        problems = self.bridge.stop() if self.bridge else []
        for graph in (self.robot, self.operator):
            if graph:
                graph.close()
        release_domains(self._taken)
        for side in self.bridge.sides if self.bridge else ():
            _live.remove(side)
        assert not problems, "\n".join(problems)


@pytest.fixture
def make_pair(tmp_path):
    """Makes pairs with parameters of their own: make_pair(server={...}, client={...})."""
    with contextlib.ExitStack() as stack:

        def make(**options):
            folder = tmp_path / f"pair{len(list(tmp_path.iterdir()))}"
            folder.mkdir()
            pair = Pair(folder, **options)
            stack.callback(pair.close)
            return pair

        yield make


@pytest.fixture
def relayed(make_pair):
    """relayed(delay=0.0, **options): a pair with a relay between its sides, and the relay."""
    with contextlib.ExitStack() as stack:

        def make(delay=0.0, **options):
            pair = make_pair(start=False, **options)
            relay = Relay(pair.bridge.port, delay)
            stack.callback(relay.close)
            url = f"ws://127.0.0.1:{relay.port}"
            pair.client.set_parameters({**pair.client.parameters, "url": url})
            pair.bridge.start()
            return pair, relay

        yield make


@pytest.fixture(scope="module")
def pair(request, tmp_path_factory):
    """One pair for all tests of a file, which use topics of their own; SERVER and CLIENT of the
    file have the parameters of each side."""
    server, client = (getattr(request.module, name, None) for name in ("SERVER", "CLIENT"))
    made = Pair(tmp_path_factory.mktemp("pair"), server=server, client=client)
    yield made
    made.close()


@pytest.fixture(scope="module")
def robot(pair):
    """Another node in the robot's graph, for slow servers."""
    graph = servers_graph(pair, 16)
    yield graph
    graph.close()


@pytest.fixture
def make_side(tmp_path):
    """Makes a single server or client: make_side(role, domain, parameters, name=...)."""
    with contextlib.ExitStack() as stack:

        def make(role, domain, parameters, **options):
            side = Side(role, domain, parameters, tmp_path, **options)
            _live.append(side)
            stack.callback(_live.remove, side)
            stack.callback(side.kill)
            return side

        yield make


@pytest.fixture
def make_graph():
    with contextlib.ExitStack() as stack:

        def make(domain):
            graph = Graph(domain)
            stack.callback(graph.close)
            return graph

        yield make


@pytest.fixture
def domains():
    """domains(n): that many free domain ids."""
    taken = []

    def take(count):
        taken.extend(take_domains(count))
        return taken[-count:]

    yield take
    release_domains(taken)


@pytest.fixture
def topic(request):
    """A topic of this test's own, from robot to operator."""
    word = "".join(c if c.isalnum() else "_" for c in request.node.name)
    return f"/t/{word}"


@pytest.fixture(scope="session")
def authority(tmp_path_factory):
    """A certificate authority, a certificate for localhost, and another authority."""
    folder = tmp_path_factory.mktemp("certificates")

    def openssl(*words):
        subprocess.run(["openssl", *words], cwd=folder, check=True, capture_output=True)

    key = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes".split()

    def new_authority(name):
        files = f"-keyout {name}.key -out {name}.pem -days 2".split()
        openssl("req", "-x509", *key, *files, "-subj", f"/CN=test {name}")

    new_authority("ca")
    new_authority("other")
    openssl(*"req -keyout server.key -out server.csr -subj /CN=localhost".split(), *key)
    (folder / "names").write_text("subjectAltName=DNS:localhost\n", encoding="ascii")
    signed = "-CA ca.pem -CAkey ca.key -CAcreateserial -days 2 -extfile names".split()
    openssl(*"x509 -req -in server.csr -out server.pem".split(), *signed)
    return folder
