"""The cases of tools/bench/wan in which more is published than the path carries: is what arrives
young?"""

import time

from harness.wan import words
from measure import percentile
from wan_breaks import meet, talked
from wan_cases import NET, Cost, Row, raw_goodput

# size of a message, bits per second that the path has: the larger ones take 0.05 and 0.22 s each
PATHS = [(2_000, 2_000_000), (50_000, 8_000_000), (500_000, 18_000_000)]
SETTLED = 3  # s: from then on ages count


def now(bed, effort):
    """A state that is published 1.06 to 10 times as fast as the path carries it, by best effort and
    reliably; ten of them at once; a burst; and events, of which none may be lost."""
    rows = []
    for size, rate in PATHS:
        bed.wan.set(**{**NET, "up": rate})
        carried = raw_goodput(bed, "up", 2)
        for reliable in (0, 1):
            ends = talked(bed, f"name=/wan/now_{size}_{reliable}", f"reliable={reliable}")
            meet(*ends)
            for factor in effort["factors_of_now"]:
                how = "reliable" if reliable else "best effort"
                case = f"{size // 1000} kB at {factor} x the path, {how}"
                told = {"size": size, "hz": factor * carried / size}
                rows.append(young(bed, effort, case, ends, told, carried))
    return rows + [shared(bed, effort), burst(bed)]


def young(bed, effort, case, ends, told, carried):
    talk, listen = ends
    cost, (heard,) = run(bed, effort, talk, listen, told)
    row = Row(case, cost=cost)
    takes = told["size"] / carried
    row.judge("age p99, ms", percentile(heard["age_ms"], 99), "<=", age_most(takes))
    least = 0.95 * effort["seconds_of_now"] / takes
    return row.judge("arrived", len(heard["at"]), ">=", int(least))


def age_most(takes):
    """ms. takes: s that a message needs on the path."""
    return 1000 * (1.5 * (2 * takes + NET["delay"]) + 0.1)


def run(bed, effort, talk, listen, told):
    """Cost, and what each topic heard after the first seconds."""
    seconds = SETTLED + effort["seconds_of_now"]
    talk.say(words("talk", {**told, "seconds": seconds}))
    time.sleep(SETTLED)
    listen.ask("count")
    cost = Cost(bed)
    time.sleep(effort["seconds_of_now"])
    heard = listen.ask("count")["topics"]
    cost.stop()
    talk.answer(seconds + 30)
    time.sleep(1.5)
    listen.ask("count")
    return cost, heard


def shared(bed, effort):
    """Ten publishers of 10 kB that together publish twice what the path carries."""
    size = 10_000
    bed.wan.set(**{**NET, "up": 8_000_000})
    carried = raw_goodput(bed, "up", 2)
    talk, listen = talked(bed, "name=/wan/now_ten", "topics=10")
    meet(talk, listen)
    cost, heard = run(bed, effort, talk, listen, {"size": size, "hz": 2 * carried / size / 10})
    row = Row("ten of 10 kB, together 2 x the path", cost=cost)
    ages = [percentile(topic["age_ms"], 99) for topic in heard]
    row.judge("age p99 of the worst, ms", max(ages), "<=", age_most(10 * size / carried))
    counts = [len(topic["at"]) for topic in heard]
    mean = sum(counts) / len(counts)
    row.judge("most / mean", max(counts) / mean, "<=", 1.25)
    return row.judge("least / mean", min(counts) / mean, ">=", 0.75)


def burst(bed):
    """100 messages of 2 kB at once, reliable, and none after them."""
    bed.wan.set(**{**NET, "up": 800_000})
    talk, listen = talked(bed, "name=/wan/event_burst", "reliable=1")
    meet(talk, listen)
    cost = Cost(bed)
    sent = talk.ask(words("talk", {"size": 2000, "hz": 10_000, "seconds": 0.01}))["sent"]
    time.sleep(6)
    row = Row("a burst of 100 messages of 2 kB on 100 kB/s", cost=cost.stop())
    return row.judge("missing", sent - len(listen.ask("count")["topics"][0]["at"]), "<=", 0)
