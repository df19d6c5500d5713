"""Shared by the attacks: how long they last, what they count, and a correct WebSocket."""

import asyncio
import collections
import contextlib
import itertools
import secrets
import socket
import ssl
import struct
import time

from attack_ways import DIRECT, attackers_header
from connect_records import encode_hello, encode_login
from connect_socket import SUBPROTOCOL

REQUEST = (
    "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: c2l4dGVlbiBieXRlcyBsZQ==\r\nSec-WebSocket-Version: 13\r\n"
    f"Sec-WebSocket-Protocol: {SUBPROTOCOL}\r\n\r\n"
).encode()
TEXT, BINARY, CLOSE = 1, 2, 8
LOST = (OSError, EOFError, asyncio.TimeoutError, asyncio.LimitOverrunError, ssl.SSLError)
PATIENCE = 10.0


def web_frame(data, opcode=BINARY):
    """A whole WebSocket message, masked with zeros."""
    size = len(data)
    if size < 126:
        head = struct.pack(">BB", 0x80 | opcode, 0x80 | size)
    elif size < 1 << 16:
        head = struct.pack(">BBH", 0x80 | opcode, 0x80 | 126, size)
    else:
        head = struct.pack(">BBQ", 0x80 | opcode, 0x80 | 127, size)
    return head + bytes(4) + data


class Web:
    """A connection to the server: TCP or TLS, later a WebSocket. What fails is one of LOST."""

    def __init__(self, reader, writer):
        self.reader, self.writer = reader, writer
        self.received = 0  # bytes of packets since the login

    def write(self, data):
        self.writer.write(data)

    def send(self, data, opcode=BINARY):
        self.write(web_frame(data, opcode))

    async def drain(self):
        await asyncio.wait_for(self.writer.drain(), PATIENCE)

    async def recv(self, patience=PATIENCE):
        """The next message: its opcode and its bytes."""
        head = await asyncio.wait_for(self.reader.readexactly(2), patience)
        size = head[1] & 127
        if size >= 126:
            wide = size == 127
            size = int.from_bytes(await self.reader.readexactly(8 if wide else 2), "big")
        data = await self.reader.readexactly(size)
        self.received += size if head[0] & 15 == BINARY else 0
        return head[0] & 15, data

    async def until_closed(self, seconds):
        """Reads everything until the server ends the connection or the time is over."""

        async def read():
            while (await self.recv(seconds))[0] != CLOSE:
                pass

        with contextlib.suppress(*LOST):
            await asyncio.wait_for(read(), seconds)

    def reset(self):
        own = self.writer.get_extra_info("socket")
        # TLS has no socket any more once the other end has closed it.
        with contextlib.suppress(OSError, AttributeError):
            own.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.writer.transport.abort()


class Attack:
    """Target, tokens of the attackers, duration and maximum count of an attack, how many links at a
    time those have that log in, where that is asked for; and its results."""

    def __init__(self, port, tokens, seconds, count, way=DIRECT, links=8):
        self.port, self.links, self.way = port, links, way
        self._tokens = itertools.cycle(token.encode() for token in tokens)
        self.done = collections.Counter()
        self._end, self._left = time.monotonic() + seconds, count

    def goes_on(self):
        """Called before each try: whether there is time for one more."""
        self._left -= 1
        return self._left >= 0 and self.seconds_left() > 0

    def seconds_left(self):
        return max(0.0, self._end - time.monotonic())

    @contextlib.asynccontextmanager
    async def dialed(self, tls=None):
        """A connection, which is reset in the end if it is still there."""
        self.done["tries"] += 1
        web = await asyncio.wait_for(self._connect(tls), PATIENCE)
        try:
            yield web
        finally:
            web.reset()

    async def _connect(self, tls):
        web = Web(*await asyncio.open_connection("127.0.0.1", self.port))
        web.write(attackers_header(self.way))
        if tls:
            try:
                await web.writer.start_tls(tls)
            except (*LOST, asyncio.CancelledError):
                web.reset()
                raise
        return web

    @contextlib.asynccontextmanager
    async def upgraded(self):
        """A WebSocket before the login."""
        async with self.dialed() as web:
            web.write(REQUEST)
            answer = await asyncio.wait_for(web.reader.readuntil(b"\r\n\r\n"), PATIENCE)
            if b" 101 " not in answer:
                raise EOFError("no upgrade")
            self.done["upgraded"] += 1
            yield web

    @contextlib.asynccontextmanager
    async def logged_in(self, token=None, patience=PATIENCE):
        """A WebSocket behind the login, if the token is right."""
        async with self.upgraded() as web:
            web.send(encode_hello(side=secrets.token_bytes(16), node="/hostile"))
            web.send(encode_login("token", token or next(self._tokens)))
            opcode, _ = await web.recv(patience)
            self.done["refused" if opcode == CLOSE else "logged_in"] += 1
            web.received = 0
            yield web

    async def many(self, workers, act, pause=0.0):
        """So many threads at a time repeat it."""

        async def worker():
            while self.goes_on():
                try:
                    await act()
                except LOST:
                    self.done["dropped"] += 1
                await asyncio.sleep(pause)

        tasks = [asyncio.create_task(worker()) for _ in range(workers)]
        done, late = await asyncio.wait(tasks, timeout=self.seconds_left() + 1)
        for task in late:
            task.cancel()
        await asyncio.gather(*late, return_exceptions=True)
        for task in done:
            task.result()
