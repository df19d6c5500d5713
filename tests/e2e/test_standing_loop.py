"""A side whose loop stands still, because it waits for something that does not come: a signal ends
it in time all the same, and without one it ends itself."""

import os
import signal
import time

import pytest

from conftest import OPEN
from graph import until
from harness.domains import free_port


@pytest.fixture
def make_server(domains, make_side):
    def make(name, **options):
        listen = {"listen": {"address": "127.0.0.1", "port": free_port()}}
        login = {"auth": {"token": "a-token-for-one-run"}}
        parameters = {**listen, **login, **OPEN}
        server = make_side("server", domains(1)[0], parameters, name=name, **options).start()
        until(server.status, "it runs")
        return server

    return make


class Pipe:
    """What a program writes its log to, and nobody reads."""

    def __init__(self, path):
        os.mkfifo(path)
        self.path = path
        self._reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)

    def fill(self):
        writer = os.open(self.path, os.O_WRONLY | os.O_NONBLOCK)
        try:
            for size in (4096, 1):
                try:
                    while True:
                        os.write(writer, b"\n" * size)
                except BlockingIOError:
                    pass
        finally:
            os.close(writer)

    def read(self):
        """All that there is now."""
        text = b""
        try:
            while piece := os.read(self._reader, 1 << 16):
                text += piece
        except BlockingIOError:
            pass
        return text.decode().strip("\n")

    def close(self):
        os.close(self._reader)


def moves(server, seconds):
    """Whether its loop has written a status within this time."""
    before = server.status_file.stat().st_mtime_ns
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if server.status_file.stat().st_mtime_ns != before:
            return True
        time.sleep(0.05)
    return False


@pytest.fixture
def make_standing(make_server, tmp_path):
    """Servers whose loop waits until there is room for a line of their log, and the pipes in which
    there is none. Their standard error is in their log as always."""
    pipes = []

    def make(*names):
        servers = []
        for name in names:
            pipe = Pipe(tmp_path / f"{name}.pipe")
            pipes.append(pipe)
            server = make_server(
                name,
                within=["sh", "-c", 'exec "$@" >"$0"', pipe.path],
                env={"RCUTILS_LOGGING_USE_STDOUT": 1, "RCUTILS_LOGGING_BUFFERED_STREAM": 1},
            )
            assert "listening on " in pipe.read()
            pipe.fill()
            server.process.send_signal(signal.SIGHUP)  # it reads its file again, and says so
            servers.append((server, pipe))
        until(
            lambda: not any(moves(server, 3 / len(servers)) for server, _ in servers),
            "their loops stand still",
        )
        return servers

    yield make
    for pipe in pipes:
        pipe.close()


def test_a_signal_ends_it_before_ros2_launch_kills_it(make_standing):
    servers = make_standing("terminated", "interrupted")
    for (server, _), how in zip(servers, (signal.SIGTERM, signal.SIGINT)):
        server.process.send_signal(how)
    for server, _ in servers:
        assert server.process.wait(6) == -signal.SIGALRM, server.text()
        assert "has not moved" not in server.text()


def test_an_orderly_end_if_it_moves_again_in_time(make_standing):
    ((server, pipe),) = make_standing("standing")
    server.process.send_signal(signal.SIGTERM)
    time.sleep(0.5)
    server.process.send_signal(signal.SIGTERM)  # changes nothing
    said = pipe.read()  # perhaps also what it says as soon as there is room
    assert server.process.wait(6) == 0, server.text()
    assert "stopping" in said + pipe.read()


@pytest.mark.slow
def test_it_ends_itself_after_half_a_minute(make_standing, make_server):
    ((server, _),) = make_standing("standing")
    paused = make_server("paused")  # as on a machine that is suspended
    paused.process.send_signal(signal.SIGSTOP)
    assert server.process.wait(40) == 3, server.text()
    said = server.text()
    assert said.count("The main loop of server has not moved for 30 s. ") == 1, said
    assert "server ends now, with exit code 3; " in said
    paused.process.send_signal(signal.SIGCONT)
    assert moves(paused, 10), paused.text()
    assert paused.stop() == 0
