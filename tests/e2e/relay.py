"""A TCP relay between client and server whose line can be cut, stalled (half-open) and healed."""

import collections
import contextlib
import select
import socket
import threading
import time

from harness.domains import free_port

_PART = 1 << 16


class Relay:
    """Listens on `port`; every connection gets one of its own to the target. `delay`: delay in
    seconds in each direction. `first`: bytes that go to the target before all others."""

    def __init__(self, target_port, delay=0.0, first=b""):
        self._first = first
        self._target = ("127.0.0.1", target_port)
        self._delay = delay
        self._lock = threading.Lock()
        self._pairs = []
        self._stalled = threading.Event()
        self._serves = threading.Event()
        self._serves.set()
        self._closed = False
        self.connections = 0
        self.port = free_port()  # bound by its number, it stays ours while nobody listens
        self._listener = socket.create_server(("127.0.0.1", self.port))
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while not self._closed:
            try:
                near, _ = self._listener.accept()
            except OSError:  # nobody listens any longer
                self._serves.wait()
                continue
            try:
                far = socket.create_connection(self._target, timeout=2)
                far.sendall(self._first)
            except OSError:
                near.close()
                continue
            for end in (near, far):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with self._lock:
                self._pairs.append((near, far))
                self.connections += 1
            threading.Thread(target=self._carry, args=(near, far), daemon=True).start()

    def _carry(self, near, far):
        other = {near: far, far: near}
        under_way = collections.deque()  # (due time, destination, bytes)
        with contextlib.suppress(OSError, ValueError):
            while not self._closed:
                now = time.monotonic()
                while under_way and under_way[0][0] <= now:
                    _, end, part = under_way.popleft()
                    end.sendall(part)
                wait = under_way[0][0] - now if under_way else 0.1
                for end in select.select([near, far], [], [], min(wait, 0.1))[0]:
                    while self._stalled.is_set() and not self._closed:  # bytes wait, unread
                        if (near, far) not in self._pairs:
                            return
                        self._stalled_wait()
                    part = end.recv(_PART)
                    if not part:
                        raise OSError("closed")
                    under_way.append((time.monotonic() + self._delay, other[end], part))
        self._drop((near, far))

    def _stalled_wait(self):
        threading.Event().wait(0.02)

    def _drop(self, pair):
        with self._lock:
            if pair in self._pairs:
                self._pairs.remove(pair)
        for end in pair:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def cut(self):
        """Ends all connections and refuses new ones, as a dead access point does."""
        self._serves.clear()
        self._listener.shutdown(socket.SHUT_RDWR)
        self.break_connections()

    def break_connections(self):
        """Ends all connections; new ones are served."""
        for pair in list(self._pairs):
            self._drop(pair)

    def stall(self):
        """Nothing passes, and neither end notices, as on a link that has lost its radio."""
        self._stalled.set()

    def heal(self, keep=False):
        """Serves again. What was stalled is lost unless `keep`: its connections end unseen."""
        if not keep and self._stalled.is_set():
            self.break_connections()
        self._stalled.clear()
        if not self._serves.is_set():
            self._listener.listen()
            self._serves.set()

    def close(self):
        self._closed = True
        self._serves.set()
        self._listener.close()
        self.break_connections()
