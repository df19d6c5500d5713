"""Attacks by clients without a token. Each goes on until its time is over, and counts."""

import asyncio
import itertools
import secrets
import ssl

from attack_web import REQUEST, web_frame
from connect_records import encode_hello


async def silent(attack):
    """1,000 connections that send nothing: TCP alone, or a WebSocket. Dropped ones connect
    again."""
    turns = itertools.count()

    async def stay():
        async with attack.upgraded() if next(turns) % 2 else attack.dialed() as web:
            await web.until_closed(attack.seconds_left())
        attack.done["dropped"] += 1

    await attack.many(1000, stay, pause=0.5)


async def slow_login(attack):
    """Single bytes of the request or of the login, slowly."""
    turns = itertools.count()

    async def drip():
        early = next(turns) % 2
        text = REQUEST if early else web_frame(encode_hello(side=secrets.token_bytes(16)))
        async with attack.dialed() if early else attack.upgraded() as web:
            for byte in text:
                web.write(bytes([byte]))
                await asyncio.sleep(0.1)
                if web.reader.at_eof() or not attack.seconds_left():
                    break

    await attack.many(300, drip)


async def resets(attack):
    """Connections that are reset at once, within the request, before and within the login."""
    turns = itertools.count()

    async def come_and_go():
        turn = next(turns) % 4
        async with attack.dialed() if turn < 2 else attack.upgraded() as web:
            if turn == 1:
                web.write(REQUEST[:60])
            if turn == 3:
                web.send(encode_hello(side=secrets.token_bytes(16)))
            await asyncio.sleep(0)

    await attack.many(16, come_and_go)


async def wrong_logins(attack):
    """A connection that is not answered soon is given up, and makes room for the next."""

    async def log_in():
        async with attack.logged_in(b"a wrong token of some length", patience=0.05):
            pass

    await attack.many(16, log_in)


async def tls_handshakes(attack):
    """TLS handshakes with nothing after them."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE

    async def shake():
        async with attack.dialed(context):
            attack.done["handshakes"] += 1

    await attack.many(32, shake)
