"""The live table: per topic and side what its subscribers see and what the bridge dropped."""

import statistics

_WINDOW_SECONDS = 3.0
_HEAD = (
    f"{'topic':<15}{'seen at':<13}"
    f"{'msg/s':>7}{'kB/s':>9}{'MB':>10}{'median ms':>11}  dropped"
)
_NOTHING = f"{'-':>7}{'-':>9}{'-':>10}{'-':>11}"


def _median(reports):
    """Of all latencies in the reports, in ms."""
    late = [ms for report in reports for ms in report["late_ms"]]
    return f"{statistics.median(late):.2f}" if late else "-"


class Seen:
    """The reports of one side's subscribers over the last seconds."""

    def __init__(self):
        self._reports = []

    def add(self, report):
        """In a thread of its own: the list is replaced, since others may be reading it."""
        begin = report["time"] - _WINDOW_SECONDS
        self._reports = [r for r in self._reports if r["time"] >= begin] + [report]

    def messages(self, topic):
        reports = self._reports
        return reports[-1]["topics"][topic]["messages"] if reports else 0

    def calls(self, name):
        reports = self._reports
        return reports[-1]["calls"][name]["done"] if reports else 0

    def frames(self):
        reports = self._reports
        return reports[-1]["frames"] if reports else []

    def cells(self, topic):
        """Before its first message there is no rate."""
        reports = [r for r in self._reports if r["topics"][topic]["messages"]]
        if not reports:
            return _NOTHING
        seconds = reports[-1]["time"] - reports[0]["time"] or 1
        before, now = reports[0]["topics"][topic], reports[-1]["topics"][topic]
        return (
            f"{(now['messages'] - before['messages']) / seconds:>7.1f}"
            f"{(now['bytes'] - before['bytes']) / seconds / 1000:>9.1f}"
            f"{now['bytes'] / 1e6:>10.3f}{_median(r['topics'][topic] for r in reports):>11}"
        )

    def call_cells(self, name):
        reports = [r for r in self._reports if r["calls"][name]["done"]]
        if not reports:
            return f"{'-':>13}{'-':>8}{'-':>11}"
        seconds = reports[-1]["time"] - reports[0]["time"] or 1
        before, now = reports[0]["calls"][name]["done"], reports[-1]["calls"][name]["done"]
        late = _median(r["calls"][name] for r in reports)
        return f"{now:>13}{(now - before) / seconds:>8.1f}{late:>11}"


def dropped(entry):
    """In words what the bridge dropped of a topic at one side."""
    if not entry:
        return "-"
    reasons = {reason: count for reason, count in entry.get("dropped", {}).items() if count}
    return ", ".join(f"{count} {reason}" for reason, count in reasons.items()) or "0"


def lines(routes, calls, robot, operator, bridge, frames):
    """routes: topic -> True from robot to operator; frames: how many are on /tf_static;
    calls: name -> service, action or parameter."""
    out = [_HEAD, "-" * len(_HEAD)]
    for topic, outward in routes.items():
        ends = [("robot", robot, bridge.server), ("operator", operator, bridge.client)]
        for place, seen, side in ends if outward else reversed(ends):
            from_here = place == ("robot" if outward else "operator")
            cells = seen.cells(topic)
            if topic == "/tf_static":
                cells = f"{f'{len(seen.frames())} of {frames} frames':>{len(_NOTHING)}}"
            names = f"{topic:<15}{place:<13}" if from_here else f"{'':<15}{f'-> {place}':<13}"
            out.append(f"{names}{cells}  {dropped(side.topic(topic))}")
    head = f"{'call':<15}{'':<18}{'answered':>13}{'calls/s':>8}{'median ms':>11}"
    out += ["", head, "-" * len(head)]
    for name, kind in calls.items():
        out.append(f"{name:<15}{kind:<18}{operator.call_cells(name)}")
    return out
