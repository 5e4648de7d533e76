"""Time steps of dynamic soft bodies, beside static frames of ours on the same meshes."""

import statistics
import sys
from pathlib import Path

import numpy as np

from page import Spread, Table
from sides import take_turns

DYNAMIC = (
    ("MuJoCo flex, explicit", "mujoco", "explicit"),
    ("MuJoCo flex, implicit", "mujoco", "implicit"),
    ("Rapier, constraints", "rapier", "constraints"),
    ("Rapier, FEM", "rapier", "fem"),
)
MASS_KG = 1000.0
GRAVITY_M_S2 = 0.05
# Of the computing time in which a body may come to rest after its steps were timed.
SETTLING_S = 5.0

TEXT = f"""
## Time steps of others, and our frames

**These do another job.** MuJoCo and Rapier advance a moving body by one time step, with inertia,
large rotations and contacts, and approximately: they need many steps until a body is where it
belongs. Our rows are the static equilibrium itself, by linear elasticity, exact up to the error in
the table; there is no motion between. So this says what a frame costs in each, not who is better.

The same cube meshes, node for node and tetrahedron for tetrahedron, scaled to an edge of 1 m for
the others ({MASS_KG:g} kg, {GRAVITY_M_S2:g} m/s², contacts off, five nodes pinned). MuJoCo:
integrators `Euler` with steps of 1 ms and damping 0.001 s, and `discrete` (its implicit one for
flex) with steps of 4 ms and damping 0.02 s, one thread; Rapier: corotational tetrahedra,
each of its two solvers, steps of 1/60 s and all else as it comes, in single precision, on two
threads.

`step or frame` is the median of one, ours without the wire (that is in the report `frame`); `error rel` of our rows is against the refined solution.
`distance rel` is how far the body of the others is from the refined static equilibrium under its
own weight (linear elasticity; the largest displacement is about a hundredth of the edge, so that
large rotations do not count), relative to the largest displacement, after its timed steps and what
fits into {SETTLING_S:g} s of computing; `simulated` is the time it has then lived through. Large
meshes are still swinging then. A first frame of a grip computes the columns of five new nodes; the shape's base is there already.
"""


class Body:
    """A body of one of the others, on one mesh."""

    def __init__(self, side, method, folder, scene):
        self.side, self.method, self.folder, self.scene = side, method, Path(folder), scene
        self.simulated_s = 0.0
        self.count = 1

    def load(self):
        self.side.ask("load", folder=str(self.folder), method=self.method, scene=self.scene)
        # One step to see how many make a tenth of a second.
        self.count = max(2, min(20, int(100 / max(self.steps(1), 1e-3))))

    def steps(self, count=None):
        """Median time of some steps."""
        answer = self.side.ask("steps", count=count or self.count)
        self.simulated_s += len(answer["step_ms"]) * answer["step_s"]
        return statistics.median(answer["step_ms"])

    def settle(self):
        spent_ms = 0.0
        while spent_ms < 1e3 * SETTLING_S:
            spent_ms += self.count * self.steps()

    def distance_rel(self):
        """From the static equilibrium; None if the body has no finite place."""
        moved = np.fromfile(self.folder / "moved.f64")
        # Written for one newton on the unscaled mesh; stiffness grows with the scale.
        right = np.fromfile(self.folder / "sag.f64")
        right *= MASS_KG * GRAVITY_M_S2 / self.scene["scale"]
        if not np.isfinite(moved).all():
            return None
        return float(abs(moved - right).max() / abs(right).max())


def time_steps(sides, folder, options):
    columns = [
        "side", "nodes", "what", "step_or_frame_ms", "error_rel", "distance_rel", "simulated_s",
        "rounds",
    ]
    table = Table("One step, one frame", columns)
    for nodes in (216,) if options.quick else (216, 1000, 3375, 10648):
        print(f"peers: steps {nodes}", file=sys.stderr)
        one_size(table, sides, folder / f"steps {nodes}", nodes, options)
    return [TEXT, table]


def one_size(table, sides, folder, nodes, options):
    head = sides["ours"].ask("cube", nodes=nodes, folder=str(folder))
    scene = {
        "young_pa": head["young_pa"], "poisson": head["poisson"], "mass_kg": MASS_KG,
        "gravity_m_s2": GRAVITY_M_S2, "scale": 1.0 / head["edge_m"],
    }
    frames, bodies = [], []

    def ours():
        frames.append(sides["ours"].ask("frames"))
        return frames[-1]["surface_ms"]

    # A side holds one body: those of one side are timed one after the other, each in turn with us.
    for label, side, method in DYNAMIC:
        body = Body(sides[side], method, folder, scene)
        body.load()
        rounds, budget_s = (2, 2) if options.quick else (7, 10)
        times = take_turns(rounds, budget_s, [ours, body.steps])[1]
        body.settle()
        bodies.append((label, times, body.distance_rel(), body.simulated_s))
    push_ours(table, frames, head)
    for label, times, distance, simulated_s in bodies:
        # Where nothing finite came out, there is no time either.
        spread = None if distance is None else Spread(times)
        table.push(label, head["nodes"], "time step", spread, None, distance, simulated_s,
                   len(times))


def push_ours(table, frames, head):
    error = max(frame["error_rel"] for frame in frames)
    rows = (
        ("surface_ms", "warm frame, surface nodes"),
        ("all_ms", "warm frame, all nodes"),
        ("grip_ms", "first frame of a grip"),
    )
    for name, what in rows:
        times = Spread([frame[name] for frame in frames])
        table.push("condensed", head["nodes"], what, times, error, None, None, len(frames))
