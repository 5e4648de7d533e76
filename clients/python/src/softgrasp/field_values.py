"""Fields of strain, stress, energy and contact: which are wanted, and what an answer has."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from .arrays import Floats
from .errors import BadStream
from .fields import Fields
from .payload import PayloadReader

FieldName = Literal["stress", "von_mises", "strain", "energy", "error", "pressure", "force"]
"""What `fields` may name: `stress` (Cauchy's), `von_mises`, `strain`, `energy`, `error` (estimated
error of the stress), and in contact frames `pressure` and `force`."""
FIELDS: tuple[str, ...] = get_args(FieldName)
WantedFields: TypeAlias = "str | Iterable[str]"
"""Names of fields, or "all"; of elements and nodes, or of one of them: `elements.stress`."""


class _Kind(NamedTuple):
    """One field on the wire, at the position of its bit."""

    name: str
    place: str
    components: int


_KINDS = (
    _Kind("strain", "elements", 6),
    _Kind("strain", "nodes", 6),
    _Kind("stress", "elements", 6),
    _Kind("stress", "nodes", 6),
    _Kind("von_mises", "elements", 1),
    _Kind("von_mises", "nodes", 1),
    _Kind("energy", "elements", 1),
    _Kind("energy", "nodes", 1),
    _Kind("error", "elements", 1),
    _Kind("error", "nodes", 1),
    _Kind("pressure", "nodes", 1),
    _Kind("force", "nodes", 3),
)
_OF_CONTACT = ("pressure", "force")


def field_bits(wanted: WantedFields, with_contact: bool = False) -> int:
    """The bits of the fields that are named. Raises `ValueError` for a name that none has."""
    names = [wanted] if isinstance(wanted, str) else list(wanted)
    bits = 0
    for name in names:
        place, _, field = name.rpartition(".")
        chosen = [
            bit
            for bit, kind in enumerate(_KINDS)
            if (kind.name == field or name == "all")
            and place in ("", kind.place)
            and (with_contact or kind.name not in _OF_CONTACT)
        ]
        if not chosen:
            where = "" if with_contact else "; contact frames have pressure and force too"
            known = ", ".join(n for n in FIELDS if with_contact or n not in _OF_CONTACT)
            raise ValueError(f"there is no field {name!r}; there are {known} and all{where}")
        for bit in chosen:
            bits |= 1 << bit
    return bits


@dataclass(frozen=True, eq=False)
class PlacedFields:
    """Fields of elements, or of nodes; None for those that were not asked for.

    Tensors have six columns, xx, yy, zz, xy, yz, zx; shear strains are half the engineering ones.
    """

    strain: Floats | None = None
    """Strain: by linear elasticity the small strain, at large deformation Green's."""
    stress: Floats | None = None
    """Cauchy's stress, Pa."""
    von_mises: Floats | None = None
    """Von Mises stress, Pa."""
    energy: Floats | None = None
    """Stored energy: of elements J, of nodes J for each m³ at rest."""
    error: Floats | None = None
    """Estimated error of the stress, Pa."""
    pressure: Floats | None = None
    """Pressure of contact at nodes, Pa, a mean over the surface around the node."""
    force: Floats | None = None
    """Force of contact at nodes, N; shape (nodes, 3)."""


@dataclass(frozen=True, eq=False)
class FieldValues:
    """Fields of an answer, in the frame of the mesh. Arrays are views that cannot be written to.

    `fields.stress` is that of the answer's nodes, `fields.elements.stress` that of all elements.
    """

    energy: float
    """Stored energy of the whole body, J."""
    stress_error_rel: float | None
    """Estimated error of the stress in the energy norm, relative; None unless wanted."""
    elements: PlacedFields
    """Of every element of the mesh, mean over it."""
    nodes: PlacedFields
    """Of the nodes of the answer."""

    @property
    def strain(self) -> Floats:
        """Strain of the nodes. Raises `ValueError` where it was not asked for."""
        return _there(self.nodes.strain, "strain")

    @property
    def stress(self) -> Floats:
        """Cauchy's stress of the nodes, Pa. Raises `ValueError` where it was not asked for."""
        return _there(self.nodes.stress, "stress")

    @property
    def von_mises(self) -> Floats:
        """Von Mises stress of the nodes, Pa. Raises `ValueError` where it was not asked for."""
        return _there(self.nodes.von_mises, "von_mises")

    @property
    def error(self) -> Floats:
        """Estimated error of the stress of the nodes, Pa. Raises `ValueError` as the others."""
        return _there(self.nodes.error, "error")

    @property
    def pressure(self) -> Floats:
        """Pressure of contact at the nodes, Pa. Raises `ValueError` as the others."""
        return _there(self.nodes.pressure, "pressure")

    @property
    def force(self) -> Floats:
        """Force of contact at the nodes, N. Raises `ValueError` as the others."""
        return _there(self.nodes.force, "force")


def matrices(tensors: Floats) -> Floats:
    """Symmetric tensors of six numbers as matrices; shape (…, 6) becomes (…, 3, 3)."""
    xx, yy, zz, xy, yz, zx = np.moveaxis(tensors, -1, 0)
    rows = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


class FieldsPart(NamedTuple):
    """What an answer's part tells of its fields."""

    sent: int
    element_count: int


def read_fields_part(fields: Fields | None) -> FieldsPart | None:
    """Reads the block that announces fields; none where none were asked for."""
    if fields is None:
        return None
    part = FieldsPart(fields.u32(), fields.u32())
    if part.sent >> len(_KINDS):
        raise BadStream(f"an answer has the fields {part.sent:#x}, of which some are not known")
    return part


def read_field_values(
    reader: PayloadReader, part: FieldsPart | None, node_count: int
) -> FieldValues | None:
    """Reads the fields of one case."""
    if part is None:
        return None
    limits = reader.limits
    energy, error = reader.floats(2, 2, "sums of fields")
    at: dict[str, dict[str, Floats]] = {"elements": {}, "nodes": {}}
    for bit, kind in enumerate(_KINDS):
        if part.sent >> bit & 1:
            is_of_nodes = kind.place == "nodes"
            count = node_count if is_of_nodes else part.element_count
            most = limits.node_count_max if is_of_nodes else limits.tet_count_max
            values = reader.floats(count, most, f"{kind.name} of {kind.place}", kind.components)
            at[kind.place][kind.name] = values
    elements, nodes = PlacedFields(**at["elements"]), PlacedFields(**at["nodes"])
    known = None if math.isnan(error) else float(error)
    return FieldValues(float(energy), known, elements, nodes)


def _there(values: Floats | None, name: str) -> Floats:
    if values is None:
        raise ValueError(f"{name} of nodes was not asked for: fields={name!r}")
    return values
