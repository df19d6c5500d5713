"""What the cases of tools/bench/wan run on: the network, a bridge over it, nodes at its ends."""

import tempfile

from harness.domains import free_port, take_domains
from harness.programs import Bridge, build_dir, ros_environment
from harness.wan import ADDRESS, OPERATOR, ROBOT, Wan
from harness.worker import Missing, Worker

PINGED, STREAMS = 10, 5  # topics of each kind; a case may use fewer

# The rules of a user who sets what is urgent and what may wait.
PRIORITIES = {
    "rules": ["command", "stream", "rest"],
    "rule": {
        "command": {
            "import_topics": ["/wan/ping_*"],
            "export_topics": ["/wan/pong_*"],
            "priority": "urgent",
        },
        "stream": {
            "export_topics": ["/wan/up_*"],
            "import_topics": ["/wan/down_*"],
            "priority": "bulk",
        },
        "rest": {"export_topics": ["/wan/**"], "import_topics": ["/wan/**"]},
    },
}
DEFAULTS = {
    "rules": ["all"],
    "rule": {"all": {"export_topics": ["/wan/**"], "import_topics": ["/wan/**"]}},
}
# Messages of the bench have no Header: here they tell states, but for the events.
NOW = {
    "rules": ["stop", "event", "state"],
    "rule": {
        "stop": {"export_topics": ["/wan/stop_*"], "max_rate": 10.0},
        "event": {"export_topics": ["/wan/event_*"], "compression": "none"},
        "state": {
            "export_topics": ["/wan/**"],
            "import_topics": ["/wan/**"],
            "keep": "newest",
            "compression": "none",
        },
    },
}
CAMERAS = {
    "rules": ["command", "one_packet", "never", "rest"],
    "rule": {
        "command": PRIORITIES["rule"]["command"],
        "one_packet": {"export_topics": ["/wan/ideal_*"], "keep": "newest", "compression": "none"},
        "never": {"export_topics": ["/never/**", "/exact_jpeg/**"], "lossy": "never"},
        "rest": {"export_topics": ["/wan/**", "/camera/**", "/large/**", "/jpeg/**"]},
    },
}


def seen_from_the_client(rules):
    """The same rules with import and export exchanged."""
    other = {"import_topics": "export_topics", "export_topics": "import_topics"}
    turned = {
        name: {other.get(key, key): value for key, value in rule.items()}
        for name, rule in rules["rule"].items()
    }
    return {"rules": rules["rules"], "rule": turned}


RULES = {"priorities": PRIORITIES, "defaults": DEFAULTS, "now": NOW, "pictures": CAMERAS}


class Bed:
    """Everything ends when it is closed. congestion: TCP's, of what is opened from now on."""

    def __init__(self, congestion="cubic"):
        self.congestion = congestion
        self._folder = tempfile.TemporaryDirectory(prefix="connect-wan-")
        self.folder = self._folder.name
        self._ends = []
        self._count = 0
        self.domains = take_domains(2)
        self.bridge = None
        try:
            self.wan = Wan(self.folder)
        except Missing:
            self._folder.cleanup()
            raise

    def worker(self, place, *words):
        """A tool at a place, in its graph; ends when the bridge does."""
        command = [self.program(words[0]), *words[1:]]
        return self.started(place, f"{words[0]}-{words[1]}", command)

    def program(self, name):
        program = build_dir() / "bench" / name
        if not program.exists():
            raise Missing(f"{program} is not built")
        return program

    def started(self, place, name, command):
        self._count += 1
        worker = Worker(
            f"{self._count}-{name}",
            [*self.wan.within(place), *command],
            ros_environment(self.domains[0 if place == ROBOT else 1]),
            self.folder,
        ).start()
        self._ends.append(worker.close)
        return worker

    def open(self, rules, server=(), client=()):
        """A new bridge with these rules, and new ends."""
        self.clear()
        port = free_port()
        common = {"allow_plaintext": True, "congestion_control": self.congestion}
        self.bridge = Bridge(
            *self.domains,
            port,
            server={
                **common,
                **RULES[rules],
                "listen": {"address": ADDRESS[ROBOT], "port": port},
                **dict(server),
            },
            client={
                **common,
                **seen_from_the_client(RULES[rules]),
                "url": f"ws://{ADDRESS[ROBOT]}:{port}",
                **dict(client),
            },
            folder=tempfile.mkdtemp(dir=self.folder),
            within=(self.wan.within(ROBOT), self.wan.within(OPERATOR)),
        )
        try:
            self.bridge.start()
        except RuntimeError as error:
            raise Missing(f"the bridge does not start: {error}") from None
        self.echo = self.worker(ROBOT, "wan_bench", "echo", f"topics={PINGED}")
        self.echo.ready()
        streams = f"topics={STREAMS}"
        self.talks, self.listens = {}, {}
        for name, here, there in (("up", ROBOT, OPERATOR), ("down", OPERATOR, ROBOT)):
            self.talks[name] = self.worker(here, "wan_bench", "talk", f"name=/wan/{name}", streams)
            listen = self.worker(there, "wan_bench", "listen", f"name=/wan/{name}", streams)
            self.listens[name] = listen
        self.ping = self.worker(OPERATOR, "wan_bench", "ping", f"topics={PINGED}")
        for worker in (*self.talks.values(), *self.listens.values(), self.ping):
            worker.ready()

    def plain(self, congestion=None):
        """Raw TCP in both directions: what the network allows. By default it has the bridge's
        congestion control; beside `auto` bbr, the better one where packets are lost."""
        congestion = congestion or ("bbr" if self.congestion == "auto" else self.congestion)
        tools = {}
        for name, here, there in (("up", ROBOT, OPERATOR), ("down", OPERATOR, ROBOT)):
            common = ("kind=tcp", f"address={ADDRESS[there]}", f"congestion={congestion}")
            echo = self.worker(there, "ws_bench", "echo", *common)
            port = f"port={echo.ready()['port']}"
            tools[name] = self.worker(here, "ws_bench", "ping", *common, port)
            tools[name].ready()
        return tools

    def cpu(self):
        return sum(side.cpu_seconds() for side in self.bridge.sides)

    def resident(self):
        return max(side.resident_bytes() for side in self.bridge.sides)

    def clear(self):
        for end in reversed(self._ends):
            end()
        self._ends.clear()
        if self.bridge:
            self.bridge.stop()
            self.bridge = None

    def close(self):
        self.clear()
        self.wan.close()
        self._folder.cleanup()
