"""`link.bytes_per_second`: what a side costs on the network, as its status shows it."""

import random
import time

from connect_bridge_test_interfaces.msg import Blob
from geometry_msgs.msg import Twist, Vector3

from conftest import OPEN
from graph import qos, until

CAP = 30_000
SECONDS = 6
NOISE = random.Random(1)  # compression finds nothing


def sent(side):
    """Bytes of IP packets, and when they were read."""
    last = side.status().get("traffic", {})
    until(lambda: side.status().get("traffic", {}) != last, "the status is written again", 5, 0.005)
    return side.status()["traffic"]["sent_bytes"], time.monotonic()


def test_a_link_costs_what_it_may_and_urgent_ones_are_fast(make_pair):
    newest = {"export_topics": ["/t/small"], "keep": "newest"}
    rules = {"rules": ["newest", "all"], "rule": {**OPEN["rule"], "newest": newest}}
    pair = make_pair(server={**rules, "link.bytes_per_second": CAP})
    small, smalls = pair.opened(Blob, "/t/small", Blob(), qos(10))
    large, larges = pair.opened(Blob, "/t/large", Blob(), qos(1))
    steer, steered = pair.opened(Twist, "/t/steer", Twist(), qos(10))
    for collector in (smalls, larges, steered):
        collector.clear()
    said = []
    before = None
    begin = time.monotonic()
    for step in range(50 * (SECONDS + 2)):
        if before is None and step >= 50:
            before = sent(pair.server)
        small.publish(Blob(sequence=step, data=NOISE.randbytes(1000)))  # 50 kB/s
        if step % 5 == 0:
            large.publish(Blob(sequence=step, data=NOISE.randbytes(50_000)))
        if step % 10 == 0:
            said.append(time.monotonic())
            steer.publish(Twist(linear=Vector3(x=float(len(said)))))
        time.sleep(max(0, begin + (step + 1) / 50 - time.monotonic()))
    after = sent(pair.server)
    rate = (after[0] - before[0]) / (after[1] - before[1])
    come = " ".join(str(len(c.messages)) for c in (smalls, larges, steered))
    print(f"{rate:.0f} bytes/s under a cap of {CAP}; small, large, urgent ones: {come}")
    assert 0.7 * CAP < rate <= 1.02 * CAP
    steered.wait(len(said))
    waits = sorted(at - since for at, since in zip(steered.times, said))
    assert waits[len(waits) // 2] < 0.05, waits
    numbers = [m.sequence for m in smalls.messages]
    assert numbers == sorted(set(numbers)) and 350 - numbers[-1] < 100, "the newest come"
    assert pair.server.topic("/t/small", "export")["dropped"]["newer_available"] > 0
