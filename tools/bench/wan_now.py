"""The cases of tools/bench/wan in which more is published than the path carries: is what arrives
young?"""

import time

from harness.wan import words
from measure import percentile
from wan_breaks import fresh, meet, talked
from wan_cases import NET, Cost, Row, raw_goodput

# size of a message, bits per second that the path has: the larger ones take 0.05 and 0.22 s each
PATHS = [(2_000, 2_000_000), (50_000, 8_000_000), (500_000, 18_000_000)]
SETTLED = 3  # s: from then on ages count
# What its publisher asks for changes nothing; ends need names of their own.
QOS = {
    "latched": ("latched=1", "depth=1"),
    "depth 1": ("depth=1",),
    "depth 1000": ("depth=1000",),
}


def now(bed, effort):
    """A state that is published 1.06 to 10 times as fast as the path carries it, by best effort,
    reliably, latched and with any depth; ten of them at once; a burst, and events beside an
    overload, of which none may be lost; stops under a rate; a path that is gone."""
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
    size, rate = PATHS[1]
    bed.wan.set(**{**NET, "up": rate})
    carried = raw_goodput(bed, "up", 2)
    for number, (how, qos) in enumerate(QOS.items()):
        ends = talked(bed, f"name=/wan/now_qos{number}", *qos)
        meet(*ends)
        told = {"size": size, "hz": 2 * carried / size}
        case = f"{size // 1000} kB at 2 x the path, reliable, {how}"
        rows.append(young(bed, effort, case, ends, told, carried))
    rows += [shared(bed, effort), burst(bed), events(bed, effort, size, carried), stops(bed)]
    return rows + [gone(bed, effort)]


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


def events(bed, effort, size, carried):
    """As logs and parameter events: 20 a second of 200 B, beside twice what the path carries."""
    bed.wan.set(**{**NET, "up": PATHS[1][1]})
    states = talked(bed, "name=/wan/now_beside")
    talk, listen = talked(bed, "name=/wan/event_beside", "reliable=1")
    for ends in (states, (talk, listen)):
        meet(*ends)
    cost, seconds = Cost(bed), effort["seconds_of_now"]
    states[0].say(words("talk", {"size": size, "hz": 2 * carried / size, "seconds": seconds + 1}))
    sent = talk.ask(words("talk", {"size": 200, "hz": 20, "seconds": seconds}))["sent"]
    states[0].answer(seconds + 30)
    time.sleep(2)
    heard = listen.ask("count")["topics"][0]
    row = Row("events of 200 B at 20 Hz beside 2 x the path", cost=cost.stop())
    row.judge("missing", sent - heard["count"], "<=", 0)
    return row.judge("age p99, ms", percentile(heard["age_ms"], 99), "<=", 500)


def stops(bed):
    """Ten times a command at 50 Hz that ends with a stop, under `max_rate: 10`."""
    bed.wan.set(**NET)
    talk, listen = talked(bed, "name=/wan/stop")
    meet(talk, listen)
    cost, arrived, late = Cost(bed), 0, []
    for _ in range(10):
        sent = talk.ask(words("talk", {"size": 48, "hz": 50, "seconds": 1}))["sent"]
        time.sleep(0.4)
        heard = listen.ask("count")["topics"][0]
        if heard["count"] and heard["last"] == sent:
            arrived += 1
            late.append(heard["age_ms"][-1])
    row = Row("ten stops under max_rate 10", cost=cost.stop())
    row.judge("arrived", arrived, ">=", 10)
    most = 100 + 1000 * NET["delay"] + 30
    return row.judge("the latest, ms", max(late, default=None), "<=", most)


def gone(bed, effort):
    """A path that is gone: what is new arrives soon after it is back, of each topic."""
    streams = {
        "tf": ({"size": 500, "hz": 50}, "reliable=1"),
        "joints": ({"size": 400, "hz": 50}, "reliable=1"),
        "cloud": ({"size": 15_000, "hz": 3}, "reliable=1"),
        "image": ({"size": 20_000, "hz": 10}, "reliable=0"),
    }
    bed.wan.set(**{**NET, "up": 8_000_000})
    ends = {what: talked(bed, f"name=/wan/now_{what}", qos) for what, (_, qos) in streams.items()}
    for pair in ends.values():
        meet(*pair)
    seconds = effort["seconds_without_path"]
    cost = Cost(bed)
    for what, (told, _) in streams.items():
        ends[what][0].say(words("talk", {**told, "seconds": seconds + 7}))
    time.sleep(2)
    bed.wan.cut()
    time.sleep(seconds)
    healed = time.monotonic()
    bed.wan.heal()
    for talk, _ in ends.values():
        talk.answer(seconds + 60)
    time.sleep(1)
    row = Row(f"{seconds} s without a path, four topics", cost=cost.stop())
    most = 1.5 + 8 * 2 * NET["delay"]
    for what, (told, _) in streams.items():
        heard = ends[what][1].ask("count")["topics"][0]
        row.judge(f"{what}: first new one, s", min(fresh(heard, healed), default=None), "<=",
                  most + 1 / told["hz"])
        later = [age for at, age in zip(heard["at"], heard["age_ms"]) if at > healed + most]
        row.judge(f"{what}: its age later, ms", max(later, default=None), "<=", 200)
    return row
