"""Draws memory and latency of a soak as an SVG."""

import math

WIDTH, PANEL, LEFT, TOP = 860, 190, 64, 34
INK, GRID = "#333", "#ddd"
SERIES = {
    "run_mib": ("#1f6fb4", "run"), "server_mib": ("#d1495b", "server"),
    "p50_ms": ("#2a9d6f", "half of the frames within"), "p99_ms": ("#8a5cc2", "99 % within"),
}
MARKS = {"server killed": "#d1495b", "server ended": "#e39b3a", "devices unplugged": "#1f6fb4"}


def picture(samples, events):
    """Two panels over time: resident memory, and bounds on quantiles of the answers' times."""
    end = max(s["seconds"] for s in samples)
    inside = WIDTH - LEFT - 20
    x = lambda seconds: LEFT + inside * seconds / end
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {2 * PANEL + 120}" '
        'font-family="sans-serif" font-size="12">',
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    panels = [
        ("resident memory, MiB", ["run_mib", "server_mib"], TOP),
        ("time of an answer, ms", ["p50_ms", "p99_ms"], TOP + PANEL + 34),
    ]
    for title, names, top in panels:
        values = [s[n] for s in samples for n in names if s[n] is not None]
        scale = linear(values) if names[0].endswith("mib") else logarithmic(values)
        parts += panel(samples, (title, names, top), x, scale)
        for at, what in events:
            if what in MARKS:
                parts.append(
                    f'<line x1="{x(at):.1f}" x2="{x(at):.1f}" y1="{top}" y2="{top + PANEL - 30}" '
                    f'stroke="{MARKS[what]}" stroke-width="0.7" stroke-dasharray="3 3"/>'
                )
    foot = 2 * PANEL + 92
    for k, (what, colour) in enumerate(MARKS.items()):
        left = LEFT + 180 * k
        parts.append(f'<line x1="{left}" x2="{left + 24}" y1="{foot - 4}" y2="{foot - 4}" '
                     f'stroke="{colour}" stroke-dasharray="3 3"/>')
        parts.append(f'<text x="{left + 30}" y="{foot}" fill="{INK}">{what}</text>')
    parts.append(f'<text x="{WIDTH - 20}" y="{foot}" text-anchor="end" fill="{INK}">'
                 f'seconds, 0 to {end:.0f}</text>')
    return "\n".join([*parts, "</svg>", ""])


def linear(values):
    """Places from 0 to 1 for values from 0 on, and the values that get a line."""
    most = 1.08 * max(values, default=1.0)
    return lambda value: value / most, [most * k / 4 for k in range(5)]


def logarithmic(values):
    """Places from 0 to 1 for values by their logarithm, and the powers of ten that get a line."""
    finite = [value for value in values if math.isfinite(value)] or [1.0]
    low, high = math.floor(math.log10(min(finite))), math.ceil(math.log10(max(finite)))
    high = max(high, low + 1)
    place = lambda value: (min(math.log10(value), high) - low) / (high - low)
    return place, [10.0**k for k in range(low, high + 1)]


def panel(samples, about, x, scale):
    title, names, top = about
    place, ticks = scale
    height = PANEL - 30
    y = lambda value: top + height * (1 - place(value))
    parts = [f'<text x="{LEFT}" y="{top - 10}" fill="{INK}" font-weight="bold">{title}</text>']
    for value in ticks:
        parts.append(f'<line x1="{LEFT}" x2="{WIDTH - 20}" y1="{y(value):.1f}" y2="{y(value):.1f}" '
                     f'stroke="{GRID}"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y(value) + 4:.1f}" text-anchor="end" fill="{INK}">'
                     f'{value:.4g}</text>')
    for k, name in enumerate(names):
        colour, label = SERIES[name]
        left = LEFT + 240 + 200 * k
        parts.append(f'<text x="{left}" y="{top - 10}" fill="{colour}">{label}</text>')
        line, pieces = [], []
        for sample in samples:
            if sample[name] is None:
                pieces.append(line)
                line = []
            else:
                line.append(f'{x(sample["seconds"]):.1f},{y(sample[name]):.1f}')
        for piece in [*pieces, line]:
            if len(piece) > 1:
                parts.append(f'<polyline points="{" ".join(piece)}" fill="none" stroke="{colour}" '
                             'stroke-width="1.3"/>')
    return parts
