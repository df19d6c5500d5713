"""A side as a service: what the service manager is told, signals while it starts, its log."""

import os
import pathlib
import pty
import shutil
import signal
import socket
import subprocess
import sys
import time

import pytest

from conftest import OPEN
from graph import until
from harness.domains import free_port

# Gives a program, the first of its session, the terminal that is named.
TERMINAL = """
import os, sys
os.dup2(os.open(sys.argv[1], os.O_RDWR), 0)
os.execv(sys.argv[2], sys.argv[2:])
"""


@pytest.fixture
def make_server(domains, make_side):
    def make(**options):
        listen = {"listen": {"address": "127.0.0.1", "port": free_port()}}
        login = {"auth": {"token": "a-token-for-one-run"}}
        return make_side("server", domains(1)[0], {**listen, **login, **OPEN}, **options)

    return make


@pytest.fixture
def manager():
    """The socket of a service manager and its name as NOTIFY_SOCKET has it."""
    name = f"connect_bridge_{os.getpid()}_{time.monotonic_ns()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind("\0" + name)
        listener.settimeout(20)
        yield listener, "@" + name


def signals(side, what):
    """The signals that a process ignores or handles."""
    text = pathlib.Path(f"/proc/{side.pid}/status").read_text(encoding="ascii")
    [line] = [line for line in text.splitlines() if line.startswith(f"{what}:")]
    bits = int(line.split()[1], 16)
    return {number for number in range(1, 65) if bits >> (number - 1) & 1
}


def runs(side, program):
    return os.readlink(f"/proc/{side.pid}/exe").endswith(f"/{program}")


def test_the_service_manager_is_told(make_server, manager):
    listener, name = manager
    server = make_server(env={"NOTIFY_SOCKET": name}).start()
    assert listener.recv(256) == b"READY=1\nWATCHDOG=1"
    assert "listening on " in server.text()
    assert listener.recv(256) == b"WATCHDOG=1"
    assert listener.recv(256) == b"WATCHDOG=1"
    assert server.stop() == 0
    while (told := listener.recv(256)) == b"WATCHDOG=1":
        pass
    assert told == b"STOPPING=1"


def test_the_unit_is_sandboxed():
    if not shutil.which("systemd-analyze"):
        pytest.skip("NOT TESTED: there is no systemd-analyze")
    unit = pathlib.Path(__file__).parents[2] / "config" / "connect_bridge.service"
    judge = ["systemd-analyze", "security", "--offline=true", "--threshold=20", unit]
    told = subprocess.run(judge, capture_output=True, text=True, timeout=20)
    assert told.returncode == 0, told.stdout + told.stderr


def test_a_hangup_during_the_start(make_server):
    """systemd takes a program that SIGHUP ends for one that has ended in order."""
    server = make_server().start()

    def ignores():
        return runs(server, "server") and signal.SIGHUP in signals(server, "SigIgn")

    until(ignores, "SIGHUP is ignored", step=0.001)
    server.process.send_signal(signal.SIGHUP)
    server.wait_listening()
    until(lambda: signal.SIGHUP in signals(server, "SigCgt"), "handled")
    assert server.stop() == 0


@pytest.mark.parametrize("wait", [0.0, 0.05, 0.2])
def test_a_terminal_that_is_closed_during_the_start(make_server, wait):
    ours, its = pty.openpty()
    try:
        within = [sys.executable, "-c", TERMINAL, os.ttyname(its)]
        server = make_server(within=within).start()
        until(lambda: runs(server, "server"), "it has the terminal")
        time.sleep(wait)
    finally:
        os.close(its)
        os.close(ours)
    assert server.process.wait(10) in (0, -signal.SIGHUP, -signal.SIGTERM), server.text()


@pytest.mark.parametrize("folder", ["a file", "/proc"])
def test_without_a_place_for_the_log_file(make_server, tmp_path, folder):
    """Neither a folder that cannot be made nor a file that cannot be made hinders the start."""
    if folder == "a file":
        (tmp_path / "file").touch()
        folder = tmp_path / "file" / "log"
    server = make_server(env={"ROS_LOG_DIR": folder}).start()
    server.wait_listening()
    said = server.text()
    assert said.count("so no log file is written, as with --disable-external-lib-logs") == 1, said
    assert server.stop() == 0


def test_the_log_file_is_not_written_if_it_is_not_wanted(make_server, tmp_path):
    """The argument of the unit in docs/service.md."""
    for arguments, files in ((["--ros-args", "--disable-external-lib-logs", "--"], 0), ([], 1)):
        folder = tmp_path / f"log_{files}"
        folder.mkdir()
        server = make_server(
            env={"ROS_LOG_DIR": folder}, arguments=arguments, name=f"server_{files}"
        ).start()
        server.wait_listening()
        assert server.stop() == 0
        assert len(list(folder.iterdir())) == files, server.text()
