"""Sends the displacement field of a pressed object over OpenIGTLink, for 3D Slicer and its kin.

    pip install pyigtl
    python openigtlink.py liver.msh --scale 0.001

In Slicer: OpenIGTLinkIF, a client connector to port 18944. The volume `DisplacementField` has three
components, in mm and RAS; Slicer makes a grid transform of it (right click: convert to transform).
The lowest tenth of the object is held and the highest tenth is pressed down and let up again.
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pyigtl

import softgrasp

MM = 1e3


class Grid:
    """Points on a regular grid over a mesh, and the element in which each of them lies."""

    def __init__(self, mesh: softgrasp.Mesh, cells: int) -> None:
        low, high = mesh.bounds
        self.low, self.spacing = low, float(max(high - low)) / cells
        self.shape = tuple(int(n) + 1 for n in np.ceil((high - low) / self.spacing))
        found: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        # Once for each element; a frame is then one product of arrays.
        for tet in mesh.tets:
            found.update(self._inside(tet, mesh.points[tet]))
        self.at = np.array(list(found), dtype=int)
        self.nodes_at = np.array([nodes for nodes, _ in found.values()])
        self.weights_at = np.array([weights for _, weights in found.values()])

    def _inside(
        self, tet: np.ndarray, corners: np.ndarray
    ) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Numbers of the grid's points in an element, with its nodes and their weights there."""
        first = np.ceil((corners.min(axis=0) - self.low) / self.spacing - 1e-9).astype(int)
        last = np.floor((corners.max(axis=0) - self.low) / self.spacing + 1e-9).astype(int)
        axes = [np.arange(a, b + 1) for a, b in zip(first, last, strict=True)]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        if len(places) == 0:
            return {}
        edges = (corners[1:] - corners[0]).T
        along = np.linalg.solve(edges, (self.low + self.spacing * places - corners[0]).T).T
        weights = np.column_stack([1.0 - along.sum(axis=1), along])
        inside = (weights >= -1e-9).all(axis=1)
        numbers = np.ravel_multi_index(places[inside].T, self.shape)
        return {int(n): (tet, w) for n, w in zip(numbers, weights[inside], strict=True)}

    def message(self, displacements: np.ndarray) -> pyigtl.ImageMessage:
        """The field on the grid, mm; zero outside of the object."""
        field = np.zeros((math.prod(self.shape), 3), dtype=np.float32)
        at_points = np.einsum("pk,pkc->pc", self.weights_at, displacements[self.nodes_at])
        field[self.at] = MM * at_points
        # Axes of messages are k, j, i, component.
        image = field.reshape(*self.shape, 3).transpose(2, 1, 0, 3)
        world = np.diag([MM * self.spacing] * 3 + [1.0])
        world[:3, 3] = MM * self.low
        return pyigtl.ImageMessage(
            np.ascontiguousarray(image),
            ijk_to_world_matrix=world,
            world_coordinate_system="ras",
            device_name="DisplacementField",
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path, help="mesh file of tetrahedra")
    parser.add_argument("--scale", type=float, default=1.0, help="metres per unit of the file")
    parser.add_argument("--cells", type=int, default=32, help="cells of the grid along its longest")
    parser.add_argument("--port", type=int, default=18944)
    parser.add_argument("--rate", type=float, default=30.0, help="fields a second")
    parser.add_argument("--frames", type=int, default=0, help="fields to send; 0 for ever")
    given = parser.parse_args()

    # Who is asked to end leaves the `with` block, and its server ends too.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    mesh = softgrasp.Mesh.read(given.mesh, given.scale)
    low, high = mesh.bounds
    height = high[2] - low[2]
    part = (mesh.points[:, 2] - low[2]) / height
    bottom, top = np.flatnonzero(part <= 0.1), np.flatnonzero(part >= 0.9)
    grid = Grid(mesh, given.cells)
    link = pyigtl.OpenIGTLinkServer(port=given.port, local_server=True)
    with softgrasp.Server.spawn() as server:
        model = softgrasp.Model(mesh, softgrasp.Material(6e3, 0.45))
        kept = server.keep(model, fixed=bottom)
        sent = 0
        while not given.frames or sent < given.frames:
            if not link.is_connected():
                time.sleep(0.05)
                continue
            depth = 0.05 * height * (1.0 - math.cos(0.1 * (sent + 1))) / 2.0
            case = softgrasp.LoadCase().prescribe(top, (0.0, 0.0, -depth))
            answer = kept.frame(case, reactions=False)
            link.send_message(grid.message(answer.displacements), wait=True)
            sent += 1
            time.sleep(1.0 / given.rate)


if __name__ == "__main__":
    main()
