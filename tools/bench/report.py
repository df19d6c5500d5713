"""From measurements to figures with their targets, as a table and as JSON."""

import statistics


def _figure(name, value, unit, reach, ratio=None, aim=None, note=""):
    """reach: (comparison, number) for the ratio, or the value without one; None: not judged."""
    judged = value if ratio is None else ratio
    reached = None
    if reach is not None and judged is not None:
        reached = judged <= reach[1] if reach[0] == "<=" else judged >= reach[1]
    return {
        "figure": name,
        "value": value,
        "unit": unit,
        "ratio": ratio,
        "to_reach": reach,
        "aim": aim,
        "reached": reached,
        "note": note,
    }


def _unless_alone(value, ratio, reach):
    """A target for a ratio does not apply to a value whose other half was not measured."""
    return None if value and ratio is None else reach


def _bytes(size):
    if size < 1000:
        return f"{size} B"
    return f"{size // 1000} kB" if size < 1_000_000 else f"{size // 1_000_000} MB"


def _cell(result, path, size):
    return (result.get(path) or {}).get(str(size))


def _why(result, *paths):
    for path in paths:
        reason = (result.get(path) or {}).get("missing")
        if reason:
            return f"{path}: {reason}"
    return ""


def round_trip_figures(result):
    figures = []
    for profile in ("default", "large"):
        for size in (12, 1000, 10_000, 100_000, 500_000, 2_000_000):
            bridged, local, plain = (
                _cell(result, path, size)
                for path in (f"bridged {profile}", f"local {profile}", "ws")
            )
            ratio = None
            if bridged and local and plain:
                ratio = statistics.median(
                    b / (2 * l + w)
                    for b, l, w in zip(
                        bridged["rounds_p50"], local["rounds_p50"], plain["rounds_p50"]
                    )
                )
            reach = None
            if profile == "default" and size in (12, 10_000, 100_000, 500_000):
                reach = ("<=", 1.05)
            if profile == "large" and size == 2_000_000:
                reach = ("<=", 1.3)
            note = _why(result, f"bridged {profile}", f"local {profile}", "ws")
            relay = _cell(result, "bare relay", size)
            if bridged and relay and profile == "default":
                note = f"{bridged['p50'] / relay['p50']:.2f}x of the bare relay"
            if bridged and bridged["lost"]:
                note = f"{bridged['lost']} lost; {note}"
            figures.append(
                _figure(
                    f"round trip p50, {_bytes(size)}"
                    + (", large-data profile" if profile == "large" else ""),
                    bridged and bridged["p50"],
                    "ms",
                    _unless_alone(bridged, ratio, reach),
                    ratio,
                    note=note,
                )
            )
    return figures


def throughput_figures(result):
    figures = []
    for profile in ("default", "large"):
        for size, least in ((12, 0.85), (10_000, 0.5), (500_000, 0.8)):
            bridged, local = (
                _cell(result, f"{kind} {profile}", size) for kind in ("bridged", "local")
            )
            ratio = bridged["per_second"] / local["per_second"] if bridged and local else None
            unit = "MB_per_second" if size == 500_000 else "per_second"
            figure = _figure(
                f"throughput, {_bytes(size)}"
                + (", large-data profile" if profile == "large" else ""),
                bridged and bridged[unit],
                "MB/s" if size == 500_000 else "msg/s",
                _unless_alone(bridged, ratio, (">=", least))
                if profile == "default" or size == 500_000
                else None,
                ratio,
                aim="650 MB/s" if profile == "large" and size == 500_000 else None,
                note=_why(result, f"bridged {profile}", f"local {profile}"),
            )
            relay = _cell(result, "bare relay", size)
            if bridged and relay and profile == "default":
                share = bridged["per_second"] / relay["per_second"]
                figure["note"] = f"{share:.2f}x of the bare relay"
            if bridged and bridged["lost"]:
                figure["note"] = f"{bridged['lost']} lost; {figure['note']}"
                if figure["reached"]:
                    figure["reached"] = False
            figures.append(figure)
    return figures


def cpu_figures(result):
    if "missing" in result:
        return [
            _figure(
                f"CPU, 10 kB at 100 Hz, {side}", None, "% of a core", reach, note=result["missing"]
            )
            for side, reach in (("exporting side", ("<=", 1.5)), ("importing side", ("<=", 1.3)))
        ]
    share = result["share_of_core"]
    note = (
        ""
        if result["sent"] == result["received"]
        else f"{result['received']} of {result['sent']} arrived"
    )
    return [
        _figure(
            f"CPU, 10 kB at 100 Hz, {side}",
            100 * share[program],
            "% of a core",
            ("<=", least),
            share[program] / share[bare],
            aim="1.6 %",
            note=note,
        )
        for side, program, bare, least in (
            ("exporting side, to a bare subscriber", "server", "subscriber", 1.5),
            ("importing side, to a bare publisher", "client", "publisher", 1.3),
        )
    ]


def idle_figures(result):
    if "missing" in result:
        return [_figure("idle", None, "MB", ("<=", 1.3), note=result["missing"])]
    figures = []
    for kind, name, least in (
        ("alone", "idle, 1 link", 1.3),
        ("300 topics", "300 idle topics", 2.0),
    ):
        for side in ("server", "client"):
            now = result[kind][side]
            bare = result["alone"]["bare node"]["resident_MB"]
            note = f"a bare node: {bare:.1f} MB"
            if kind == "300 topics":
                note += f"; {result['mirrored']} mirrored"
            figures.append(
                _figure(
                    f"resident, {name}, {side}",
                    now["resident_MB"],
                    "MB",
                    ("<=", least),
                    now["resident_MB"] / bare,
                    note=note,
                )
            )
            figures.append(
                _figure(
                    f"CPU, {name}, {side}",
                    100 * now["share_of_core"],
                    "% of a core",
                    ("<=", 0.3) if kind == "alone" else None,
                )
            )
    return figures


def mixed_figures(result):
    figures = []
    for path, reach in (
        ("bridged default", ("<=", 3)),
        ("local default", None),
        ("one node default", None),
        ("bridged large", None),
        ("local large", None),
        ("one node large", None),
    ):
        found = result.get(path) or {}
        alone, beside = (found.get(kind, {}).get("p99") for kind in ("alone", "beside"))
        ratio = beside / alone if alone and beside else None
        if reach is None and not found:
            continue
        note = found.get("missing") or ""
        if alone:
            arrived = f"{found['bulk_received']} of {found['bulk_sent']} large arrived"
            note = f"alone {alone:.3f} ms; {arrived}"
        if found.get("beside", {}).get("lost"):
            note += f"; {found['beside']['lost']} small lost"
        figures.append(
            _figure(
                f"12 B at 50 Hz beside 500 kB at 100 Hz, p99, {path}",
                beside,
                "ms",
                reach,
                ratio,
                note=note,
            )
        )
    for side in ("server", "client"):
        lags = [
            lag
            for lag in result.get("loop_lag_ms", {}).get(side, [])
            if isinstance(lag, (int, float))
        ]
        figures.append(
            _figure(
                f"loop lag beside 500 kB at 100 Hz, {side}",
                max(lags) if lags else None,
                "ms",
                None,
                note="" if lags else "its status has none",
            )
        )
    return figures


def _number(value):
    if value is None:
        return "missing"
    return (
        f"{value:,.0f}"
        if abs(value) >= 1000
        else f"{value:.3f}" if abs(value) < 100 else f"{value:.1f}"
    )


def _short(note):
    line = " ".join(note.split())
    return line if len(line) <= 90 else line[:60] + " ... " + line[-25:]


def table(figures):
    rows = [("figure", "value", "ratio", "to reach", "reached", "note")]
    for f in figures:
        reach = (
            f"{f['to_reach'][0]} {f['to_reach'][1]:g}{'x' if f['ratio'] is not None else ''}"
            if f["to_reach"]
            else ""
        )
        if f["aim"]:
            reach += f" (aim {f['aim']})"
        reached = {True: "yes", False: "NO", None: "MISSING" if f["to_reach"] else ""}[f["reached"]]
        rows.append(
            (
                f["figure"],
                f"{_number(f['value'])} {f['unit'] if f['value'] is not None else ''}".strip(),
                "" if f["ratio"] is None else f"{f['ratio']:.2f}x",
                reach,
                reached,
                _short(f["note"]),
            )
        )
    return _aligned(rows)


def round_trip_table(result):
    sizes = (12, 1000, 10_000, 100_000, 500_000, 2_000_000)
    rows = [("round trip, p50 / p99 in ms", *(_bytes(size) for size in sizes))]
    for path in result:
        cells = (_cell(result, path, size) for size in sizes)
        rows.append(
            (path, *(f"{c['p50']:.3f} / {c['p99']:.3f}" if c else "missing" for c in cells))
        )
    return _aligned(rows)


def throughput_table(result):
    sizes = (12, 10_000, 500_000)
    rows = [("throughput", *(_bytes(size) for size in sizes))]
    for path in result:
        window = "" if path in ("ws", "tcp") else ", window {window}"
        text = "{per_second:,.0f} msg/s, {MB_per_second:.1f} MB/s" + window
        cells = (_cell(result, path, size) for size in sizes)
        rows.append((path, *(text.format(**c) if c else "missing" for c in cells)))
    return _aligned(rows)


def _aligned(rows):
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows
    ]
    return "\n".join([lines[0], "-" * max(map(len, lines)), *lines[1:]])
