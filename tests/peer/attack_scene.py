"""A server, a link that sends it 50 commands a second, and an attacker: the effect on the link, and
the server's memory and log meanwhile."""

import contextlib
import json
import os
import pathlib
import re
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "e2e"), str(HERE.parents[1] / "tools")]
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"  # of the contexts in this process

from attack_ways import DIRECT, listen_parameters  # noqa: E402
from graph import Graph, connect  # noqa: E402
from harness.domains import free_port, release_domains, take_domains  # noqa: E402
from harness.programs import Bridge, Side, build_dir, dies_with_us, ros_environment  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from std_msgs.msg import Int64  # noqa: E402

from peer_world import token_file  # noqa: E402

ATTACKS = (
    "silent",
    "slow_login",
    "resets",
    "wrong_logins",
    "tls_handshakes",
    "bomb",
    "large",
    "unfinished",
    "malformed",
    "never_reads",
    "origins",
    "channels",
    "texts",
    "listeners",
    "mirrors",
    "lost",
    "toggles",
    "frames",
)
# These need long, or are about another figure than delays: tools/bench/attack alone does them.
MEASURED = ("gone", "readers", "unplaced")
# Their links have to live on: else the server ends them before they do what they are to do.
LEGAL = ("large", "never_reads", "texts", "listeners", "mirrors", "lost", "frames", *MEASURED)
# attack_nodes.py
WITH_NODES = ("bomb", "large", "unfinished", "never_reads", "lost", "toggles", *MEASURED)
OPERATOR, HOSTILE = "token-of-the-operator-1", "token-of-the-hostile-peer"
PERIOD = 0.02
LATE_SECONDS = 30.0  # what has not arrived so long after the attack is lost
LOG_BYTES_PER_HOUR = 1 << 20
# The log lines that many logins at once may write before they are limited.
LOG_BYTES_AT_ONCE = 16 << 10
# docs/protocol.md, section 12: topics that nobody publishes and that are subscribed for peers.
SUBSCRIBED_MAX, SUBSCRIBED_ALL_MAX = 256, 1024
# docs/security.md, section 5: memory_max, the workers, connections without a login, and the program
# itself.
MEMORY_MAX = 192 << 20
RESIDENT_BYTES_MAX = MEMORY_MAX + (200 << 20) + (30 << 20) + (64 << 20)
RULES = {
    "rules": ["operator", "hostile"],
    "rule": {
        "operator": {"import_topics": ["/command"], "identities": ["operator"]},
        "hostile": {
            "import_topics": ["/o/**"],
            "export_topics": ["/t/**"],
            "compression": "none",
            "identities": [f"hostile{n}" for n in range(8)],
        },
    },
}


# Of the server beside these.
PARAMETERS = {"readers": {"bytes_per_second": 1_000_000}}


class Seen:
    """What the command topic, the memory and the log were like for a while."""

    def __init__(self, numbers, delays, watched, log_bytes, done):
        self.sent, self.seconds = len(watched.sent), watched.seconds
        self.resident_bytes, self.cpu, self._lags = watched.resident, watched.cpu, watched.lags
        self.subscribed, self.ended = watched.subscribed, ""
        self.numbers, self.log_bytes, self.done = numbers, log_bytes, done
        self._delays = sorted(delays)

    @property
    def lost(self):
        return self.sent - len(self.numbers)

    @property
    def in_order(self):
        return self.numbers == sorted(set(self.numbers))

    def delay_ms(self, share):
        """The delay that this share of the commands does not exceed."""
        if not self._delays:
            return float("nan")
        return 1000 * self._delays[min(len(self._delays) - 1, int(share * len(self._delays)))]

    def lag_ms(self):
        """The longest delay of the server's loop."""
        return max(self._lags, default=float("nan"))

    def log_bytes_per_hour(self):
        return self.log_bytes * 3600 / self.seconds

    def problems(self, identities=1, memory=True):
        """What is beyond its bound, whatever the machine does beside."""
        log_max = LOG_BYTES_PER_HOUR * self.seconds / 3600 + LOG_BYTES_AT_ONCE
        subscribed_max = SUBSCRIBED_MAX if identities == 1 else SUBSCRIBED_ALL_MAX
        found = {
            "nothing was tried": sum(self.done.values()) == 0,
            f"the attack is none: {self.ended}": bool(self.ended),
            f"{self.lost} of {self.sent} commands are lost": self.lost > 0,
            "commands have overtaken each other": not self.in_order,
            f"the server has {self.resident_bytes >> 20} MiB": memory
            and self.resident_bytes >= RESIDENT_BYTES_MAX,
            f"{self.log_bytes} bytes of log": self.log_bytes >= log_max,
            f"{self.subscribed} subscriptions for listeners": self.subscribed > subscribed_max,
        }
        return [problem for problem, holds in found.items() if holds]


class Watch:
    """Records values of the server while commands are sent. topics: gives the names of those of its
    graph, where they say what a peer has made there."""

    def __init__(self, server, topics=None):
        self._server, self._topics = server, topics
        self.sent, self.lags, self.resident, self.subscribed = {}, [], 0, 0
        self._began, self._cpu = time.monotonic(), server.cpu_seconds()

    def look(self):
        """Called every tenth of a second. The status is not parsed: with 5,000 channels it is
        long."""
        self.resident = max(self.resident, self._server.resident_bytes())
        if self._topics:
            ours = sum(name.startswith("/t/") for name in self._topics())
            self.subscribed = max(self.subscribed, ours)
        with contextlib.suppress(OSError), open(self._server.status_file, "rb") as status:
            lag = re.search(rb'"loop_lag_ms": ([0-9.e+-]+)', status.read(300))
            if lag:
                self.lags.append(float(lag.group(1)))

    def end(self):
        self.seconds = time.monotonic() - self._began
        self.cpu = (self._server.cpu_seconds() - self._cpu) / self.seconds


class Scene:
    """aside: the attacker gets what processor time the others leave, as if it were elsewhere, and
    there is a twin of the server without a link, in a graph of its own (elsewhere()), unless it is
    not wanted.
    way: how all connections come to the server, the operator's too.
    links, identities: how many links at a time those who log in have, and of how many."""

    def __init__(
        self,
        folder,
        attack,
        aside=False,
        twin=True,
        way=DIRECT,
        links=8,
        identities=1,
        **parameters,
    ):
        twin = aside and twin
        self._tokens = [f"{HOSTILE}{n}" for n in range(identities)]
        self._links = links
        self._folder = pathlib.Path(folder)
        self._attack, self._way = attack, way
        self._priority = ["chrt", "--idle", "0"] if aside else ["nice", "-n", "5"]
        self.domains = take_domains(2)
        self._twins_domain = take_domains(1) if twin else []
        self.robot, self.operator = (Graph(domain) for domain in self.domains)
        port, door = free_port(), free_port()
        self._relay = self._start_relay(door, port)
        self.bridge = self._bridge(attack == "tls_handshakes", port, door, parameters)
        self.server = self.bridge.server
        self.bridge.start()
        qos = QoSProfile(depth=1000)
        self._publisher = self.operator.publisher(Int64, "/command", qos)
        self._collector = self.robot.collector(Int64, "/command", qos)
        connect(self._publisher, self._collector, Int64(data=0))
        self._number = 0
        self._nodes = self._start_nodes(self.domains[0])
        self._twin = self._start_twin() if twin else None

    def _bridge(self, tls, port, door, parameters):
        tokens = {f"hostile{n}": token.encode() for n, token in enumerate(self._tokens)}
        tokens["operator"] = OPERATOR.encode()
        server = {
            **RULES,
            "listen": {"address": "127.0.0.1", "port": port, **listen_parameters(self._way)},
            "memory_max": MEMORY_MAX,
            "auth": {"method": "token", "token_file": token_file(self._folder, tokens)},
            **PARAMETERS.get(self._attack, {}),
            **parameters,
        }
        dialed = door if self._relay else port
        client = {"auth": {"method": "token", "token": OPERATOR}}
        client["url"] = f"ws://127.0.0.1:{dialed}"
        if tls:
            self._certify()
            own = {"certificate": "server.crt", "private_key": "server.key"}
            server["tls"] = {key: str(self._folder / "certs" / name) for key, name in own.items()}
            client["tls"] = {"ca": str(self._folder / "certs" / "ca.crt")}
            client["url"] = f"wss://localhost:{dialed}"
        return Bridge(*self.domains, port, server, client, folder=self._folder)

    def _certify(self):
        command = [build_dir() / "ctl", "certs", self._folder / "certs", "--host", "localhost"]
        subprocess.run([str(word) for word in command], check=True, capture_output=True)

    def quiet(self, seconds):
        """Commands for so long."""
        begin = time.monotonic()
        return self._watch(lambda: time.monotonic() < begin + seconds)

    def attacked(self, seconds, count=1 << 40):
        """Commands while the attack goes on: for so long, or until so many tries."""
        return self._beside_attack_on(self.server, seconds, count)

    def elsewhere(self, seconds):
        """Commands while the twin is attacked: what the attack takes from the machine alone."""
        nodes = self._start_nodes(*self._twins_domain)
        try:
            return self._beside_attack_on(self._twin, seconds, 1 << 40)
        finally:
            self._end_nodes(nodes)

    def _beside_attack_on(self, server, seconds, count):
        port = server.parameters["listen"]["port"]
        attacker = self._start_attack(port, seconds, count)
        return self._watch(lambda: attacker.poll() is None, lambda: self._result(attacker))

    def _start_twin(self):
        parameters = dict(self.server.parameters)
        del parameters["status_file"]
        parameters["listen"] = {**parameters["listen"], "port": free_port()}
        twin = Side("server", *self._twins_domain, parameters, self._folder, name="twin")
        twin.start().wait_listening()
        return twin

    def _watch(self, goes_on, result=dict):
        self._collector.clear()
        log_begin = self.server.log.stat().st_size
        listens = self._attack == "listeners"
        watched = Watch(self.server, self._topics if listens else None)
        next_at = time.monotonic()
        while goes_on():
            self._number += 1
            watched.sent[self._number] = time.monotonic()
            self._publisher.publish(Int64(data=self._number))
            if self._number % 5 == 0:
                watched.look()
            next_at += PERIOD
            time.sleep(max(0.0, next_at - time.monotonic()))
        watched.end()
        return self._seen(watched, log_begin, result())

    def _topics(self):
        return [name for name, _ in self.robot.tester.get_topic_names_and_types()]

    def _seen(self, watched, log_begin, done):
        sent = watched.sent
        end = time.monotonic() + LATE_SECONDS
        while len(self._collector.messages) < len(sent) and time.monotonic() < end:
            time.sleep(0.02)
        numbers = [m.data for m in self._collector.messages]
        delays = [at - sent[n] for n, at in zip(numbers, self._collector.times) if n in sent]
        log = self.server.log.read_bytes()[log_begin:]
        seen = Seen(numbers, delays, watched, len(log), done)
        ended = re.search(rb"closing the link with /hostile.*", log)
        if ended and self._attack in LEGAL:
            seen.ended = ended.group(0).decode()
        if self._attack == "listeners" and not watched.subscribed:
            seen.ended = "nothing was subscribed"
        return seen

    def _start(self, script, command, words=2, **streams):
        """words: how many of the command are the script's."""
        before, own = command[:-words], command[-words:]
        command = [*before, sys.executable, "-B", str(HERE / script), *own]
        with open(self._folder / f"{script}.log", "wb") as errors:
            return subprocess.Popen(
                dies_with_us(command),
                env=ros_environment(self.domains[0]),
                stdout=subprocess.PIPE,
                stderr=errors,
                **streams,
            )

    def _start_relay(self, door, port):
        if self._way == DIRECT:
            return None
        relay = self._start("attack_relay.py", [str(door), str(port), self._way], words=3)
        relay.stdout.readline()
        return relay

    def _start_nodes(self, domain):
        if self._attack not in WITH_NODES:
            return None
        command = [self._attack, str(domain)]
        nodes = self._start("attack_nodes.py", command, stdin=subprocess.PIPE)
        nodes.stdout.readline()
        return nodes

    @staticmethod
    def _end_nodes(nodes):
        if nodes:
            nodes.communicate(timeout=20)

    def _start_attack(self, port, seconds, count):
        arguments = {
            "port": port,
            "tokens": self._tokens,
            "links": self._links,
            "seconds": seconds,
            "count": count,
            "way": self._way,
        }
        command = [*self._priority, self._attack, json.dumps(arguments)]
        attacker = self._start("attacks.py", command, start_new_session=True)
        # Linux shares the processors among sessions first (sched(7), autogroup), so the priority of
        # a process counts only within its session.
        with contextlib.suppress(OSError):  # this kernel does not
            pathlib.Path(f"/proc/{attacker.pid}/autogroup").write_text("19", encoding="ascii")
        return attacker

    def _result(self, attacker):
        text = attacker.stdout.read()
        attacker.wait()
        if attacker.returncode:
            raise RuntimeError((self._folder / "attacks.py.log").read_text(encoding="utf-8"))
        return json.loads(text)

    def close(self):
        self._end_nodes(self._nodes)
        problems = self.bridge.stop()
        if self._twin:
            self._twin.stop()
        if self._relay:
            self._relay.terminate()
            self._relay.communicate(timeout=20)
        self.robot.close()
        self.operator.close()
        release_domains([*self.domains, *self._twins_domain])
        assert not problems, "\n".join(problems)
