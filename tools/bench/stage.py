"""The processes of a benchmark: tools that take commands, and the paths they measure."""

import os
import tempfile

from harness.domains import free_port, take_domains
from harness.programs import ROOT, Bridge, build_dir, ros_environment
from harness.worker import Missing, Worker

LARGE_DATA = ROOT / "config" / "fastdds_large_data.xml"

# Commands are urgent and streams are bulk, as a user would set it; everything else has its default.
# The queues hold what a window of 500 kB messages needs, because a reliable sender counts on it.
RULES = {
    "rules": ["small", "stream", "rest"],
    "rule": {
        "small": {
            "import_topics": ["/bench/ping", "/bench/flood_ack"],
            "export_topics": ["/bench/pong"],
            "priority": "urgent",
            "queue_bytes_max": 1 << 26,
        },
        "stream": {"export_topics": ["/bench/stream"], "priority": "bulk"},
        "rest": {
            "export_topics": ["/bench/**"],
            "export_services": ["/bench/**"],
            "queue_bytes_max": 1 << 26,
        },
    },
}


def profile_environment(large):
    if not large:
        return {}
    old = os.environ.get("ROS_DISTRO", "") in ("humble", "iron", "jazzy")
    return {("FASTRTPS" if old else "FASTDDS") + "_DEFAULT_PROFILES_FILE": str(LARGE_DATA)}


def use_programs(bridge, folder):
    for side in bridge.sides:
        at = side.command.index(str(build_dir() / side.name))
        side.command[at] = str(folder.resolve() / side.name)


class Workshop:
    """Starts everything, and ends everything however the benchmark ends."""

    def __init__(self):
        self._temporary = tempfile.TemporaryDirectory(prefix="connect-bench-")
        self.folder = self._temporary.name
        self._started = []
        self._bridges = []
        self._count = 0

    def worker(self, *words, domain=None, large=False):
        self._count += 1
        name = f"{self._count}-{words[0]}-{words[1]}"
        env = ros_environment(0 if domain is None else domain, **profile_environment(large))
        program = build_dir() / "bench" / words[0]
        if not program.exists():
            raise Missing(f"{program} is not built")
        worker = Worker(name, [program, *words[1:]], env, self.folder).start()
        self._started.append(worker.close)
        return worker

    def bridge(self, large=False, programs=None):
        """`programs`: the folder of server and client; None: that of the build."""
        folder = tempfile.mkdtemp(dir=self.folder)
        bridge = Bridge(
            *take_domains(2),
            free_port(),
            server=RULES,
            folder=folder,
            env=profile_environment(large),
        )
        self._started.append(bridge.stop)
        self._bridges.append(bridge)
        if programs:
            use_programs(bridge, programs)
        for side in bridge.sides:
            if not (programs or build_dir()).joinpath(side.name).exists():
                raise Missing(f"{(programs or build_dir()) / side.name} is not built")
        try:
            return bridge.start()
        except RuntimeError as error:
            raise Missing(f"the bridge does not start: {error}") from None

    def complaints(self):
        """What the sides of the bridges warned about: after a quiet run nothing."""
        return [
            f"{side.name}: {line}"
            for bridge in self._bridges
            for side in bridge.sides
            if side.log.exists()
            for line in side.text(whole=True).splitlines()
            if not line.startswith(("[INFO]", "[DEBUG]"))
        ]

    def close(self):
        for stop in reversed(self._started):
            stop()
        self._temporary.cleanup()


class Path:
    """One way from a sender to a receiver and back: its tools, and why some do not work."""

    def __init__(self, name):
        self.name = name
        self.bridge = None
        self._tools = {}
        self._missing = {}

    def add(self, tool, make):
        """make() gives a worker that has been started; it takes its place when it is ready."""
        try:
            worker = make()
            self._tools[tool] = (worker, worker.ready())
        except Missing as error:
            self._missing[tool] = str(error)

    def same(self, tool, other):
        """The other tool also does the work of this one."""
        for those in (self._tools, self._missing):
            if other in those:
                those[tool] = those[other]

    def tool(self, name):
        if name not in self._tools:
            raise Missing(self._missing.get(name, f"{self.name} has no {name}"))
        return self._tools[name][0]

    def said(self, name):
        """The tool's output when it was ready."""
        self.tool(name)
        return self._tools[name][1]

    def missing(self):
        return self._missing


def plain_path(shop, kind):
    """Raw TCP or a bare WebSocket between two processes."""
    path = Path(kind)
    path.add("echo", lambda: shop.worker("ws_bench", "echo", f"kind={kind}"))
    path.add(
        "ping",
        lambda: shop.worker(
            "ws_bench", "ping", f"kind={kind}", f"port={path.said('echo')['port']}"
        ),
    )
    path.same("source", "ping")
    return path


def relay_path(shop):
    """Two graphs with the simplest bridge between them: the limit of the machine for any bridge."""
    path = Path("bare relay")
    robot, operator = take_domains(2)

    def half(domain, take, give, *more):
        words = (f"take=/bench/{take}", f"give=/bench/{give}", *more)
        return shop.worker("ros_bench", "relay", *words, domain=domain)

    def both_halves(name, to_robot, to_operator):
        path.add(name, lambda: half(robot, to_operator, to_robot))
        path.add(
            f"{name} far",
            lambda: half(operator, to_robot, to_operator, f"port={path.said(name)['port']}"),
        )

    for tool, domain in (("echo", robot), ("sink", operator)):
        path.add(tool, lambda t=tool, d=domain: shop.worker("ros_bench", t, domain=d))
    both_halves("pings", "ping", "pong")
    both_halves("floods", "flood_ack", "flood")
    for tool, domain in (("ping", operator), ("source", robot)):
        path.add(tool, lambda t=tool, d=domain: shop.worker("ros_bench", t, domain=d))
    return path


def one_node_path(shop, name, large):
    """In one graph, a single node echoes the pings and publishes the stream: for `mixed` alone."""
    path = Path(name)
    domain = take_domains(1)[0]
    for tool, mode in (("talk", "both"), ("listen", "listen"), ("ping", "ping")):
        path.add(tool, lambda m=mode: shop.worker("ros_bench", m, domain=domain, large=large))
    path.same("echo", "talk")
    return path


def ros_path(shop, name, bridged, large, programs=None):
    """Operator pings, robot echoes; robot floods, operator counts: in one graph or in two."""
    path = Path(name)
    try:
        if bridged:
            path.bridge = shop.bridge(large, programs)
            robot, operator = path.bridge.domains
        else:
            robot = operator = take_domains(1)[0]
    except Missing as error:
        for tool in ("ping", "source", "talk", "listen"):
            path.missing()[tool] = str(error)
        return path
    for tool, domain in (
        ("echo", robot),
        ("sink", operator),
        ("talk", robot),
        ("listen", operator),
        ("ping", operator),
        ("source", robot),
    ):
        path.add(
            tool,
            lambda tool=tool, domain=domain: shop.worker(
                "ros_bench", tool, domain=domain, large=large
            ),
        )
    return path
