"""Starts server and client with parameters, waits until they are ready, ends them."""

import atexit
import functools
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time

from harness.domains import is_operators

ROOT = pathlib.Path(__file__).resolve().parents[2]
# A variable with the environments of the middlewares of robot and operator, where each has one of
# its own (harness.middleware).
SIDES = "CONNECT_BRIDGE_RMW_ENVIRONMENTS"
# The log lines of a side that others can reach, and of one that is logged in at its peer.
_LISTENS = re.compile(r"listening on ")
_LINKED = re.compile(r": connected to ")


def build_dir():
    return ROOT / (os.environ.get("CONNECT_BUILD_DIR") or os.environ.get("BUILD") or "build")


def rmw_of(domain):
    """The environment that gives a process the middleware of this graph, if that is another one."""
    sides = json.loads(os.environ.get(SIDES, "[{}, {}]"))
    return sides[is_operators(domain)]


def uses_rmw(name):
    """Whether the robot's graph or the operator's has this middleware."""
    sides = json.loads(os.environ.get(SIDES, "[]"))
    return name in [side["RMW_IMPLEMENTATION"] for side in sides or [os.environ]]


@functools.cache
def _runtime():
    """Here programs put their sockets, and `ctl status` looks: apart from those of everybody else.
    The path of a socket is short, so it is no folder of pytest."""
    folder = tempfile.TemporaryDirectory(prefix="cb")
    atexit.register(folder.cleanup)
    return folder.name


def ros_environment(domain, **more):
    """The environment of a process in the ROS graph of this domain id, on this machine alone."""
    env = dict(os.environ, ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    env.update(rmw_of(domain))
    env["XDG_RUNTIME_DIR"] = _runtime()
    env.setdefault("RCUTILS_COLORIZED_OUTPUT", "0")
    env.pop("CONNECT_BRIDGE_TOKEN", None)
    env.update({key: str(value) for key, value in more.items()})
    return env


def dies_with_us(command):
    """The command, such that the kernel ends it if this process is killed before it can."""
    setpriv = shutil.which("setpriv")
    return [setpriv, "--pdeathsig", "KILL", *command] if setpriv else list(command)


def ros_parameters(node, values):
    """A parameters file. JSON is YAML; rcl reads it as such."""
    return json.dumps({node: {"ros__parameters": values}}, indent=1)


class Program:
    """One running process with its output in a file."""

    def __init__(self, name, command, env, folder):
        self.name = name
        self.command = [str(word) for word in command]
        self.env = env
        self.log = pathlib.Path(folder) / f"{name}.log"
        self.process = None

    def start(self):
        with open(self.log, "ab") as out:
            self._from = out.tell()
            self.process = subprocess.Popen(
                dies_with_us(self.command),
                env=self.env,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        return self

    @property
    def pid(self):
        return self.process.pid

    def running(self):
        return self.process is not None and self.process.poll() is None

    def text(self, whole=False):
        """Its output since it was last started, or since the first start."""
        with open(self.log, "rb") as log:
            log.seek(0 if whole else self._from)
            return log.read().decode("utf-8", "replace")

    def wait_for(self, pattern, timeout=15.0):
        """Waits until its output matches; raises with the output if it ends or the time is over."""
        expression = re.compile(pattern) if isinstance(pattern, str) else pattern
        end = time.monotonic() + timeout
        while True:
            ended = not self.running()
            found = expression.search(self.text())
            if found:
                return found
            if ended or time.monotonic() > end:
                what = f"ended with {self.process.returncode}" if ended else f"waited {timeout} s"
                raise RuntimeError(
                    f"{self.name}: no '{expression.pattern}' ({what})\n{self.text()}"
                )
            time.sleep(0.01)

    def stop(self, how=signal.SIGTERM, timeout=5.0):
        """Ends it and returns its exit code; kills it if it does not end by itself."""
        if self.process is None:
            return None
        if self.running():
            self.process.send_signal(how)
        # A side ends itself 4.8 s after the signal, whatever holds it up: what does is seen before.
        patience = min(timeout, 4.3)
        try:
            return self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self._write_stacks()
        try:
            return self.process.wait(timeout - patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise RuntimeError(
                f"{self.name} did not end within {timeout} s of {how!r}\n{self.text()}"
            ) from None

    def _write_stacks(self):
        """Into its log: where each of its threads is now."""
        debugger = ["gdb", "-p", str(self.pid), "-batch", "-ex", "thread apply all bt"]
        with open(self.log, "ab") as out:
            out.write(f"\nThe stacks of {self.name}, which does not end:\n".encode())
            out.flush()
            try:
                subprocess.run(
                    debugger,
                    stdin=subprocess.DEVNULL,
                    stdout=out,
                    stderr=subprocess.STDOUT,
                    timeout=30,
                    check=False,
                )
            except (OSError, subprocess.SubprocessError) as error:  # it may not be installed
                out.write(f"no stacks: {error}\n".encode())

    def kill(self):
        if self.running():
            self.process.kill()
        if self.process is not None:
            self.process.wait()

    def cpu_seconds(self):
        """Processor time of all its threads, from the scheduler's clock if the kernel has it."""
        total = 0
        try:
            for task in pathlib.Path(f"/proc/{self.pid}/task").iterdir():
                total += int((task / "schedstat").read_text(encoding="ascii").split()[0])
            if total:
                return total / 1e9
        except OSError:
            pass
        fields = (
            pathlib.Path(f"/proc/{self.pid}/stat")
            .read_text(encoding="ascii")
            .rsplit(")", 1)[1]
            .split()
        )
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def resident_bytes(self):
        status = pathlib.Path(f"/proc/{self.pid}/status").read_text(encoding="ascii")
        return int(re.search(r"VmRSS:\s+(\d+)", status).group(1)) * 1024


class Side(Program):
    """The server or the client of the bridge, with its parameters and its status."""

    def __init__(
        self,
        role,
        domain,
        parameters,
        folder,
        name=None,
        env=(),
        arguments=(),
        node=None,
        within=(),
    ):
        name = name or role
        folder = pathlib.Path(folder)
        self.node = node or f"connect_{role}"
        self.status_file = folder / f"{name}.status.json"
        self.parameters_file = folder / f"{name}.params.yaml"
        self.set_parameters(parameters)
        command = [
            *within,
            build_dir() / role,
            *arguments,
            "--ros-args",
            "--params-file",
            self.parameters_file,
        ]
        super().__init__(name, command, ros_environment(domain, **dict(env)), folder)

    def set_parameters(self, parameters):
        self.parameters = dict({"status_file": str(self.status_file)}, **parameters)
        self.parameters_file.write_text(
            ros_parameters(self.node, self.parameters), encoding="utf-8"
        )

    def start(self):
        self.status_file.unlink(missing_ok=True)
        return super().start()

    def wait_listening(self, timeout=20.0):
        return self.wait_for(_LISTENS, timeout)

    def wait_linked(self, timeout=20.0):
        return self.wait_for(_LINKED, timeout)

    def status(self):
        """Its last status, or an empty one if it wrote none yet."""
        try:
            return json.loads(self.status_file.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}

    def links(self):
        return [link for link in self.status().get("links", []) if link.get("open", True)]

    def topic(self, topic, direction=None):
        """The status of one topic, on the first link that has it."""
        for link in self.status().get("links", []):
            for entry in link.get("topics", []):
                if entry.get("topic") == topic and direction in (None, entry.get("direction")):
                    return entry
        return {}


class Bridge:
    """A server and a client on loopback, each in the ROS graph of its own domain id."""

    def __init__(
        self,
        robot_domain,
        operator_domain,
        port,
        server=(),
        client=(),
        folder=None,
        env=(),
        token="a-token-for-one-run",
        within=((), ()),
    ):
        """within: what each side's command begins with, for example where it runs (harness.wan)."""
        self.folder = pathlib.Path(folder or tempfile.mkdtemp(prefix="connect-bridge-"))
        self._own_folder = folder is None
        self.port = port
        self.domains = (robot_domain, operator_domain)
        login = {"auth": {"method": "token", "token": token}}
        self.server = Side(
            "server",
            robot_domain,
            {"listen": {"address": "127.0.0.1", "port": port}, **login, **dict(server)},
            self.folder,
            env=env,
            within=within[0],
        )
        self.client = Side(
            "client",
            operator_domain,
            {"url": f"ws://127.0.0.1:{port}", **login, **dict(client)},
            self.folder,
            env=env,
            within=within[1],
        )
        self.sides = (self.server, self.client)

    def start(self):
        self.server.start().wait_listening()
        self.client.start().wait_linked()
        return self

    def stop(self):
        """Ends both; returns what was wrong with that, which is nothing after an orderly end."""
        problems = []
        for side in reversed(self.sides):
            try:
                code = side.stop()
                if code:
                    problems.append(f"{side.name} ended with {code}\n{side.text()}")
            except RuntimeError as error:
                problems.append(str(error))
        if self._own_folder:
            shutil.rmtree(self.folder, ignore_errors=True)
        return problems

    def logs(self, lines=30):
        """The last lines of what both wrote, for a report of what went wrong."""
        written = [side for side in self.sides if side.log.exists()]
        return "\n".join(
            "\n".join([f"---- {side.name} ----", *side.text(whole=True).splitlines()[-lines:]])
            for side in written
        )
