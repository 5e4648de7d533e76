"""Identifies Young's modulus from a measured curve of force against depth.

    python identify_young.py                         a made-up measurement with noise
    python identify_young.py --measured curve.csv    columns depth_m, force_N

A block lies on a table without weight and a round tip is pressed into it by contact frames. In
linear elasticity without weight force at a depth is proportional to Young's modulus, so one curve
of the model gives the modulus by least squares, and a second one shows that it fits.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

import softgrasp
from softgrasp import Body, ContactStep, ObjectState, Plane, Pose, Sphere

LENGTHS, CELLS = (0.06, 0.06, 0.03), (4, 4, 2)
POISSON = 0.45
TIP_RADIUS = 0.01
DEPTH, STEPS = 0.003, 8
TRUE_YOUNG, NOISE, SEED = 23_000.0, 0.02, 7
STEP = ContactStep(0.05, density=1000.0, gravity=(0.0, 0.0, 0.0), viscosity=0.0)


def force_curve(server: softgrasp.Server, young: float, depths: np.ndarray) -> np.ndarray:
    """Force on the tip (N) at each of some growing depths (m)."""
    mesh = softgrasp.Mesh.block(LENGTHS, CELLS)
    kept = server.keep(softgrasp.Model(mesh, softgrasp.Material(young, POISSON)))
    table = Body(Plane((0.0, 0.0, 1.0)), friction=1.0)
    state, forces, before, worst = ObjectState(), [], 0.0, 0.0
    for depth in depths:
        poses = [tip_at(before), tip_at(depth)]
        tip = Body(Sphere(TIP_RADIUS), *poses, friction=0.5)
        answer = kept.contact_frame(state, [table, tip], STEP, nodes=mesh.boundary_nodes)
        worst = max(worst, answer.contact.residual_rel)
        state, before = answer.state, float(depth)
        forces.append(-answer.loads.forces[1, 2])
    print(f"{young:.0f} Pa: the law of contact is met to {worst:.1e} of the largest force")
    return np.array(forces)


def tip_at(depth: float) -> Pose:
    """The tip over the middle of the block, so deep in its upper face."""
    return Pose((LENGTHS[0] / 2, LENGTHS[1] / 2, LENGTHS[2] + TIP_RADIUS - depth))


def measured(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Depths and forces of a table."""
    with path.open(newline="") as file:
        rows = [(float(row["depth_m"]), float(row["force_N"])) for row in csv.DictReader(file)]
    depths, forces = np.array(sorted(rows)).T
    return depths, forces


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--measured", type=Path, help="table with the columns depth_m, force_N")
    given = parser.parse_args()
    with softgrasp.Server.spawn() as server:
        if given.measured is None:
            depths = np.linspace(0.0, DEPTH, STEPS + 1)[1:]
            noise = np.random.default_rng(SEED).normal(1.0, NOISE, STEPS)
            forces = force_curve(server, TRUE_YOUNG, depths) * noise
        else:
            depths, forces = measured(given.measured)
        guess = 10_000.0
        of_guess = force_curve(server, guess, depths)
        young = guess * float(of_guess @ forces) / float(of_guess @ of_guess)
        fitted = force_curve(server, young, depths)
    misfit = float(np.linalg.norm(fitted - forces) / np.linalg.norm(forces))
    for depth, force, fit in zip(depths, forces, fitted, strict=True):
        print(f"{1e3 * depth:6.2f} mm   measured {force:8.4f} N   model {fit:8.4f} N")
    print(f"Young's modulus {young:.0f} Pa, misfit {misfit:.1%}")
    if given.measured is None:
        assert abs(young / TRUE_YOUNG - 1.0) < 2 * NOISE, "the modulus of the made-up curve"


if __name__ == "__main__":
    main()
