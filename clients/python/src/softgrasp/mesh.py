"""Meshes of tetrahedra: nodes, elements, regions, and the boundary that follows from them."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from itertools import permutations
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import U32, Floats, Numbers, floats, numbers
from .errors import MeshFileError
from .mesh_file import read_mesh

_Scalar = TypeVar("_Scalar", bound=np.generic)

# Corners of the edges whose middles a tetrahedron may have.
_EDGES = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A body of tetrahedra, which may have nodes in the middles of their edges.

    The corners of a tetrahedron may come in any order. Nodes that no tetrahedron uses are allowed;
    they do not move. Raises `ValueError` for other shapes, numbers that are not finite, and
    tetrahedra that name a node that is not there.
    """

    points: Floats
    """Places of the nodes at rest, m; shape (nodes, 3)."""
    tets: Numbers
    """Nodes of the corners of each tetrahedron, from 0; shape (tetrahedra, 4)."""
    regions: Numbers | None = None
    """Label of each tetrahedron, which chooses its material; None where there is one region."""
    mid_edge: Numbers | None = None
    """Nodes in the middles of the edges 12, 23, 13, 14, 24, 34 of each tetrahedron, for elements
    `t10`; shape (tetrahedra, 6). None: the server makes them, on straight edges."""
    _cache: dict[str, Numbers] = field(default_factory=dict, repr=False)

    def __init__(
        self,
        points: ArrayLike,
        tets: ArrayLike,
        regions: ArrayLike | None = None,
        mid_edge: ArrayLike | None = None,
    ) -> None:
        # Copies of its own: a kept model is named by what is in them.
        object.__setattr__(self, "points", _locked(floats(points, "points", 3)))
        object.__setattr__(self, "tets", _locked(numbers(tets, "tetrahedra", 4)))
        labels = None if regions is None else _locked(numbers(regions, "regions"))
        object.__setattr__(self, "regions", labels)
        middles = None if mid_edge is None else _locked(numbers(mid_edge, "mid-edge nodes", 6))
        object.__setattr__(self, "mid_edge", middles)
        object.__setattr__(self, "_cache", {})
        if len(self.tets) == 0:
            raise ValueError("a mesh has at least one tetrahedron")
        last = int(self.tets.max())
        if last >= len(self.points):
            raise ValueError(f"a tetrahedron names node {last}; there are {len(self.points)}")
        if labels is not None and len(labels) != len(self.tets):
            raise ValueError(f"{len(labels)} regions for {len(self.tets)} tetrahedra")
        if middles is not None and len(middles) != len(self.tets):
            raise ValueError(
                f"{len(middles)} rows of mid-edge nodes for {len(self.tets)} tetrahedra"
            )
        if middles is not None and int(middles.max()) >= len(self.points):
            raise ValueError(
                f"a mid-edge node is {int(middles.max())}; there are {len(self.points)} nodes"
            )

    @classmethod
    def read(cls, path: str | os.PathLike[str], scale: float = 1.0) -> Mesh:
        """Reads a mesh file; its lengths times `scale` are metres.

        Gmsh MSH 1, 2 and 4 in text are read by this package itself, all else by meshio where that
        is installed (`pip install softgrasp[meshio]`). Where every tetrahedron has ten nodes, the
        mid-edge nodes are kept, for elements `t10`; else the corners are taken. Regions are the physical groups of the file, where it has several. Raises
        `MeshFileError`, and `OSError` where the file cannot be opened.
        """
        points, nodes, regions = read_mesh(Path(path), scale)
        try:
            return cls(
                points, nodes[:, :4], regions, nodes[:, 4:] if nodes.shape[1] == 10 else None
            )
        except ValueError as error:
            raise MeshFileError(f"{path}: {error}") from error

    @classmethod
    def block(cls, lengths: ArrayLike, cells: tuple[int, int, int]) -> Mesh:
        """A block between the origin and the corner `lengths` (m), of cells of six tetrahedra."""
        nx, ny, nz = cells
        if min(cells) < 1:
            raise ValueError(f"a block has at least one cell in each direction, not {cells}")
        sides = floats(lengths, "lengths")
        axes = [np.linspace(0.0, side, n + 1) for side, n in zip(sides, cells, strict=True)]
        z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
        points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
        strides = (1, nx + 1, (nx + 1) * (ny + 1))
        k, j, i = np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")
        first = (i * strides[0] + j * strides[1] + k * strides[2]).reshape(-1, 1)
        # From corner to corner of a cell along the three axes in turn: one path, one tetrahedron.
        paths = [
            np.cumsum([0, *(strides[axis] for axis in path)]) for path in permutations(range(3))
        ]
        tets = np.concatenate([first + path for path in paths], axis=1).reshape(-1, 4)
        return cls(points, tets.astype(U32))

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        return len(self.points)

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The lowest and the highest corner of the box around the nodes, m."""
        return self.points.min(axis=0), self.points.max(axis=0)

    @property
    def volume(self) -> float:
        """Volume at rest, m³."""
        a, b, c, d = (self.points[self.tets[:, corner]] for corner in range(4))
        return float(np.abs(np.einsum("ij,ij->i", a - d, np.cross(b - d, c - d))).sum() / 6.0)

    @property
    def boundary(self) -> Numbers:
        """Triangles of the boundary, counter-clockwise seen from outside; shape (triangles, 3).

        They are the faces that one tetrahedron alone has.
        """
        if "boundary" not in self._cache:
            self._cache["boundary"] = self._faces_of_one()
        return self._cache["boundary"]

    @property
    def faces_between_nodes(self) -> Numbers:
        """The boundary between all its nodes, as `boundary`; a face with mid-edge nodes is four triangles."""
        if self.mid_edge is None:
            return self.boundary
        if "faces" not in self._cache:
            self._cache["faces"] = self._split_faces(self.mid_edge)
        return self._cache["faces"]

    @property
    def boundary_nodes(self) -> Numbers:
        """Nodes of the boundary, in ascending order."""
        if "nodes" not in self._cache:
            self._cache["nodes"] = np.unique(self.boundary)
        return self._cache["nodes"]

    def boundary_of(self, nodes: ArrayLike) -> Numbers:
        """Triangles of the boundary whose corners are all among `nodes`; shape (triangles, 3)."""
        chosen = np.zeros(self.node_count, dtype=bool)
        chosen[numbers(nodes, "nodes")] = True
        return self.boundary[chosen[self.boundary].all(axis=1)]

    def nodes_at(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        within: float | None = None,
    ) -> Numbers:
        """Nodes whose coordinates are those given, in ascending order.

        `within` (m) is how far they may be off; a millionth of the mesh's size if it is not given.
        """
        low, high = self.bounds
        reach = float(np.linalg.norm(high - low)) * 1e-6 if within is None else within
        chosen = np.ones(self.node_count, dtype=bool)
        for axis, value in enumerate((x, y, z)):
            if value is not None:
                chosen &= np.abs(self.points[:, axis] - value) <= reach
        return np.flatnonzero(chosen).astype(U32)

    def nearest_node(self, place: ArrayLike) -> int:
        """The node of a tetrahedron that is nearest to a place (m)."""
        used = np.unique(self.tets)
        away = np.linalg.norm(self.points[used] - np.asarray(place, dtype=float), axis=1)
        return int(used[int(away.argmin())])

    def _split_faces(self, mid_edge: Numbers) -> Numbers:
        ends = np.sort(self.tets[:, _EDGES].reshape(-1, 2).astype(np.int64), axis=1)
        names = ends[:, 0] * self.node_count + ends[:, 1]
        names, first = np.unique(names, return_index=True)
        middles = mid_edge.reshape(-1)[first]
        corners = self.boundary.astype(np.int64)
        sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
        asked = sides[:, :, 0] * self.node_count + sides[:, :, 1]
        ab, bc, ca = middles[np.searchsorted(names, asked)].T
        a, b, c = corners.T
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        stacked = np.stack([np.stack(part, axis=1) for part in parts], axis=1)
        return np.ascontiguousarray(stacked.reshape(-1, 3), dtype=U32)

    def _faces_of_one(self) -> Numbers:
        a, b, c, d = (self.points[self.tets[:, corner]] for corner in range(4))
        turned = np.einsum("ij,ij->i", a - d, np.cross(b - d, c - d)) < 0.0
        tets = self.tets.copy()
        tets[turned, 2], tets[turned, 3] = self.tets[turned, 3], self.tets[turned, 2]
        # The faces where (c1 − c4) · ((c2 − c4) × (c3 − c4)) > 0, each seen from outside.
        faces = tets[:, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]].reshape(-1, 3)
        names = np.sort(faces, axis=1)
        _, first, count = np.unique(names, axis=0, return_index=True, return_counts=True)
        return np.ascontiguousarray(faces[np.sort(first[count == 1])], dtype=U32)


def _locked(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    """A copy that cannot be written to."""
    copy = array.copy()
    copy.flags.writeable = False
    return copy
