"""A server, a link that commands it 50 times a second, and somebody who attacks: what the link
sees of it, and what the server holds and writes meanwhile."""

import hashlib
import json
import os
import pathlib
import subprocess
import sys
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "e2e"), str(HERE.parents[1] / "tools")]
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"  # of the contexts in this process

from graph import Graph, connect  # noqa: E402
from harness.domains import free_port, release_domains, take_domains  # noqa: E402
from harness.programs import Bridge, build_dir, dies_with_us, ros_environment  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from std_msgs.msg import Int64  # noqa: E402

ATTACKS = (
    "silent",
    "slow_login",
    "resets",
    "wrong_logins",
    "tls_handshakes",
    "bomb",
    "unfinished",
    "malformed",
    "never_reads",
    "origins",
    "channels",
)
OPERATOR, HOSTILE = "token-of-the-operator-1", "token-of-the-hostile-peer"
PERIOD = 0.02
LOG_BYTES_PER_HOUR = 1 << 20
# docs/security.md, section 5: memory_max, what workers hold, strangers; and the program itself.
MEMORY_MAX = 192 << 20
RESIDENT_BYTES_MAX = MEMORY_MAX + (192 << 20) + (30 << 20) + (64 << 20)
RULES = {
    "rules": ["operator", "hostile"],
    "rule": {
        "operator": {"import_topics": ["/command"], "identities": ["operator"]},
        "hostile": {
            "import_topics": ["/o/**"],
            "export_topics": ["/t/**"],
            "compression": "none",
            "identities": ["hostile"],
        },
    },
}


def token_file(folder):
    file = folder / "tokens.yaml"
    entries = [
        {"identity": identity, "token_sha256": hashlib.sha256(token.encode()).hexdigest()}
        for identity, token in (("operator", OPERATOR), ("hostile", HOSTILE))
    ]
    file.write_text(json.dumps(entries), encoding="ascii")  # JSON is YAML
    file.chmod(0o600)
    return str(file)


class Seen:
    """What the command topic, the memory and the log were like for a while."""

    def __init__(self, sent, numbers, delays, resident, log_bytes, seconds, done):
        self.sent, self.numbers, self.seconds, self.done = sent, numbers, seconds, done
        self.resident_bytes, self.log_bytes = resident, log_bytes
        self._delays = sorted(delays)

    @property
    def lost(self):
        return self.sent - len(self.numbers)

    @property
    def in_order(self):
        return self.numbers == sorted(set(self.numbers))

    def delay_ms(self, share):
        """The delay that this share of the commands stays under."""
        if not self._delays:
            return float("nan")
        return 1000 * self._delays[min(len(self._delays) - 1, int(share * len(self._delays)))]

    def log_bytes_per_hour(self):
        return self.log_bytes * 3600 / self.seconds


class Scene:
    def __init__(self, folder, tls=False, **parameters):
        self._folder = pathlib.Path(folder)
        self.domains = take_domains(2)
        self.robot, self.operator = (Graph(domain) for domain in self.domains)
        self.bridge = self._bridge(tls, parameters)
        self.server = self.bridge.server
        self.bridge.start()
        qos = QoSProfile(depth=1000)
        self._publisher = self.operator.publisher(Int64, "/command", qos)
        self._collector = self.robot.collector(Int64, "/command", qos)
        connect(self._publisher, self._collector, Int64(data=0))
        self._number = 0

    def _bridge(self, tls, parameters):
        server = {
            **RULES,
            "memory_max": MEMORY_MAX,
            "auth": {"method": "token", "token_file": token_file(self._folder)},
            **parameters,
        }
        client = {"auth": {"method": "token", "token": OPERATOR}}
        port = free_port()
        if tls:
            self._certify()
            own = {"certificate": "server.crt", "private_key": "server.key"}
            server["tls"] = {key: str(self._folder / "certs" / name) for key, name in own.items()}
            client["tls"] = {"ca": str(self._folder / "certs" / "ca.crt")}
            client["url"] = f"wss://localhost:{port}"
        return Bridge(*self.domains, port, server, client, folder=self._folder)

    def _certify(self):
        command = [build_dir() / "ctl", "certs", self._folder / "certs", "--host", "localhost"]
        subprocess.run([str(word) for word in command], check=True, capture_output=True)

    def watch(self, seconds, attack=None, count=1 << 40):
        """Commands for so long, while `attack` goes on; its end is waited for."""
        self._collector.clear()
        log_begin = self.server.log.stat().st_size
        begin, sent, resident = time.monotonic(), {}, 0
        attacker = self._start(attack, seconds, count) if attack else None
        end = begin + seconds
        while attacker.poll() is None if attacker else time.monotonic() < end:
            self._number += 1
            sent[self._number] = time.monotonic()
            self._publisher.publish(Int64(data=self._number))
            if self._number % 5 == 0:
                resident = max(resident, self.server.resident_bytes())
            next_at = begin + len(sent) * PERIOD
            time.sleep(max(0.0, next_at - time.monotonic()))
        lasted = time.monotonic() - begin
        done = self._result(attacker) if attacker else {}
        return self._seen(sent, resident, log_begin, lasted, done)

    def _seen(self, sent, resident, log_begin, lasted, done):
        end = time.monotonic() + 3
        while len(self._collector.messages) < len(sent) and time.monotonic() < end:
            time.sleep(0.02)
        numbers = [m.data for m in self._collector.messages]
        delays = [at - sent[n] for n, at in zip(numbers, self._collector.times) if n in sent]
        log_bytes = self.server.log.stat().st_size - log_begin
        return Seen(len(sent), numbers, delays, resident, log_bytes, lasted, done)

    def _start(self, attack, seconds, count):
        arguments = {
            "port": self.bridge.port,
            "token": HOSTILE,
            "domain": self.domains[0],
            "seconds": seconds,
            "count": count,
        }
        # What attacks comes from another machine: it shall not take the processor of this one.
        command = [sys.executable, "-B", str(HERE / "attacks.py"), attack, json.dumps(arguments)]
        with open(self._folder / f"{attack}.log", "wb") as errors:
            return subprocess.Popen(
                dies_with_us(["nice", "-n", "5", *command]),
                env=ros_environment(self.domains[0]),
                stdout=subprocess.PIPE,
                stderr=errors,
            )

    def _result(self, attacker):
        text = attacker.stdout.read()
        attacker.wait()
        if attacker.returncode:
            name = attacker.args[-2]
            raise RuntimeError((self._folder / f"{name}.log").read_text(encoding="utf-8"))
        return json.loads(text)

    def close(self):
        problems = self.bridge.stop()
        self.robot.close()
        self.operator.close()
        release_domains(self.domains)
        assert not problems, "\n".join(problems)
