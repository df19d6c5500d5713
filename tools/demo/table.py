"""The live table: per topic and side what its subscribers see and what the bridge dropped."""

import collections

_WINDOW_SECONDS = 3.0
_HEAD = (
    f"{'topic':<15}{'direction':<20}{'seen at':<10}"
    f"{'msg/s':>7}{'kB/s':>8}{'MB':>8}{'latency ms':>12}  dropped"
)


class Seen:
    """The reports of one side's subscribers over the last seconds."""

    def __init__(self):
        self._reports = collections.deque()

    def add(self, report):
        self._reports.append(report)
        while self._reports[-1]["time"] - self._reports[0]["time"] > _WINDOW_SECONDS:
            self._reports.popleft()

    def messages(self, topic):
        return self._reports[-1]["topics"][topic]["messages"] if self._reports else 0

    def calls(self, name):
        return self._reports[-1]["calls"][name]["done"] if self._reports else 0

    def call_cells(self, name):
        if not self.calls(name):
            return f"{'-':>9}{'-':>9}{'-':>12}"
        first, last = self._reports[0], self._reports[-1]
        done = last["calls"][name]["done"] - first["calls"][name]["done"]
        late = [r["calls"][name]["latency_ms"] for r in self._reports]
        late = [ms for ms in late if ms is not None]
        latency = f"{sum(late) / len(late):.2f}" if late else "-"
        rate = done / (last["time"] - first["time"] or 1)
        return f"{self.calls(name):>9}{rate:>9.1f}{latency:>12}"

    def frames(self):
        return self._reports[-1]["frames"] if self._reports else []

    def cells(self, topic):
        if not self.messages(topic):
            return f"{'-':>7}{'-':>8}{'-':>8}{'-':>12}"
        first, last = self._reports[0], self._reports[-1]
        before, now = first["topics"][topic], last["topics"][topic]
        seconds = last["time"] - first["time"] or 1
        late = [r["topics"][topic]["latency_ms"] for r in self._reports]
        late = [ms for ms in late if ms is not None]
        latency = f"{sum(late) / len(late):.2f}" if late else "-"
        return (
            f"{(now['messages'] - before['messages']) / seconds:>7.1f}"
            f"{(now['bytes'] - before['bytes']) / seconds / 1000:>8.1f}"
            f"{now['bytes'] / 1e6:>8.3f}{latency:>12}"
        )


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
            first = place == ("robot" if outward else "operator")
            direction = "robot -> operator" if outward else "operator -> robot"
            cells = seen.cells(topic)
            if topic == "/tf_static":
                cells = f"{f'{len(seen.frames())} of {frames} frames':>35}"
            out.append(
                f"{topic if first else '':<15}{direction if first else '':<20}{place:<10}{cells}  "
                f"{dropped(side.topic(topic))}"
            )
    head = f"{'call':<15}{'':<20}{'by':<10}{'answered':>9}{'calls/s':>9}{'latency ms':>12}"
    out += ["", head, "-" * len(head)]
    for name, kind in calls.items():
        out.append(f"{name:<15}{kind:<20}{'operator':<10}{operator.call_cells(name)}")
    return out
