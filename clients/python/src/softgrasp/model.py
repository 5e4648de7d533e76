"""A model: a mesh with its materials and its kind of element, and the name of its content."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

import blake3
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import F64, U32, Floats, Numbers, numbers, positive
from .fields import Part
from .mesh import Mesh

Element: TypeAlias = Literal["t4", "t10", "t4-anp", "auto"]
"""Kind of element: linear, quadratic, linear with averaged pressure, or the server's choice."""

ELEMENTS: tuple[str, ...] = ("t4", "t10", "t4-anp")
"""Names of the elements, by their numbers on the wire."""
_LOCKS_FROM = 0.45
"""Poisson's ratio from which on plain linear elements lock."""


@dataclass(frozen=True)
class Material:
    """A homogeneous isotropic elastic material. Raises `ValueError` for impossible numbers."""

    young: float
    """Young's modulus, Pa, above 0."""
    poisson: float
    """Poisson's ratio, between −1 and 0.5, both excluded."""

    def __post_init__(self) -> None:
        positive(self.young, "Young's modulus")
        if not -1.0 < self.poisson < 0.5:
            raise ValueError(f"Poisson's ratio lies between −1 and 0.5, not at {self.poisson}")


@dataclass(frozen=True, eq=False)
class Model:
    """What is solved for: a mesh, its material or materials, and the kind of element.

    Raises `ValueError` where a region of the mesh has no material.
    """

    mesh: Mesh
    """Nodes and elements."""
    material: Material | Mapping[int, Material]
    """The material of the whole body, or one for the label of each region."""
    element: Element | None = None
    """Kind of element. None: `t4`, and from a Poisson's ratio of 0.45 on `t4-anp`, which does not
    lock. `auto`: the server's choice for one request, which may be `t10`; as None where it is kept.
    With `t10` the mid-edge nodes of the mesh are nodes like all others, and edges may be curved;
    where it has none, the server makes them and leaves them free between prescribed corners."""

    def __post_init__(self) -> None:
        if self.element is not None and self.element not in get_args(Element):
            raise ValueError(f"no element is called {self.element!r}: {get_args(Element)}")
        if not isinstance(self.material, Material):
            missing = [label for label in self._labels() if label not in self.material]
            if missing:
                raise ValueError(f"the regions {missing} of the mesh have no material")

    @property
    def asked_element(self) -> str:
        """Element of one request."""
        return "auto" if self.element == "auto" else self.kept_element

    @property
    def kept_element(self) -> str:
        """Element of the model when the server keeps it."""
        if self.element is not None and self.element != "auto":
            return self.element
        ratio = max(material.poisson for material in self._materials())
        return "t4-anp" if ratio >= _LOCKS_FROM else "t4"

    @property
    def pressed_triangles(self) -> Numbers:
        """The boundary where bodies can touch it: between all nodes that the kept element has there."""
        is_quadratic = self.kept_element == "t10"
        return self.mesh.faces_between_nodes if is_quadratic else self.mesh.boundary

    @property
    def used_nodes(self) -> Numbers:
        """Nodes of the elements, ascending: corners, and the mid-edge nodes that `t10` has."""
        _, tets, _, _, mid_edge = self._arrays()
        return np.unique(np.concatenate([tets.reshape(-1), mid_edge.reshape(-1)]))

    def fixed_dofs(self, fixed: ArrayLike) -> Numbers:
        """Degrees of freedom of the nodes `fixed`, ascending, each once."""
        nodes = numbers(fixed, "fixed nodes")
        if len(nodes) and int(nodes.max()) >= self.mesh.node_count:
            raise ValueError(f"node {int(nodes.max())} is not there to be fixed")
        return np.unique(3 * nodes[:, None] + np.arange(3, dtype=U32)).astype(U32)

    def hash(self, fixed_dofs: Numbers) -> bytes:
        """The 32 bytes by which a server knows this model, with degrees of freedom held at zero.

        Source: "The name of a model" in the page of the wire.
        """
        digest = blake3.blake3()
        points, tets, regions, materials, mid_edge = self._arrays()
        sections: list[tuple[bytes, int, bytes | NDArray[Any]]] = [
            (b"softgrasp model 1", 0, self.kept_element.encode()),
            (b"vertices", len(points), points),
            (b"tets", len(tets), tets),
            (b"regions", len(regions), regions),
            (b"materials", len(materials), materials),
            (b"fixed", len(fixed_dofs), fixed_dofs),
        ]
        if len(mid_edge):
            sections.append((b"mid-edge", len(mid_edge), mid_edge))
        for name, count, content in sections:
            digest.update(name + struct.pack("<Q", count))
            digest.update(content if isinstance(content, bytes) else content.tobytes())
        return digest.digest()

    @property
    def needs(self) -> frozenset[str]:
        """Capabilities without which a server does not understand the mesh."""
        return frozenset({"mid-edge"} if self._has_mid_edge else ())

    def part(self) -> Part:
        """The fields that announce the mesh on the wire."""
        points, tets, regions, materials, mid_edge = self._arrays()
        arrays = (1 if len(regions) else 0) | (2 if len(mid_edge) else 0)
        return Part().fields("IIBI", len(points), len(tets), arrays, len(materials))

    def arrays(self) -> tuple[NDArray[Any], ...]:
        """The arrays of the mesh on the wire."""
        return self._arrays()

    @property
    def _has_mid_edge(self) -> bool:
        """Whether the elements have the mid-edge nodes of the mesh."""
        return self.element == "t10" and self.mesh.mid_edge is not None

    def _arrays(self) -> tuple[Floats, Numbers, Numbers, Floats, Numbers]:
        table = [[material.young, material.poisson] for material in self._materials()]
        regions = self.mesh.regions
        if regions is None or isinstance(self.material, Material):
            regions = np.zeros(0, dtype=U32)
        mid_edge = self.mesh.mid_edge
        if mid_edge is None or not self._has_mid_edge:
            mid_edge = np.zeros((0, 6), dtype=U32)
        return self.mesh.points, self.mesh.tets, regions, np.array(table, dtype=F64), mid_edge

    def _labels(self) -> list[int]:
        regions = self.mesh.regions
        return [0] if regions is None else [int(label) for label in np.unique(regions)]

    @property
    def labels(self) -> tuple[int, ...]:
        """Labels of the regions that have materials, ascending; 0 where there is one material."""
        return (0,) if isinstance(self.material, Material) else tuple(map(int, self._labels()))

    def _materials(self) -> list[Material]:
        """One material, or one for each label that occurs, in ascending order."""
        if isinstance(self.material, Material):
            return [self.material]
        return [self.material[label] for label in self._labels()]
