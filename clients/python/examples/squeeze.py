"""Squeezes the object of a mesh file, tells force and error, and plots what came out.

    python squeeze.py liver.msh --out squeezed.png

The lowest tenth of the object is held and the highest tenth is pressed down, at large deformation.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import softgrasp


def squeezed(mesh: softgrasp.Mesh, share: float) -> tuple[softgrasp.LoadCase, np.ndarray]:
    """The load case, by how large a share of its height the object is pressed; nodes on top."""
    low, high = mesh.bounds
    height = high[2] - low[2]
    part = (mesh.points[:, 2] - low[2]) / height
    used = np.isin(np.arange(mesh.node_count), mesh.tets)
    bottom, top = np.flatnonzero(used & (part <= 0.1)), np.flatnonzero(used & (part >= 0.9))
    case = softgrasp.LoadCase().prescribe(bottom, (0.0, 0.0, 0.0))
    return case.prescribe(top, (0.0, 0.0, -share * height)), top


def plot(mesh: softgrasp.Mesh, answer: softgrasp.LargeAnswer, path: Path) -> bool:
    """Draws the deformed boundary, coloured by how far it moved; False without matplotlib."""
    try:
        import matplotlib

        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    except ImportError:
        return False
    places = mesh.points + answer.displacements
    moved = np.linalg.norm(answer.displacements, axis=1)
    figure = plt.figure(figsize=(6, 5))
    axes = figure.add_subplot(projection="3d")
    of_faces = moved[mesh.boundary].mean(axis=1)
    colours = plt.get_cmap("viridis")(of_faces / max(moved.max(), 1e-30))
    axes.add_collection3d(Poly3DCollection(places[mesh.boundary], facecolors=colours))
    low, high = places.min(axis=0), places.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    axes.set_title(f"moved by up to {1e3 * moved.max():.2f} mm")
    figure.savefig(path, dpi=100)
    return True


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path, help="mesh file of tetrahedra")
    parser.add_argument("--scale", type=float, default=1.0, help="metres per unit of the file")
    parser.add_argument(
        "--share", type=float, default=0.1, help="how far, as a share of the height"
    )
    parser.add_argument("--young", type=float, default=20_000.0, help="Young's modulus, Pa")
    parser.add_argument("--poisson", type=float, default=0.4, help="Poisson's ratio")
    parser.add_argument("--out", type=Path, default=Path("squeezed.png"), help="the plot")
    given = parser.parse_args()

    mesh = softgrasp.Mesh.read(given.mesh, given.scale)
    model = softgrasp.Model(mesh, softgrasp.Material(given.young, given.poisson))
    case, top = squeezed(mesh, given.share)
    with softgrasp.Server.spawn() as server:
        answer = server.solve_large(model, case)
    print(f"{mesh.node_count} nodes, {len(mesh.tets)} tetrahedra, {answer.report.element}")
    print(f"pressed by {-answer.reactions.total(top)[2]:.4g} N")
    print(f"estimated error {answer.report.error_estimate_rel}, no bound: {answer.error_bound_why}")
    for warning in answer.report.warnings:
        print("warning:", warning)
    if plot(mesh, answer, given.out):
        print(f"plot written to {given.out}")
    else:
        print("no plot: matplotlib is not there")


if __name__ == "__main__":
    main()
