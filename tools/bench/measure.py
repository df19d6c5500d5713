"""The measurements. Each visits all paths in turn, round after round, so that noise affects all
equally."""

import statistics
import time

from harness.domains import take_domains
from stage import Missing

SIZES = (12, 1000, 10_000, 100_000, 500_000, 2_000_000)
# Messages on their way unacknowledged; each path is judged by the window that is best for it.
# None is larger than the depth of the queues: nothing may be lost.
WINDOWS = {12: (32, 100), 10_000: (32, 100), 500_000: (1, 4, 16)}

PLAIN = ("ws", "tcp")  # their window is the kernel's


def only_sizes(sizes):
    """Restricts the measurements to these."""
    global SIZES, WINDOWS
    SIZES = tuple(sizes)
    WINDOWS = {size: windows for size, windows in WINDOWS.items() if size in sizes}


def percentile(values, percent):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(percent / 100 * len(ordered)))] if ordered else None


def visit(paths, name, missing, action):
    """Does something on a path; a failure makes it missing for this measurement."""
    if name in missing:
        return None
    try:
        return action(paths[name])
    except Missing as error:
        missing[name] = str(error)
        return None


def round_trips(paths, rounds, samples):
    """path -> size -> p50 and p99 of all rounds, the median of each round, lost."""
    times = {name: {size: [] for size in SIZES} for name in paths}
    lost = {name: {size: 0 for size in SIZES} for name in paths}
    missing = {}
    for _ in range(rounds):
        for size in SIZES:
            count = samples if size < 1_000_000 else max(samples // 8, 8)
            for name in paths:
                answer = visit(
                    paths,
                    name,
                    missing,
                    lambda path: path.tool("ping").ask(f"ping size={size} samples={count}", 120),
                )
                if answer:
                    times[name][size].append(answer["ms"])
                    lost[name][size] += answer["lost"] + answer["wrong"]
    result = {}
    for name in paths:
        result[name] = {"missing": missing.get(name)}
        for size in SIZES:
            pooled = [ms for one in times[name][size] for ms in one]
            if pooled:
                result[name][str(size)] = {
                    "p50": percentile(pooled, 50),
                    "p99": percentile(pooled, 99),
                    "samples": len(pooled),
                    "lost": lost[name][size],
                    "rounds_p50": [percentile(one, 50) for one in times[name][size] if one],
                }
    return result


def _better(one, other):
    return other is None or (not one["lost"], one["per_second"]) > (
        not other["lost"],
        other["per_second"],
    )


def throughput(paths, rounds, seconds):
    """path -> size -> messages per second and MB/s with the best window, lost in all rounds."""
    missing = {}
    answers = {name: {size: {} for size in WINDOWS} for name in paths}

    def flood(name, size, window):
        answer = visit(
            paths,
            name,
            missing,
            lambda path: path.tool("source").ask(
                f"flood size={size} window={window} seconds={seconds}", 60
            ),
        )
        if answer:
            answers[name][size].setdefault(window, []).append(answer)

    best = {}
    for number in range(rounds):
        for size, windows in WINDOWS.items():
            for name in paths:
                for window in windows if name not in PLAIN else windows[:1]:
                    if number == 0 or best.get((name, size)) == window:
                        flood(name, size, window)
        for size in WINDOWS:
            for name in paths:
                found = None
                for window, runs in answers[name][size].items():
                    if number == 0 and _better(runs[0], found):
                        found, best[name, size] = runs[0], window
    result = {name: {"missing": missing.get(name)} for name in paths}
    for (name, size), window in best.items():
        runs = answers[name][size][window]
        rate = statistics.median(run["per_second"] for run in runs)
        result[name][str(size)] = {
            "per_second": rate,
            "MB_per_second": rate * size / 1e6,
            "window": window,
            "lost": sum(run["lost"] for run in runs),
            "rounds": [run["per_second"] for run in runs],
        }
    return result


def _stream(path, seconds, programs):
    """CPU of programs during 10 kB at 100 Hz, as a share of one core; and how much of it
    arrived."""
    path.tool("listen").ask("count")
    before = {name: program.cpu_seconds() for name, program in programs.items()}
    begin = time.monotonic()
    sent = path.tool("talk").ask(f"talk size=10000 hz=100 seconds={seconds}", seconds + 30)["sent"]
    elapsed = time.monotonic() - begin
    share = {
        name: (program.cpu_seconds() - before[name]) / elapsed for name, program in programs.items()
    }
    time.sleep(0.5)  # the listener answers when nothing has come for a while
    return share, sent, path.tool("listen").ask("count")["count"]


def cpu_per_message(local, bridged, rounds, seconds):
    """Shares of a core of server, client, bare subscriber and bare publisher."""
    if bridged.bridge is None:
        bridged.tool("talk")  # raises: it says why
    shares = {"server": [], "client": [], "subscriber": [], "publisher": []}
    sent = received = 0
    programs = {"server": bridged.bridge.server, "client": bridged.bridge.client}
    bare_programs = {"subscriber": local.tool("listen"), "publisher": local.tool("talk")}
    _stream(bridged, 1, programs)  # demand arises
    for _ in range(rounds):
        share, some, there = _stream(bridged, seconds, programs)
        sent, received = sent + some, received + there
        bare = _stream(local, seconds, bare_programs)[0]
        for name, value in {**share, **bare}.items():
            shares[name].append(value)
    return {
        "share_of_core": {name: statistics.median(values) for name, values in shares.items()},
        "rounds": shares,
        "sent": sent,
        "received": received,
    }


def _watched(programs, seconds):
    before = {name: program.cpu_seconds() for name, program in programs.items()}
    begin = time.monotonic()
    time.sleep(seconds)
    elapsed = time.monotonic() - begin
    return {
        name: {
            "resident_MB": program.resident_bytes() / 1e6,
            "share_of_core": (program.cpu_seconds() - before[name]) / elapsed,
        }
        for name, program in programs.items()
    }


def idle(shop, seconds):
    """Memory and CPU of a fresh bridge with one link, without topics and with 300 idle ones."""
    bridge = shop.bridge()
    node = shop.worker("ros_bench", "idle", domain=bridge.domains[1])
    node.ready()
    time.sleep(3)
    programs = {"server": bridge.server, "client": bridge.client, "bare node": node}
    result = {"alone": _watched(programs, seconds)}
    shop.worker("ros_bench", "topics", "count=300", domain=bridge.domains[0]).ready()
    lonely = shop.worker("ros_bench", "idle", domain=take_domains(1)[0])
    lonely.ready()
    result["mirrored"] = _mirrored(bridge, 300)
    time.sleep(3)
    result["300 topics"] = _watched(dict(programs, **{"bare node alone": lonely}), seconds)
    return result


def _mirrored(bridge, count):
    """How many of the idle topics the client has; None where its status does not tell."""
    end = time.monotonic() + 20
    while True:
        links = bridge.client.status().get("links")
        found = (
            sum(topic.get("topic", "").startswith("/bench/idle_") for topic in links[0]["topics"])
            if links
            else None
        )
        if time.monotonic() > end or (found or 0) >= count:
            return found
        time.sleep(0.5)


def mixed(paths, rounds, seconds):
    """12 B at 50 Hz alone, and together with 500 kB at 100 Hz in the direction of the answers."""
    missing = {}
    times = {name: {"alone": [], "beside": []} for name in paths}
    lost = {name: {"alone": 0, "beside": 0} for name in paths}
    bulk = {name: [0, 0] for name in paths}
    lag = {}

    def ping(path, kind):
        answer = path.tool("ping").ask(
            f"ping size=12 hz=50 samples={int(50 * seconds)} timeout=2", seconds + 60
        )
        times[path.name][kind].extend(answer["ms"])
        lost[path.name][kind] += answer["lost"]

    def beside(path):
        path.tool("listen").ask("count")
        path.tool("talk").say(f"talk size=500000 hz=100 seconds={seconds + 1}")
        time.sleep(0.5)
        ping(path, "beside")
        if path.bridge:
            for side in path.bridge.sides:
                if "loop_lag_ms" in side.status():
                    lag.setdefault(side.name, []).append(side.status()["loop_lag_ms"])
        bulk[path.name][0] += path.tool("talk").answer(seconds + 60)["sent"]
        time.sleep(0.5)
        bulk[path.name][1] += path.tool("listen").ask("count")["count"]

    for _ in range(rounds):
        for name in paths:
            visit(paths, name, missing, lambda path: ping(path, "alone"))
            visit(paths, name, missing, beside)
    result = {"loop_lag_ms": lag}
    for name in paths:
        result[name] = {
            "missing": missing.get(name),
            "bulk_sent": bulk[name][0],
            "bulk_received": bulk[name][1],
        }
        for kind, values in times[name].items():
            result[name][kind] = {
                "p50": percentile(values, 50),
                "p99": percentile(values, 99),
                "samples": len(values),
                "lost": lost[name][kind],
            }
    return result
