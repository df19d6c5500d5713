"""50,000 calls by callers that are killed with calls under way: nothing grows."""

import json
import os
import subprocess
import time

import pytest

from calls import OPEN_CALLS
from graph import until
from harness.programs import Program, build_dir, dies_with_us, ros_environment, uses_rmw
from sanitizer import SANITIZED, not_under_a_sanitizer

CALLERS = 5
CALLS_EACH = 4_000 if SANITIZED else 10_000  # memory needs so many
GROWTH_BYTES = 4 << 20
# Zenoh keeps half a kilobyte of each call until the time of a query is over, usually 10 minutes.
QUERY_SECONDS = 2
RULES = {**OPEN_CALLS, "rule": {"all": {"export_services": ["/bench/**"]}}}


class Caller:
    """A process with a client that keeps 64 calls under way (tests/bench/ros_calls.hpp)."""

    def __init__(self, domain, command):
        self.process = subprocess.Popen(
            dies_with_us([build_dir() / "bench" / "ros_bench", "call"]),
            env=ros_environment(domain),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._answer() == {"ready": True}
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()

    def _answer(self):
        return json.loads(self.process.stdout.readline())

    def answer(self):
        answer = self._answer()
        assert answer["lost"] == answer["wrong"] == 0
        return answer

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        self.process.stdin.close()


@pytest.mark.slow
def test_callers_that_are_killed_leave_nothing(make_pair, tmp_path):
    pair = make_pair(server=RULES, start=False)
    if uses_rmw("rmw_zenoh_cpp"):
        for side in pair.bridge.sides:
            side.env["ZENOH_CONFIG_OVERRIDE"] += f";queries_default_timeout={QUERY_SECONDS}000"
    pair.bridge.start()
    bench = [build_dir() / "bench" / "ros_bench", "serve"]
    env = ros_environment(pair.domains[0])
    # Its stdin must stay open: it ends with it. A pipe that it holds itself does.
    stdin = tmp_path / "stdin"
    os.mkfifo(stdin)
    hold = ["sh", "-c", 'exec "$1" "$2" <>"$0"', stdin]
    server = Program("serve", [*hold, *bench], env, tmp_path)
    server.start().wait_for("ready")
    try:
        sizes = []
        for number in range(CALLERS):
            done = Caller(pair.domains[1], f"call window=64 seconds=60 samples={CALLS_EACH}")
            done.answer()
            killed = Caller(pair.domains[1], "call window=64 seconds=60")
            until(lambda: pending(pair, "client") > 0, "calls under way")
            killed.kill()
            done.kill()
            if uses_rmw("rmw_zenoh_cpp"):
                time.sleep(QUERY_SECONDS + 0.5)
            if number >= 2:  # one-time allocations are done
                sizes.append([side.resident_bytes() for side in (pair.server, pair.client)])
        # The middleware considers a killed process alive until its lease is over.
        until(lambda: not pending(pair, "client") + pending(pair, "server"), "no call", 40)
        not_under_a_sanitizer("the memory after many calls")
        for side, first, last in zip(("server", "client"), sizes[0], sizes[-1]):
            assert last - first < GROWTH_BYTES, f"the {side} grew from {first} to {last} bytes"
    finally:
        server.kill()


def pending(pair, which):
    return sum(
        entry["pending"]
        for link in getattr(pair, which).links()
        for entry in link.get("services", [])
    )
