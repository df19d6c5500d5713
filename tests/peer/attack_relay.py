#!/usr/bin/env python3
"""The proxy before a server: attack_relay.py PORT SERVER_PORT WAY. Carries the operator's
connections, with what a proxy of that way says first. Attackers say it themselves, so that this
process is not what they wear out."""

import asyncio
import contextlib
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent)]

from attack_ways import OPERATOR_ADDRESS, header  # noqa: E402


async def carry(reader, writer):
    with contextlib.suppress(OSError):
        while data := await reader.read(1 << 16):
            writer.write(data)
            await writer.drain()
    writer.close()


async def main(port, server_port, way):
    async def connect(reader, writer):
        try:
            there = await asyncio.open_connection("127.0.0.1", server_port)
        except OSError:
            return writer.close()
        there[1].write(header(way, OPERATOR_ADDRESS))
        await asyncio.gather(carry(reader, there[1]), carry(there[0], writer))

    server = await asyncio.start_server(connect, "127.0.0.1", port)
    print("listening", flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]))
