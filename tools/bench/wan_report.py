"""The rows of tools/bench/wan as a table and as a plot."""

import html
import math

from measure import percentile

WIDTH, LEFT, RIGHT = 1000, 330, 30  # of the plot, in pixels
LINE, TIMELINE = 22, 200
SHORTEST_MS, LONGEST_MS = 5, 5000


def _ms(value):
    return "" if value is None else f"{value:.1f}"


def _judged(one):
    if one["value"] is None:
        return f"{one['what']} MISSING"
    number = f"{one['value']:.3g}"
    if one["reached"]:
        return f"{one['what']} {number}"
    return f"{one['what']} {number} (to reach {one['comparison']} {one['bound']})"


def _told(facts):
    shown = (
        f"{name.replace('_', ' ')} {'none' if value is None else f'{value:.3g}'}"
        for name, value in facts.items()
    )
    return ", ".join(shown)


def table(found):
    """congestion control -> rows."""
    lines = []
    for congestion, rows in found.items():
        lines.append(f"host: {congestion}")
        head = ("case", "p50", "p99", "lost", "CPU", "MB")
        lines.append("{:46} {:>7} {:>7} {:>5} {:>6} {:>5}".format(*head))
        for row in rows:
            delays, costs = ("",) * 3, ("",) * 2
            if row.result:
                delays = (_ms(row.result.ms(50)), _ms(row.result.ms(99)), row.result.lost)
            if row.cost:
                costs = (f"{row.cost.cpu:.0%}", f"{row.cost.resident / 1e6:.0f}")
            line = "{:46} {:>7} {:>7} {:>5} {:>6} {:>5}".format(row.case, *delays, *costs)
            lines.append("  ".join([line, "; ".join(_judged(one) for one in row.judged)]).rstrip())
            if row.told:
                lines.append("    " + _told(row.told))
        judged = [one for row in rows for one in row.judged]
        lines.append(f"{sum(bool(one['reached']) for one in judged)} of {len(judged)} reached\n")
    lines.append(
        "p50, p99: round trip of 12 B at 50 Hz, ms. CPU: both sides; MB: the larger one, resident."
    )
    return "\n".join(lines)


def _text(x, y, text, more=""):
    return f'<text x="{x:.0f}" y="{y:.0f}" {more}>{html.escape(text)}</text>'


def _line(x1, x2, y1, y2, more):
    return f'<line x1="{x1:.1f}" x2="{x2:.1f}" y1="{y1}" y2="{y2}" {more}/>'


def _x(ms):
    share = math.log(max(ms, SHORTEST_MS) / SHORTEST_MS) / math.log(LONGEST_MS / SHORTEST_MS)
    return LEFT + min(share, 1) * (WIDTH - LEFT - RIGHT)


def _strips(rows, top):
    """A line for each case from the fastest to the 99th of 100, with a dot at the middle."""
    parts = []
    bottom = top + LINE * len(rows)
    for ms in (5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000):
        parts.append(_line(_x(ms), _x(ms), top, bottom, 'stroke="#ddd"'))
        parts.append(_text(_x(ms), bottom + 14, f"{ms}", 'text-anchor="middle"'))
    for number, row in enumerate(rows):
        y = top + LINE * number + LINE / 2
        parts.append(_text(LEFT - 8, y + 4, row.case, 'text-anchor="end"'))
        low, middle, high = (_x(row.result.ms(percent)) for percent in (0, 50, 99))
        parts.append(_line(low, high, y, y, 'stroke="#369" stroke-width="4"'))
        parts.append(f'<circle cx="{middle:.1f}" cy="{y}" r="5" fill="#c30"/>')
    parts.append(
        _text(LEFT, bottom + 30, "round trip of urgent 12 B, ms: least, middle (dot), 99 of 100")
    )
    return parts, bottom + 50


def _timeline(row, top):
    """Each round trip over the time, with the steps of the rate."""
    at, ms = row.result.at[0], row.result.topics[0]
    if not at:
        return [], top
    begin, end = min(at), max(at)
    wide = (WIDTH - LEFT - RIGHT) / max(end - begin, 1e-9)
    high = max(percentile(ms, 100), 1)
    parts = [_text(LEFT - 8, top + 14, row.case, 'text-anchor="end"')]
    parts.append(_text(LEFT - 8, top + 30, f"up to {high:.0f} ms", 'text-anchor="end"'))
    for when, rate in row.steps:
        x = LEFT + max(when - begin, 0) * wide
        parts.append(_line(x, x, top, top + TIMELINE, 'stroke="#aaa"'))
        parts.append(_text(x + 4, top + 12, f"{rate / 1e6:.0f} Mbit/s"))
    for when, one in zip(at, ms):
        x, y = LEFT + (when - begin) * wide, top + TIMELINE * (1 - one / high)
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.5" fill="#369"/>')
    return parts, top + TIMELINE + 30


def svg(found):
    parts, top = [], 20
    for congestion, rows in found.items():
        parts.append(_text(10, top, f"host: {congestion}", 'font-weight="bold"'))
        strips, top = _strips([row for row in rows if row.result], top + 10)
        parts += strips
        for row in rows:
            if getattr(row, "steps", None):
                drawn, top = _timeline(row, top)
                parts += drawn
        top += 20
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{top}" '
        'font-family="sans-serif" font-size="12">'
    )
    return "\n".join([head, '<rect width="100%" height="100%" fill="#fff"/>', *parts, "</svg>\n"])
