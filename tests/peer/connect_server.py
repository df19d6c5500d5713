"""The server's end of the ROS2 Connect protocol, written from docs/protocol.md alone.

After login both ends say the same, so this is a Peer that is dialed."""

import queue
import threading

from websockets.sync.server import serve

from connect_peer import Peer
from connect_records import MESSAGE_MAX, decode_hello, decode_login, encode_welcome
from connect_socket import SUBPROTOCOL


class Listener:
    """WebSockets that somebody opens here, one after the other."""

    def __init__(self, port):
        self._opened = queue.Queue()
        self._end = threading.Event()
        self._server = serve(
            self._on_socket,
            "127.0.0.1",
            port,
            subprotocols=[SUBPROTOCOL],
            compression=None,
            max_size=MESSAGE_MAX,
            ping_interval=None,
        )
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def _on_socket(self, socket):
        self._opened.put(socket)
        self._end.wait()  # when this returns, the socket is closed

    def next_socket(self, timeout=20):
        return self._opened.get(timeout=timeout)

    def close(self):
        self._end.set()
        self._server.shutdown()
        self._thread.join(5)


class Host(Peer):
    """A server that lets in whoever comes next, and has rules of its own as a Peer has."""

    def __init__(self, listener, **options):
        super().__init__(listener, None, **options)

    def _log_in(self, listener, token, session):
        self.socket = listener.next_socket()
        self.welcome = decode_hello(self.socket.recv(timeout=10))  # what it says of itself
        self.login = decode_login(self.socket.recv(timeout=10))
        limits = dict(dead_after_ms=0, message_bytes_max=0)
        session = self.side[::-1]
        self.socket.send(encode_welcome(1, self.side, session, **limits, node="/host", identity=""))
