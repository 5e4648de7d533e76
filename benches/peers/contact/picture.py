"""A picture of two logarithmic scales: time of a frame, and how fast the held ball sinks."""

import math

WIDTH, HEIGHT = 860, 460
LEFT, RIGHT, TOP, BOTTOM = 80, 330, 20, 60
COLOURS = {"Softgrasp": "#1b6ca8", "MuJoCo": "#c8553d", "Rapier": "#3c7a3f"}


def draw(points, path):
    """`points` are name, nodes, ms and m/s; what moves slower than the scale lies on its edge."""
    x_low, x_high, y_low, y_high = -3, 3, -10, -2
    floor = 10.0**y_low

    def x(ms):
        return LEFT + (WIDTH - LEFT - RIGHT) * (math.log10(ms) - x_low) / (x_high - x_low)

    def y(sink):
        share = (math.log10(max(abs(sink), floor)) - y_low) / (y_high - y_low)
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share

    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
    ]
    for power in range(x_low, x_high + 1):
        at = x(10.0**power)
        lines.append(f'<line x1="{at:.1f}" y1="{TOP}" x2="{at:.1f}" y2="{HEIGHT - BOTTOM}" '
                     'stroke="#ddd"/>')
        lines.append(f'<text x="{at:.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">'
                     f"{10.0**power:g}</text>")
    for power in range(y_low, y_high + 1, 2):
        at = y(10.0**power)
        lines.append(f'<line x1="{LEFT}" y1="{at:.1f}" x2="{WIDTH - RIGHT}" y2="{at:.1f}" '
                     'stroke="#ddd"/>')
        lines.append(f'<text x="{LEFT - 8}" y="{at + 4:.1f}" text-anchor="end">1e{power}</text>')
    middle_x, middle_y = LEFT + (WIDTH - LEFT - RIGHT) / 2, TOP + (HEIGHT - TOP - BOTTOM) / 2
    frame = x(1000.0 / 60.0)
    lines += [
        f'<line x1="{frame:.1f}" y1="{TOP}" x2="{frame:.1f}" y2="{HEIGHT - BOTTOM}" '
        'stroke="#888" stroke-dasharray="4 3"/>',
        f'<text x="{middle_x:.0f}" y="{HEIGHT - 16}" text-anchor="middle">'
        "ms for a frame (median); dashed: a sixtieth of a second</text>",
        f'<text x="18" y="{middle_y:.0f}" text-anchor="middle" '
        f'transform="rotate(-90 18 {middle_y:.0f})">sinks or rises while held, m/s</text>',
    ]
    for number, (name, nodes, ms, sink) in enumerate(points, 1):
        colour = COLOURS[name.split(",")[0].split()[0]]
        lines += [
            f'<circle cx="{x(ms):.1f}" cy="{y(sink):.1f}" r="5" fill="{colour}"/>',
            f'<text x="{x(ms) + 8:.1f}" y="{y(sink) - 6:.1f}" fill="{colour}">{number}</text>',
            f'<text x="{WIDTH - RIGHT + 16}" y="{TOP + 18 * number}" fill="{colour}">'
            f"{number}  {name}{'' if nodes == 1 else f', {nodes}'}</text>",
        ]
    path.write_text("\n".join([*lines, "</svg>", ""]))
