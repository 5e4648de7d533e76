"""A quantity J of displacements and reactions, and its derivatives as a server answers them."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .arrays import F64, NO_FLOATS, NO_NUMBERS, U32, Floats, Numbers
from .fields import Fields, Part
from .load_case import LoadCase
from .payload import PayloadReader


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of a quantity J by what it depends on."""

    known_displacements: Floats
    """By each known displacement of the load case, in its order: dJ per m."""
    forces: Floats
    """By a force on each node, dJ per N; shape (nodes, 3), 0 where a displacement is known."""
    points: Floats | None
    """By the place of each node at rest, dJ per m; shape (nodes, 3). None where it is not known."""
    young: dict[int, float] | None
    """By Young's modulus of each region's label (0 where there is one): dJ per Pa. None where it is
    not known."""
    poisson: dict[int, float] | None
    """By Poisson's ratio of each region's label. None where it is not known."""
    acceleration: Floats | None = None
    """By the acceleration of weight, dJ per m/s²; None without weight."""
    pressures: Floats | None = None
    """By each pressure of the load case, in its order, dJ per Pa."""
    value: float | None = None
    """J itself, where the server has worked it out."""


@dataclass(frozen=True, eq=False)
class Quantity:
    """A quantity J whose derivatives an answer is to have: Σ a x + ½ b x² of what it names.

    Of displacements u, `slopes` are a and `curvatures` b, both of the shape (nodes, 3); of the
    reactions at the known degrees of freedom of the load case, in its order, `of_reactions` and
    `reaction_curvatures`. So ½ Σ (u − w)² has slopes −w and curvatures 1, up to a constant. Raises
    `ValueError` for other shapes, and where nothing is named.
    """

    slopes: ArrayLike | None = None
    """Derivatives by displacements, at zero."""
    curvatures: ArrayLike | None = None
    """Second derivatives by displacements, each by its own."""
    of_reactions: ArrayLike | None = None
    """Derivatives by reactions, at zero."""
    reaction_curvatures: ArrayLike | None = None
    """Second derivatives by reactions, each by its own."""
    points: bool = False
    """Whether derivatives by the places of nodes are wanted too."""

    def __post_init__(self) -> None:
        for name, width in (("slopes", 3), ("curvatures", 3), ("of_reactions", 1)):
            object.__setattr__(self, name, _table(getattr(self, name), name, width))
        curved = _table(self.reaction_curvatures, "reaction_curvatures", 1)
        object.__setattr__(self, "reaction_curvatures", curved)
        if not any(len(table) for pair in self._pairs() for table in pair):
            raise ValueError("a quantity names neither displacements nor reactions")

    def part(self, case: LoadCase) -> Part:
        """The fields of the quantity on the wire."""
        (displacements, *_), (reactions, *_) = self._terms(case)
        return Part().fields("2I?", len(displacements), len(reactions), self.points)

    def arrays(self, case: LoadCase) -> tuple[Numbers | Floats, ...]:
        """Degrees of freedom, slopes and curvatures of displacements, then of reactions."""
        displacements, reactions = self._terms(case)
        return (*displacements, *reactions)

    def _pairs(self) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
        """Slopes and curvatures of displacements and of reactions, which were checked."""
        given = (self.slopes, self.curvatures, self.of_reactions, self.reaction_curvatures)
        tables = [np.asarray(table, dtype=F64) for table in given]
        return (tables[0], tables[1]), (tables[2], tables[3])

    def _terms(self, case: LoadCase) -> tuple[_Terms, _Terms]:
        of_displacements, of_reactions = self._pairs()
        if max(map(len, of_reactions)) > len(case.known_dofs):
            raise ValueError(
                f"a quantity of {max(map(len, of_reactions))} reactions, "
                f"of {len(case.known_dofs)} known degrees of freedom"
            )
        displaced = np.arange(max(map(len, of_displacements)), dtype=U32)
        held = case.known_dofs[: max(map(len, of_reactions))]
        return _terms(of_displacements, displaced), _terms(of_reactions, held)


class _Terms(NamedTuple):
    """Terms of a quantity: degrees of freedom, slopes, curvatures."""

    dofs: Numbers
    slopes: Floats
    curvatures: Floats


def _terms(pair: tuple[Floats, Floats], dofs: Numbers) -> _Terms:
    """The terms that are not zero, or the first where all are."""
    if len(dofs) == 0:
        return _Terms(NO_NUMBERS, NO_FLOATS, NO_FLOATS)
    slopes, curvatures = (_padded(table, len(dofs)) for table in pair)
    named = np.flatnonzero((slopes != 0.0) | (curvatures != 0.0))
    named = named if len(named) else np.zeros(1, dtype=np.int64)
    return _Terms(dofs[named], slopes[named], curvatures[named])


def _padded(table: Floats, count: int) -> Floats:
    padded = np.zeros(count)
    padded[: len(table)] = table
    return padded


def _table(values: ArrayLike | None, what: str, width: int) -> Floats:
    """Numbers by degree of freedom; none where nothing is given."""
    if values is None:
        return NO_FLOATS
    given = np.array(values, dtype=F64)
    is_right = given.ndim == 2 and given.shape[1] == 3 if width == 3 else given.ndim == 1
    if not is_right:
        expected = "(nodes, 3)" if width == 3 else "(known degrees of freedom,)"
        raise ValueError(f"{what} has the shape {given.shape}, not {expected}")
    if not np.isfinite(given).all():
        raise ValueError(f"{what} has numbers that are not finite")
    flat: Floats = given.reshape(-1)
    return flat


class GradientPart(NamedTuple):
    """What an answer's part tells of derivatives."""

    value: float
    node_count: int
    known_count: int
    material_count: int
    pressure_count: int
    place_count: int
    acceleration: Floats | None


def read_gradient_part(fields: Fields | None) -> GradientPart | None:
    """Reads the block that announces derivatives; none where none were asked for."""
    if fields is None:
        return None
    value, *counts = fields.fields(_COUNTS)
    nodes, known, materials, pressures, places = counts
    drawn = np.array(fields.fields(_VECTOR)) if fields.flag() else None
    return GradientPart(value, nodes, known, materials, pressures, places, drawn)


class GradientArrays(NamedTuple):
    """Derivatives as they came: known displacements by ascending degree of freedom."""

    part: GradientPart
    forces: Floats
    known_dofs: Numbers
    known: Floats
    materials: Floats
    pressures: Floats
    places: Floats

    def of_case(self, case: LoadCase, labels: tuple[int, ...]) -> Gradient:
        """The derivatives in the order of a load case; `labels` are those of the materials."""
        forces = np.array(self.forces, dtype=F64)
        is_inner = self.known_dofs < forces.size
        forces.reshape(-1)[self.known_dofs[is_inner]] = 0.0
        place = np.searchsorted(self.known_dofs, case.known_dofs)
        young, poisson = self.materials.reshape(-1, 2).T
        return Gradient(
            self.known[place] if len(self.known) else NO_FLOATS,
            forces,
            self.places if self.part.place_count else None,
            dict(zip(labels, young.tolist(), strict=False)),
            dict(zip(labels, poisson.tolist(), strict=False)),
            self.part.acceleration,
            self.pressures,
            self.part.value,
        )


def read_gradient(reader: PayloadReader, part: GradientPart | None) -> GradientArrays | None:
    """Reads the derivatives of an answer."""
    if part is None:
        return None
    limits = reader.limits
    nodes, dofs = limits.node_count_max, limits.dof_count_max
    return GradientArrays(
        part,
        reader.floats(part.node_count, nodes, "derivatives by forces", 3),
        reader.numbers(part.known_count, dofs, "derivatives by known displacements"),
        reader.floats(part.known_count, dofs, "derivatives by known displacements"),
        reader.floats(
            part.material_count, limits.material_count_max, "derivatives by materials", 2
        ),
        reader.floats(part.pressure_count, nodes, "derivatives by pressures"),
        reader.floats(part.place_count, nodes, "derivatives by places", 3),
    )


_COUNTS = struct.Struct("<d5I")
_VECTOR = struct.Struct("<3d")
