"""Programs that take commands on stdin and answer with JSON, as tests/bench/timing.hpp says."""

import contextlib
import json
import os
import select
import subprocess
import time

from harness.programs import Program, dies_with_us


class Missing(Exception):
    """Something could not be measured, and why."""


class Worker(Program):
    """A tool that answers each command with one JSON object."""

    def __init__(self, name, command, env, folder):
        super().__init__(name, command, env, folder)
        self._text = b""

    def start(self):
        with open(self.log, "ab") as errors:
            self._from = errors.tell()
            self.process = subprocess.Popen(
                dies_with_us(self.command),
                env=self.env,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                start_new_session=True,
            )
        return self

    def ready(self, timeout=45.0):
        answer = self.answer(timeout)
        if "error" in answer:
            raise Missing(f"{self.name}: {answer['error']}")
        return answer

    def say(self, command):
        try:
            self.process.stdin.write(command.encode() + b"\n")
            self.process.stdin.flush()
        except OSError as error:
            raise Missing(f"{self.name} has ended: {error}") from None

    def answer(self, timeout=60.0):
        return json.loads(self.line(timeout))

    def line(self, timeout=60.0):
        end = time.monotonic() + timeout
        pipe = self.process.stdout.fileno()
        while b"\n" not in self._text:
            if not select.select([pipe], [], [], max(0.0, end - time.monotonic()))[0]:
                raise Missing(f"{self.name}: no answer within {timeout:g} s")
            more = os.read(pipe, 1 << 16)
            if not more:
                raise Missing(f"{self.name} has ended: {self.text().strip()[-300:]}")
            self._text += more
        line, self._text = self._text.split(b"\n", 1)
        return line.decode()

    def ask(self, command, timeout=60.0):
        self.say(command)
        return self.answer(timeout)

    def close(self):
        if self.process is None:
            return
        with contextlib.suppress(OSError):
            self.process.stdin.close()
        try:
            self.process.wait(3)
        except subprocess.TimeoutExpired:
            self.kill()
        self.process.stdout.close()
