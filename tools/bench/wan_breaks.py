"""The cases of tools/bench/wan in which nothing crosses for a while."""

import time

from harness.wan import OPERATOR, ROBOT, words
from wan_cases import NET, Cost, Row

DROPOUTS = [0.5, 1.0, 1.6, 2.2, 2.7]  # s


def cut(bed, effort):
    """Nothing crosses for a while: a reliable topic is continued, a camera is fresh, and commands
    beside them come at once."""
    seconds = effort["seconds_of_cut"]
    bed.wan.set(**NET)
    rows = []
    for case, stream, reliable in (
        ("reliable, 1 kB at 20 Hz", {"size": 1000, "hz": 20}, 1),
        ("camera, best effort, 100 kB at 15 Hz", {"size": 100_000, "hz": 15}, 0),
    ):
        entity = (f"name=/wan/cut_{reliable}", f"reliable={reliable}")
        ends = talk, listen = talked(bed, *entity)
        others = urgent, commanded = talked(bed, f"name=/wan/pong_cut_{reliable}")
        meet(*ends)
        meet(*others)
        cost = Cost(bed)
        talk.say(words("talk", {**stream, "seconds": seconds + 6}))
        urgent.say(words("talk", {"size": 12, "hz": 50, "seconds": seconds + 6}))
        time.sleep(1)
        bed.wan.cut()
        time.sleep(seconds)
        healed = time.monotonic()
        bed.wan.heal()
        sent = talk.answer(seconds + 60)["sent"]
        urgent.answer(seconds + 60)
        time.sleep(3)
        row = Row(f"cut for {seconds} s: {case}", cost=cost.stop())
        commands = fresh(commanded.ask("count")["topics"][0], healed)
        row.judge("first command, s", min(commands, default=None), "<=", 1.0)
        rows.append(after_cut(row, listen.ask("count")["topics"][0], sent, healed))
    return rows


def dropouts(bed, effort):
    """Nothing crosses for a moment shorter than `dead_after`: the connection stays, and commands
    come again as soon as TCP sends again."""
    bed.wan.set(**NET)
    talk, listen = talked(bed, "name=/wan/pong_dropouts")
    meet(talk, listen)
    lengths = effort["dropouts_of_each"] * DROPOUTS
    lasting = sum(lengths) + 4 * len(lengths)
    cost = Cost(bed)
    talk.say(words("talk", {"size": 12, "hz": 50, "seconds": lasting}))
    healed = []
    for length in lengths:
        time.sleep(3)
        bed.wan.cut()
        time.sleep(length)
        healed.append(time.monotonic())
        bed.wan.heal()
    talk.answer(lasting + 60)
    time.sleep(1)
    heard = listen.ask("count")["topics"][0]
    first = [min(fresh(heard, end), default=None) for end in healed]
    case = f"{len(lengths)} dropouts of {DROPOUTS[0]} to {DROPOUTS[-1]} s"
    row = Row(case, cost=cost.stop())
    lost = None in first
    row.judge("first command, s, on average", None if lost else sum(first) / len(first), "<=", 0.5)
    return [row.judge("at the latest", None if lost else max(first), "<=", 1.0)]


def talked(bed, *entity):
    """A stream from the robot: its two ends."""
    return (
        bed.worker(ROBOT, "wan_bench", "talk", *entity),
        bed.worker(OPERATOR, "wan_bench", "listen", *entity),
    )


def meet(talk, listen):
    """Until what one publishes reaches the other: discovery takes long on a busy machine."""
    talk.ready()
    listen.ready()
    for _ in range(30):
        talk.ask(words("talk", {"size": 12, "hz": 20, "seconds": 0.05}))
        time.sleep(0.5)
        if listen.ask("count")["topics"][0]["count"]:
            break
    time.sleep(0.5)
    listen.ask("count")  # forgets them


def fresh(heard, since):
    """When what was published since then arrived, s after it."""
    pairs = zip(heard["at"], heard["age_ms"])
    return [at - since for at, age in pairs if at - age / 1000 > since]


def after_cut(row, heard, sent, healed):
    if "reliable" in row.case:
        row.judge("missing", sent - heard["count"] + heard["repeated"], "<=", 0)
        row.judge("repeated or out of order", heard["repeated"] + heard["disordered"], "<=", 0)
        own = fresh(heard, healed)
        return row.judge("its first new one, s", min(own, default=None), "<=", 1.0)
    later = [(at, age) for at, age in zip(heard["at"], heard["age_ms"]) if at > healed]
    row.judge("first frame, s", later[0][0] - healed if later else None, "<=", 1.0)
    return row.judge("its age, ms", later[0][1] if later else None, "<=", 200)
