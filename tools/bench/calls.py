"""Service calls: round trips and rates, in one graph and through the bridge, beside topics."""

import statistics

from harness.domains import take_domains
from measure import percentile
from report import _aligned, _figure
from stage import Missing, Path, plain_path

WINDOWS = (1, 8, 64)
SIZE = 12
WAYS = ("local", "bridged")
# A bridged call is a local call in each of two graphs, on the same cores: no bridge can be faster
# than two graphs that call at the same time.
PAIR = ("local", "second")


def _path(shop, kind):
    """The operator calls and pings, the robot serves and echoes."""
    path = Path(kind)
    try:
        if kind == "bridged":
            path.bridge = shop.bridge()
            robot, operator = path.bridge.domains
        else:
            robot = operator = take_domains(1)[0]
    except Missing as error:
        for tool in ("call", "ping"):
            path.missing()[tool] = str(error)
        return path
    for tool, domain in (("serve", robot), ("echo", robot), ("call", operator), ("ping", operator)):
        path.add(tool, lambda t=tool, d=domain: shop.worker("ros_bench", t, domain=d))
    return path


def calls(shop, rounds, samples, seconds):
    """path -> its round trips (calls, topic), and calls per second with so many under way."""
    paths = {kind: _path(shop, kind) for kind in (*WAYS, "second")}
    web = plain_path(shop, "ws")
    asked = {
        **{(kind, "call"): f"call size={SIZE} samples={samples} gap=0.001" for kind in WAYS},
        **{(kind, "ping"): f"ping size={SIZE} samples={samples} gap=0.001" for kind in WAYS},
    }
    times = {key: [] for key in (*asked, ("ws", "ping"))}
    rates = {(kind, window): [] for kind in (*WAYS, "pair") for window in WINDOWS}
    lost = 0
    for _ in range(rounds):
        for (kind, tool), command in asked.items():
            answer = paths[kind].tool(tool).ask(command, 120)
            lost += answer["lost"] + answer["wrong"]
            times[kind, tool].append(answer["ms"])
        answer = web.tool("ping").ask(f"ping size={SIZE} samples={samples} gap=0.001", 120)
        times["ws", "ping"].append(answer["ms"])
        for (kind, window), found in rates.items():
            callers = [paths[way].tool("call") for way in (PAIR if kind == "pair" else (kind,))]
            for caller in callers:
                caller.say(f"call size={SIZE} window={window} seconds={seconds}")
            answers = [caller.answer(seconds + 60) for caller in callers]
            lost += sum(answer["lost"] + answer["wrong"] for answer in answers)
            found.append(statistics.mean(answer["per_second"] for answer in answers))
    result = {"lost": lost, "round_trips": {}, "rates": {}}
    for (kind, tool), rounds_ms in times.items():
        pooled = [ms for one in rounds_ms for ms in one]
        result["round_trips"][f"{kind} {tool}"] = {
            "p50": percentile(pooled, 50),
            "p99": percentile(pooled, 99),
            "rounds_p50": [percentile(one, 50) for one in rounds_ms],
        }
    for (kind, window), found in rates.items():
        result["rates"][f"{kind} {window}"] = {
            "per_second": statistics.median(found),
            "rounds": found,
        }
    return result


def figures(result):
    if "missing" in result:
        return [_figure("calls", None, "ms", ("<=", 1.2), note=result["missing"])]
    trips, rates = result["round_trips"], result["rates"]
    rounds = zip(
        *(trips[name]["rounds_p50"] for name in ("bridged call", "local call", "ws ping"))
    )
    ratio = statistics.median(bridged / (2 * local + web) for bridged, local, web in rounds)
    made = [
        _figure(
            f"call round trip p50, {SIZE} B",
            trips["bridged call"]["p50"],
            "ms",
            ("<=", 1.2),
            ratio,
            note=f"local {trips['local call']['p50']:.3f} ms; a topic of the same size"
            f" {trips['bridged ping']['p50']:.3f} ms",
        ),
        _figure(
            f"call round trip p99, {SIZE} B",
            trips["bridged call"]["p99"],
            "ms",
            None,
            note=f"local {trips['local call']['p99']:.3f} ms; a topic of the same size"
            f" {trips['bridged ping']['p99']:.3f} ms",
        ),
    ]
    for window in WINDOWS:
        bridged, local, pair = (
            rates[f"{kind} {window}"]["per_second"] for kind in ("bridged", "local", "pair")
        )
        made.append(
            _figure(
                f"calls, {window} under way",
                bridged,
                "calls/s",
                (">=", 0.7) if window == 8 else None,
                bridged / local,
                note=f"{result['lost']} lost"
                if result["lost"]
                else f"{bridged / pair:.2f}x of each of two graphs that call at once",
            )
        )
    return made


def table(result):
    rows = [("12 B, p50 / p99 in ms", "call", "topic", *(f"{w} under way" for w in WINDOWS))]
    rates = result["rates"]
    for kind in WAYS:
        cells = (result["round_trips"][f"{kind} {tool}"] for tool in ("call", "ping"))
        own = (rates[f"{kind} {window}"]["per_second"] for window in WINDOWS)
        rows.append(
            (
                kind,
                *(f"{cell['p50']:.3f} / {cell['p99']:.3f}" for cell in cells),
                *(f"{rate:,.0f} calls/s" for rate in own),
            )
        )
    pair = (rates[f"pair {window}"]["per_second"] for window in WINDOWS)
    rows.append(("local, two at once", "", "", *(f"{rate:,.0f} calls/s each" for rate in pair)))
    return _aligned(rows)
