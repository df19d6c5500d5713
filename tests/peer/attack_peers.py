"""Attacks by peers with a token. Each goes on until its time is over, and counts."""

import asyncio
import collections
import contextlib
import itertools
import json
import os
import random
import time
import weakref

from attack_web import BINARY, LOST, TEXT
from connect_control import encode_control
from connect_packets import TextHistory, decode_packet, encode_packet, zstd_compress
from peer_world import BYTES, STRING, message, part_of, vectors

MBIT = 125_000  # bytes
LARGE_NAMES = [f"/o/large{n}" for n in range(1, 5)]
PART_BYTES = 1_000_000
LATCHED = 64  # topics of a node
LOST_NAMES = [f"/o/lost{n}" for n in range(8)]
LOST_EACH = 256  # publishers of each
UNPLACED = 3750  # topics or services of a link
CALLED = "std_srvs/srv/SetBool"
SIGN_OF_LIFE = encode_packet([dict(type="time_request", t1=1)])


def say(web, **control):
    web.send(encode_control(control).encode(), TEXT)


def begin(web, *imports):
    """The first round of a peer that imports this, and offers nothing yet."""
    say(web, type="accepts", rules=[{"topics": list(imports), "types": []}], deny=[])
    say(web, type="offer", channels=[], complete=True)


HEARD = weakref.WeakKeyDictionary()  # of each connection: its history, and texts not looked at yet


async def told(web, kind, holds=lambda _: True):
    """The next control message of this kind that fulfils the condition."""
    history, texts = HEARD.setdefault(web, (TextHistory(), collections.deque()))
    while True:
        while texts:
            text = json.loads(texts.popleft())
            if text.get("type") == kind and holds(text):
                return text
        opcode, data = await web.recv()
        if opcode == TEXT:
            texts.append(data)
            continue
        for frame in decode_packet(data):
            if frame["type"] == "texts":
                texts.extend(history.read(frame))


def origin(number, prefix):
    gid = prefix + number.to_bytes(4, "big")
    return {"origin": number, "gid": gid.ljust(24, b"\0").hex(), "qos": {"depth": 10}}


def topic(number, name, kind=STRING):
    origins = [origin(1, os.urandom(12))]
    return {"channel": number, "kind": "topic", "name": name, "type": kind, "origins": origins}


async def malformed(attack):
    """1 Mbit/s of forbidden messages. Each one ends the connection, so each is sent by another
    peer."""
    said = [(TEXT, vector["text"].encode()) for vector in vectors("malformed_control")]
    packets = [v["hex"] for v in vectors("malformed") if v["kind"] == "packet"]
    said += [(BINARY, bytes.fromhex(packet)) for packet in packets]
    said += [(BINARY, random.Random(n).randbytes(1200)) for n in range(20)]
    turns, first = itertools.cycle(said), time.monotonic()

    async def offend():
        opcode, data = next(turns)
        async with attack.logged_in() as web:
            for _ in range(20):  # those behind the first are there while it ends
                web.send(data[: 1 << 16], opcode)
            attack.done["bytes"] += 20 * len(data[: 1 << 16])
            await web.until_closed(2)
        await asyncio.sleep(max(0.0, first + attack.done["bytes"] / MBIT - time.monotonic()))

    await attack.many(8, offend)


async def bomb(attack):
    """2 kB that become 64 MiB, as fast as they can be sent, for a node that listens."""
    raw = b"\0\1\0\0" + bytes((64 << 20) - 4)
    body = zstd_compress(raw)

    async def throw():
        async with attack.logged_in() as web:
            begin(web)
            say(web, type="offer", channels=[topic(1, "/o/bomb", BYTES)])
            await told(web, "demand")
            drain = asyncio.create_task(web.until_closed(attack.seconds_left()))
            for sequence in itertools.count(1):
                frame = message(1, sequence, body)
                web.send(encode_packet([dict(frame, codec="zstd", raw_bytes=len(raw))]))
                await web.drain()
                attack.done["bombs"] += 1
                if drain.done() or not attack.seconds_left():
                    return

    await attack.many(1, throw)


async def large(attack):
    """Samples of 16 MiB, not compressed, as fast as they are taken, for a node that listens."""
    size = (16 << 20) - 16
    raw = b"\0\1\0\0" + bytes(8) + size.to_bytes(4, "little") + bytes(size)
    parts = [raw[at : at + PART_BYTES] for at in range(0, len(raw), PART_BYTES)]

    async def throw():
        async with attack.logged_in() as web:
            begin(web)
            say(web, type="offer", channels=[topic(1, LARGE_NAMES[0], BYTES)])
            number = (await told(web, "demand"))["channels"][0]["number"]
            ends = asyncio.create_task(web.until_closed(attack.seconds_left()))
            for sequence in itertools.count(1):
                first = message(1, sequence, parts[0], body_bytes=len(raw))
                web.send(encode_packet([dict(first, demand=number)]))
                for part in parts[1:]:
                    web.send(encode_packet([part_of(1, part)]))
                    await web.drain()
                attack.done["samples"] += 1
                if ends.done() or not attack.seconds_left():
                    return

    await attack.many(1, throw)


async def unfinished(attack):
    """Peers that each begin four messages of 64 MiB, and send all of them but the ends."""

    async def hoard():
        async with attack.logged_in() as web:
            begin(web)
            offered = [topic(n, name, BYTES) for n, name in enumerate(LARGE_NAMES, 1)]
            say(web, type="offer", channels=offered)
            demands = {}
            while len(demands) < len(LARGE_NAMES):
                demand = await told(web, "demand")
                demands.update((d["channel"], d["number"]) for d in demand["channels"])
            ends = asyncio.create_task(web.until_closed(attack.seconds_left()))
            for channel, number in demands.items():
                first = message(channel, 1, bytes(PART_BYTES), body_bytes=64 << 20)
                web.send(encode_packet([dict(first, demand=number)]))
            for _ in range(66):
                for channel in demands:
                    web.send(encode_packet([part_of(channel, bytes(PART_BYTES))]))
                    await web.drain()
                    attack.done["bytes"] += PART_BYTES
            attack.done["hoards"] += 1
            while attack.seconds_left() and not ends.done():
                web.send(SIGN_OF_LIFE)
                await asyncio.sleep(0.3)

    await attack.many(8, hoard)


async def never_reads(attack):
    """Peers that each demand 25 MB/s and read none of it, but send signs of life."""

    async def demand():
        async with attack.logged_in() as web:
            begin(web, "/t/**")
            offer = await told(web, "offer", lambda o: "/t/large" in str(o))
            number = next(c["channel"] for c in offer["channels"] if c["name"] == "/t/large")
            say(web, type="demand", channels=[dict(channel=number, number=1)])
            attack.done["links"] += 1
            while attack.seconds_left():
                web.send(SIGN_OF_LIFE)
                await asyncio.sleep(0.5)
                await web.drain()

    await attack.many(8, demand)


async def origins(attack):
    """Publishers of a topic that come and go as fast as messages can be sent."""

    async def churn():
        async with attack.logged_in() as web:
            begin(web)
            say(web, type="offer", channels=[topic(1, "/o/busy")])
            ends = asyncio.create_task(web.until_closed(attack.seconds_left()))
            prefix = os.urandom(8)
            for first in itertools.count(2, 50):
                added = [origin(n, prefix) for n in range(first, first + 50)]
                removed = list(range(first - 50, first)) if first > 50 else []
                say(web, type="origins", channel=1, added=added, removed=removed)
                await web.drain()
                attack.done["origins"] += 50
                if ends.done() or not attack.seconds_left():
                    return

    await attack.many(1, churn)


async def texts(attack):
    """The longest messages that a peer may send and that say nothing, as fast as it can."""
    slow = [f"1.2345678e-{n}" for n in range(310, 321)]
    values = ",".join(itertools.islice(itertools.cycle(slow), 16_000))
    members = ",".join(f'"x{n}":[{{}},[],""]' for n in range(60))
    objects = ",".join(["{" + members + "}"] * 60)
    said = [f'{{"type":"demand","channels":[],"number":1,"x":[{x}]}}' for x in (values, objects)]

    async def speak():
        async with attack.logged_in() as web:
            begin(web)
            ends = asyncio.create_task(web.until_closed(attack.seconds_left()))
            for text in itertools.cycle(said):
                web.send(text.encode(), TEXT)
                await web.drain()
                attack.done["texts"] += 1
                if ends.done() or not attack.seconds_left():
                    return

    await attack.many(attack.links, speak)


async def demand(web, name, **how):
    """Demands this topic as soon as it is offered."""
    offer = await told(web, "offer", lambda o: any(c["name"] == name for c in o["channels"]))
    number = next(c["channel"] for c in offer["channels"] if c["name"] == name)
    say(web, type="demand", channels=[dict(channel=number, number=1, **how)])


def acknowledge(web):
    ack = dict(type="ack", received_bytes=web.received, arrived=time.monotonic_ns())
    web.send(encode_packet([ack]))


async def until_over(attack, web, step):
    """Repeats it until the server ends the connection or the time is over."""
    ends = asyncio.create_task(web.until_closed(attack.seconds_left()))
    while attack.seconds_left() and not ends.done():
        await step()


async def listeners(attack):
    """Each link listens to 1,024 topics with long names that nobody publishes, of its own each."""

    async def listen():
        async with attack.logged_in() as web:
            begin(web, "/t/**")
            own = f"/t/{os.urandom(8).hex()}{'x' * 170}"
            for first in range(0, 1024, 64):
                added = [
                    {"listener": n + 1, "name": f"{own}{n}", "type": STRING}
                    for n in range(first, first + 64)
                ]
                say(web, type="listeners", added=added, removed=[])
                attack.done["listeners"] += len(added)

            async def live():
                web.send(SIGN_OF_LIFE)
                await asyncio.sleep(0.3)

            await until_over(attack, web, live)

    await attack.many(attack.links, listen)


async def mirrors(attack):
    """Each link offers 4,000 topics with a publisher each, goes, and comes again."""

    async def offer():
        async with attack.logged_in() as web:
            begin(web)
            own = os.urandom(8).hex()
            for first in range(1, 4000, 250):
                offered = [topic(n, f"/o/{own}{n}") for n in range(first, first + 250)]
                say(web, type="offer", channels=offered)
                attack.done["channels"] += len(offered)
                await web.drain()
            goes = time.monotonic() + min(15.0, attack.seconds_left() * 0.6)

            async def live():
                web.send(SIGN_OF_LIFE)
                await asyncio.sleep(0.3)
                if time.monotonic() > goes:
                    raise EOFError

            await until_over(attack, web, live)

    await attack.many(attack.links, offer)


async def lost(attack):
    """All links offer the same publishers, and are lost: one after the other, then all together."""
    turns = itertools.count()
    ages = random.Random(1)

    async def offer():
        turn = next(turns) // attack.links
        own = [[origin(n, bytes(8)) for n in range(k, k + LOST_EACH, 4)] for k in range(1, 5)]
        async with attack.logged_in() as web:
            begin(web)
            for number, name in enumerate(LOST_NAMES, 1):
                say(web, type="offer", channels=[dict(topic(number, name), origins=own[0])])
                for added in own[1:]:
                    say(web, type="origins", channel=number, added=added, removed=[])
                await web.drain()
            attack.done["publishers"] += LOST_EACH * len(LOST_NAMES)
            now = time.monotonic()
            each, together = now + ages.uniform(0.3, 2.0), now + 1.0 - now % 1.0
            goes = together if turn % 2 else each

            async def live():
                web.send(SIGN_OF_LIFE)
                await asyncio.sleep(max(0.0, min(0.3, goes - time.monotonic())))
                if time.monotonic() >= goes:
                    attack.done["lost"] += 1
                    raise EOFError

            await until_over(attack, web, live)

    await attack.many(attack.links, offer)


async def gone(attack):
    """All links demand a topic of which each message counts, and are lost for good."""

    async def watch():
        async with attack.logged_in() as web:
            begin(web, "/t/**")
            await demand(web, "/t/events", resume=True)
            goes = time.monotonic() + 2.0
            while time.monotonic() < goes:
                with contextlib.suppress(asyncio.TimeoutError):
                    await web.recv(0.1)
                acknowledge(web)
        attack.done["gone"] += 1
        await asyncio.sleep(attack.seconds_left())

    await attack.many(attack.links, watch)


async def readers(attack):
    """All links demand 25 MB/s, read what comes, and acknowledge it."""

    async def read():
        async with attack.logged_in() as web:
            begin(web, "/t/**")
            await demand(web, "/t/large")
            while attack.seconds_left():
                before = web.received
                with contextlib.suppress(asyncio.TimeoutError):
                    await web.recv(0.2)
                attack.done["bytes"] += web.received - before
                acknowledge(web)

    await attack.many(attack.links, read)


async def unplaced(attack):
    """Each link offers topics or services of its own, more than find a place together."""
    turns = itertools.count(1)

    async def offer():
        turn = next(turns)
        service = {"kind": "service", "type": CALLED, "epoch": 1}
        async with attack.logged_in() as web:
            begin(web)
            own = f"/o/{os.urandom(4).hex()}n"
            for first in range(1, UNPLACED, 250):
                offered = [topic(n, f"{own}{n}") for n in range(first, first + 250)]
                if turn % 2 == 0:
                    named = [(c["channel"], c["name"]) for c in offered]
                    offered = [{"channel": n, "name": name, **service} for n, name in named]
                say(web, type="offer", channels=offered)
                attack.done["topics" if turn % 2 else "services"] += len(offered)
                await web.drain()

            async def live():
                web.send(SIGN_OF_LIFE)
                await asyncio.sleep(0.3)

            await until_over(attack, web, live)

    await attack.many(attack.links, offer)


async def toggles(attack):
    """Each link demands the latched topics of a node, and does not, each millisecond."""

    async def toggle():
        async with attack.logged_in() as web:
            begin(web, "/t/**")
            channels = set()
            while len(channels) < LATCHED:
                offer = await told(web, "offer")
                channels |= {c["channel"] for c in offer["channels"] if "/t/latched" in c["name"]}
            numbers = itertools.count(1)

            async def both():
                for number in (next(numbers), 0):
                    demands = [dict(channel=channel, number=number) for channel in sorted(channels)]
                    say(web, type="demand", channels=demands)
                attack.done["toggles"] += 1
                await web.drain()
                await asyncio.sleep(0.001)

            await until_over(attack, web, both)

    await attack.many(attack.links, toggle)


async def frames(attack):
    """Packets that are full of frames which take effect, as fast as they can be sent."""
    packet = encode_packet([dict(type="time_request", t1=n) for n in range(1, 1001)])

    async def send():
        async with attack.logged_in() as web:
            begin(web)

            async def some():
                for _ in range(10):
                    web.send(packet)
                attack.done["packets"] += 10
                await web.drain()

            await until_over(attack, web, some)

    await attack.many(attack.links, send)


async def channels(attack):
    """5,000 topics of one peer, then as many as it may have, withdrawn at once; again and again."""
    turns = itertools.count()

    async def offer():
        count, back = ((5000, False), (4000, True))[next(turns) % 2]
        async with attack.logged_in() as web:
            begin(web)
            for first in range(1, count, 250):
                offered = [topic(n, f"/o/many{n}") for n in range(first, first + 250)]
                say(web, type="offer", channels=offered)
                attack.done["channels"] += len(offered)
                await web.drain()
            if back:
                say(web, type="withdraw", channels=list(range(1, count + 1)))
            await web.until_closed(1)

    await attack.many(1, offer)
