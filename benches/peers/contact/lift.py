"""The same lift by Softgrasp, MuJoCo and Rapier: time of a frame, creep, slip, depth, forces.

Writes `contact-peers.md` and its tables. What to install first is in the README one folder up.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path.append(str(HERE.parent))

import mujoco  # noqa: E402

import page  # noqa: E402
import side_rapier  # noqa: E402
import sphere  # noqa: E402
import task  # noqa: E402
import ways  # noqa: E402
import written  # noqa: E402
from side_softgrasp import Mesh  # noqa: E402
from task import Scene, depth_for, normal  # noqa: E402

# Normal force of each tip, N: firm; and as parts of the least that holds the weight by friction.
LIMIT = task.WEIGHT / (2.0 * task.FRICTION)
FORCES = {"firm": 2.0, "near the limit": 1.3 * LIMIT, "too little": 0.8 * LIMIT}
PARTS = ("fast", "slow-rapier", "slow-more", "slow-mujoco", "tried")
SHORT_HOLD = 180
BEGIN_ONLY = 40


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("part", choices=[*PARTS, "report"],
                        help="what to measure, or the report of all that was measured")
    parser.add_argument("--programs", type=Path, default=ROOT / "target" / "release",
                        metavar="DIR", help="folder of fea-server and glove-client")
    parser.add_argument("--rows", type=Path, default=ROOT / "out" / "contact-peers",
                        metavar="DIR", help="where what was measured waits for its report")
    parser.add_argument("--out", type=Path, default=ROOT / "reports", metavar="DIR")
    parser.add_argument("--note", default="", help="a remark for the head of the report")
    return parser.parse_args()


def load_mesh(folder, client, nodes):
    mesh = Mesh.read(sphere.write_mesh(folder, client, nodes))
    points = mesh.points.copy()
    points[:, 2] -= points[:, 2].min()
    return Mesh(points, mesh.tets)


def say(text):
    print(f"{time.strftime('%H:%M:%S')} {text}", file=sys.stderr, flush=True)


def play(way, case, hold):
    """A case by a way: its outcome, or None where it comes to nothing finite."""
    side = way.make()
    try:
        depth = depth_for(
            side, FORCES[case], 0.1 if way.slow else 1e-3, 2 if way.slow else 12,
            way.depths.get(case),
        )
        if depth is None:
            return None
        outcome = side.play(Scene(depth, hold_frames=hold))
        return outcome if outcome.is_finite else None
    finally:
        getattr(side, "close", lambda: None)()


def times(outcome):
    """Median, 99 % and longest of the frames of lift and hold, ms; the median of all processors."""
    first = task.READY
    spent = outcome.times(first, None)
    cpu = statistics.median(frame.more["cpu_ms"] for frame in outcome.frames[first:])
    return (
        statistics.median(spent), float(np.quantile(spent, 0.99)), max(spent), cpu,
        max(outcome.times(task.SETTLE, first)), len(spent),
    )


def result(way, case, outcome):
    """A row of what came out."""
    should = "slides" if case == "too little" else "is lifted"
    if outcome is None:
        return (
            way.name, way.nodes, case, FORCES[case], *[None] * 4, "fails", should,
            *[None] * 6,
        )
    held = outcome.rise() > 0.5 * task.LIFT
    last = outcome.hold[-1]
    more = [frame.more for frame in outcome.frames]
    return (
        way.name, way.nodes, case, FORCES[case], outcome.squeeze(),
        normal(last) if held else None, 1e3 * outcome.rise(),
        1e3 * float(outcome.indentation()) if held else None,
        "is lifted" if held else "slides", should,
        outcome.sink() if held else None, float(outcome.slip()) if held else None,
        outcome.penetration(), outcome.balance() if held else None,
        max((one["residual_rel"] for one in more if "residual_rel" in one), default=None),
        sum(not one.get("converged", True) for one in more) if "converged" in more[-1] else None,
    )


def measure(all_ways, tables, keep):
    """Cases of every way, firm ones first; `keep` puts down what is there so far."""
    for way in [way for way in all_ways if not way.cases]:
        begin_only(way, tables["speeds"])
        keep()
    turns = [(way, "firm") for way in all_ways if "firm" in way.cases]
    turns += [(way, case) for way in all_ways for case in way.cases if case != "firm"]
    for way, case in turns:
        outcome = play(way, case, SHORT_HOLD if way.slow else task.HOLD)
        tables["results"].push(*result(way, case, outcome))
        say(f"{way.name}, {way.nodes}, {case}: {tables['results'].rows[-1][4:]}")
        if case == "firm" and outcome is not None:
            rounds = [(times(outcome), call_ms(outcome))]
            for _ in range(way.rounds - 1):
                outcome = play(way, "firm", task.HOLD)
                rounds.append((times(outcome), call_ms(outcome)))
            push_times(tables["speeds"], way, rounds)
        keep()


def push_times(speeds, way, rounds):
    found, calls = zip(*rounds)
    median, tail, longest, cpu, closing, frames = zip(*found)
    speeds.push(
        way.name, way.nodes, way.settings, way.steps, page.Spread(median),
        page.Spread(cpu) if min(cpu) > 0.0 else None,
        page.Spread(tail), max(longest), max(closing),
        None if calls[0] is None else statistics.median(calls), frames[0], len(found),
    )


def call_ms(outcome):
    """Median of what a frame takes as the caller sees it, over TCP from Python; None in process."""
    first = task.READY
    calls = [frame.more.get("call_ms") for frame in outcome.frames[first:]]
    return None if calls[0] is None else statistics.median(calls)


def try_settings(all_ways, tried):
    for way in all_ways:
        firm, near = (play(way, case, SHORT_HOLD) for case in ("firm", "near the limit"))
        row = [way.name, way.settings]
        for outcome in (firm, near):
            held = outcome is not None and outcome.rise() > 0.5 * task.LIFT
            row += ["is lifted" if held else "fails" if outcome is None else "slides",
                    outcome.sink() if held else None]
        row += [None, None] if firm is None else [firm.penetration(), times(firm)[0]]
        tried.push(*row)
        say(str(row))


def begin_only(way, speeds):
    """Times of the first frames, in which the fingers begin to close, where all take too long."""
    outcome = way.make().play(Scene(0.005, stop=BEGIN_ONLY))
    spent = outcome.times(10, None)
    cpu = [frame.more["cpu_ms"] for frame in outcome.frames[10:]]
    say(f"{way.name}, {way.nodes}: {statistics.median(spent)} ms")
    speeds.push(way.name, way.nodes, f"{way.settings}; on the table only", way.steps,
                page.Spread([statistics.median(spent)]), page.Spread([statistics.median(cpu)]),
                None, None, max(spent), None, len(spent), 1)


def part_of(way):
    if not way.slow or way.name.startswith("Softgrasp"):
        return "fast"
    if "inner" in way.settings:
        return "slow-more"
    return "slow-rapier" if way.name.startswith("Rapier") else "slow-mujoco"


def measured(options):
    """Measures one part and puts its rows down."""
    side_rapier.build()
    client, server = (options.programs / name for name in ("glove-client", "fea-server"))
    head = {"command": COMMAND, **page.machine()}
    program = side_rapier.Program()
    head["peers"] = f"MuJoCo {mujoco.__version__}, {program.ask('about')['version']} (f64)"
    tables = written.tables()
    with tempfile.TemporaryDirectory() as folder:
        meshes = [load_mesh(Path(folder), client, nodes) for nodes in (1000, 4000)]
        head["nodes"] = " and ".join(str(mesh.node_count) for mesh in meshes)
        if options.part == "tried":
            try_settings(ways.tried_ways(program, meshes[0]), tables["tried"])
        else:
            chosen = ways.rigid_ways(program) + ways.our_ways(server, meshes)
            chosen += ways.soft_ways(program, meshes)
            chosen = [way for way in chosen if part_of(way) == options.part]
            measure(chosen, tables, lambda: put_down(options, head, tables))
    program.close()
    put_down(options, head, tables)


def put_down(options, head, tables):
    """The rows that there are so far."""
    head["load after"] = page.load()
    options.rows.mkdir(parents=True, exist_ok=True)
    rows = {name: [[flat(cell) for cell in row] for row in table.rows]
            for name, table in tables.items()}
    text = json.dumps({"head": head, **rows}, indent=1)
    (options.rows / f"{options.part}.json").write_text(text)


def flat(cell):
    """A cell for JSON: a spread is a list of its median and its extremes."""
    return [cell.median, cell.min, cell.max] if isinstance(cell, page.Spread) else cell


def main():
    options = arguments()
    if options.part != "report":
        measured(options)
        return
    tables, heads = written.tables(), []
    parts = [part for part in PARTS if (options.rows / f"{part}.json").exists()]
    for part in parts:
        found = json.loads((options.rows / f"{part}.json").read_text())
        heads.append(found["head"])
        for name, table in tables.items():
            for row in found[name]:
                table.push(*(page.Spread(c) if isinstance(c, list) else c for c in row))
    head = heads[0]
    for name in ("load before", "load after"):
        head[name] = ", ".join(f"{one[name]} ({part})" for one, part in zip(heads, parts))
    if options.note:
        head["note"] = options.note
    options.out.mkdir(parents=True, exist_ok=True)
    written.write(options.out, head, tables)
    print(f"wrote {options.out / 'contact-peers.md'}")


COMMAND = "benches/peers/.venv/bin/python benches/peers/contact/lift.py PART"


if __name__ == "__main__":
    main()
