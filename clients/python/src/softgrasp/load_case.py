"""A load case: prescribed displacements, forces, weight, pressure, and masks that hold means."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from .arrays import F64, NO_FLOATS, NO_NUMBERS, U32, Floats, Numbers, floats, numbers, vector
from .fields import Part


@dataclass(frozen=True, eq=False)
class Mask:
    """A contact that is held by the weighted mean of its nodes: Σ wᵢ uᵢ / Σ wᵢ.

    Raises `ValueError` for weights that are negative or all zero, and for other shapes.
    """

    nodes: Numbers
    """Nodes, each at most once; all of one connected body."""
    weights: Floats
    """Weight of each node, not negative, not all zero."""
    displacement: Floats
    """Prescribed mean, m: x, y, z."""

    def __init__(
        self,
        nodes: ArrayLike,
        weights: ArrayLike | None = None,
        displacement: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        chosen = numbers(nodes, "nodes of a mask")
        given = np.ones(len(chosen)) if weights is None else floats(weights, "weights of a mask")
        if len(given) != len(chosen) or not len(chosen):
            raise ValueError(f"{len(given)} weights for {len(chosen)} nodes of a mask")
        if given.min() < 0.0 or not given.any():
            raise ValueError("weights of a mask are not negative and not all zero")
        object.__setattr__(self, "nodes", chosen)
        object.__setattr__(self, "weights", given)
        moved = vector(displacement, "the displacement of a mask")
        object.__setattr__(self, "displacement", moved)


@dataclass(frozen=True, eq=False)
class Pressure:
    """An even pressure on triangles of the boundary. Raises `ValueError` for other shapes."""

    triangles: Numbers
    """Nodes of the triangles, in any order; shape (triangles, 3)."""
    pressure: float
    """Pressure against the outward normal at rest, Pa."""

    def __init__(self, triangles: ArrayLike, pressure: float) -> None:
        chosen = numbers(triangles, "triangles under pressure", 3)
        given = float(floats([pressure], "the pressure")[0])
        object.__setattr__(self, "triangles", chosen)
        object.__setattr__(self, "pressure", given)


@dataclass(frozen=True, eq=False)
class LoadCase:
    """What is known and what acts; cannot be changed, each method gives a new one.

    A degree of freedom is `3 · node + axis`. Frames that prescribe the same degrees of freedom
    again and again make their load cases quickest by `with_displacements`.
    """

    known_dofs: Numbers = field(default_factory=lambda: NO_NUMBERS)
    """Degrees of freedom with a prescribed displacement, in any order."""
    known_displacements: Floats = field(default_factory=lambda: NO_FLOATS)
    """Their displacements, m."""
    force_dofs: Numbers = field(default_factory=lambda: NO_NUMBERS)
    """Degrees of freedom with a force; several on one add up."""
    forces: Floats = field(default_factory=lambda: NO_FLOATS)
    """These forces, N."""
    masks: tuple[Mask, ...] = ()
    """Contacts that are held by means. Only the method `condensed` takes them."""
    densities: Floats = field(default_factory=lambda: NO_FLOATS)
    """Density of the body, kg/m³, or one for each material by ascending label; none: no weight."""
    acceleration: Floats = field(default_factory=lambda: np.zeros(3))
    """What draws the body where it has weight, m/s²."""
    pressures: tuple[Pressure, ...] = ()
    """Pressures on parts of the boundary; they add up."""

    def __post_init__(self) -> None:
        pairs = [("known", "known_dofs", "known_displacements"), ("force", "force_dofs", "forces")]
        for what, of_dofs, of_values in pairs:
            dofs = numbers(getattr(self, of_dofs), f"{what} degrees of freedom")
            values = floats(getattr(self, of_values), f"{what} values")
            if len(dofs) != len(values):
                raise ValueError(f"{len(values)} {what} values for {len(dofs)} degrees of freedom")
            object.__setattr__(self, of_dofs, dofs)
            object.__setattr__(self, of_values, values)
        object.__setattr__(self, "densities", floats(self.densities, "densities"))
        object.__setattr__(self, "acceleration", vector(self.acceleration, "the acceleration"))
        if len(self.densities) and self.densities.min() < 0.0:
            raise ValueError("densities are not negative")

    def prescribe(self, nodes: ArrayLike, displacement: ArrayLike) -> LoadCase:
        """This case and prescribed displacements of nodes, m.

        `displacement` is x, y, z for all nodes, or an array (nodes, 3). NaN, or None in a list,
        leaves a direction free: `prescribe(top, (None, None, -0.001))`.
        """
        dofs, values = _by_axis(nodes, displacement, "prescribed displacements")
        return replace(
            self,
            known_dofs=np.concatenate([self.known_dofs, dofs]),
            known_displacements=np.concatenate([self.known_displacements, values]),
        )

    def force(self, nodes: ArrayLike, force: ArrayLike) -> LoadCase:
        """This case and forces on nodes, N: x, y, z on every node, or an array (nodes, 3)."""
        dofs, values = _by_axis(nodes, force, "forces")
        return replace(
            self,
            force_dofs=np.concatenate([self.force_dofs, dofs]),
            forces=np.concatenate([self.forces, values]),
        )

    def weight(
        self,
        density: float | Mapping[int, float],
        acceleration: ArrayLike = (0.0, 0.0, -9.81),
    ) -> LoadCase:
        """This case and the weight of the body, which takes the place of an earlier one.

        `density` (kg/m³) is that of the whole body, or `{label: density}` for all regions that
        have materials of their own. `acceleration` is in m/s², in the frame of the mesh. In frames
        another acceleration is a product.
        """
        if isinstance(density, Mapping):
            densities = np.array([density[label] for label in sorted(density)], dtype=F64)
        else:
            densities = np.array([density], dtype=F64)
        drawn = vector(acceleration, "the acceleration")
        return replace(self, densities=densities, acceleration=drawn)

    def pressure(self, triangles: ArrayLike, pressure: float) -> LoadCase:
        """This case and an even pressure (Pa) on triangles of the boundary, inwards where positive.

        `mesh.boundary_of(nodes)` has the triangles between nodes. The pressure keeps its direction
        and its force: normal and area are those at rest.
        """
        return replace(self, pressures=(*self.pressures, Pressure(triangles, pressure)))

    @property
    def has_spread_loads(self) -> bool:
        """Whether weight or pressure acts."""
        return len(self.densities) > 0 or len(self.pressures) > 0

    def mask(
        self,
        nodes: ArrayLike,
        displacement: ArrayLike = (0.0, 0.0, 0.0),
        weights: ArrayLike | None = None,
    ) -> LoadCase:
        """This case and a mask: the weighted mean of these nodes moves by `displacement`, m."""
        return replace(self, masks=(*self.masks, Mask(nodes, weights, displacement)))

    def with_displacements(self, displacements: ArrayLike) -> LoadCase:
        """This case with other displacements (m) of the same degrees of freedom, in their order."""
        values = floats(displacements, "known values")
        if len(values) != len(self.known_dofs):
            raise ValueError(f"{len(values)} known values for {len(self.known_dofs)} dofs")
        # Everything else has been checked: a frame should not wait for it again.
        other = object.__new__(LoadCase)
        other.__dict__.update(self.__dict__)
        other.__dict__["known_displacements"] = values
        return other

    def scaled(self, factor: float) -> LoadCase:
        """This case with displacements, forces, weight and pressures times a factor."""
        masks = [Mask(m.nodes, m.weights, m.displacement * factor) for m in self.masks]
        return replace(
            self,
            known_displacements=self.known_displacements * factor,
            forces=self.forces * factor,
            masks=tuple(masks),
            acceleration=self.acceleration * factor,
            pressures=tuple(Pressure(p.triangles, p.pressure * factor) for p in self.pressures),
        )


def _by_axis(nodes: ArrayLike, values: ArrayLike, what: str) -> tuple[Numbers, Floats]:
    """Degrees of freedom and values of nodes, those that are not NaN."""
    chosen = numbers(nodes, f"nodes of {what}")
    try:
        table = np.asarray(values, dtype=F64)
        table = np.broadcast_to(table, (len(chosen), 3))
    except (TypeError, ValueError):
        raise ValueError(f"{what} have x, y, z, or the shape ({len(chosen)}, 3)") from None
    if len(chosen) and int(chosen.max()) > 0xFFFF_FFFF // 3:
        raise ValueError(f"{what} name node {int(chosen.max())}, which no mesh has")
    dofs = 3 * chosen[:, None] + np.arange(3, dtype=U32)
    given = ~np.isnan(table)
    return dofs[given].astype(U32), table[given]


def mask_arrays(masks: Iterable[Mask]) -> tuple[Numbers, Numbers, Floats, Floats]:
    """Lengths, nodes, weights and displacements of masks, as they travel."""
    masks = tuple(masks)
    if not masks:
        return NO_NUMBERS, NO_NUMBERS, NO_FLOATS, NO_FLOATS
    return (
        np.array([len(mask.nodes) for mask in masks], dtype=U32),
        np.concatenate([mask.nodes for mask in masks]),
        np.concatenate([mask.weights for mask in masks]),
        np.concatenate([mask.displacement for mask in masks]),
    )


def spread_part(case: LoadCase) -> Part:
    """The fields of weight and pressure on the wire, which are left out where nothing acts."""
    triangles = sum(len(pressure.triangles) for pressure in case.pressures)
    counts = (len(case.densities), len(case.pressures), triangles)
    return Part().fields("3d3I", *case.acceleration.tolist(), *counts)


def spread_arrays(case: LoadCase) -> tuple[Floats, Floats, Numbers, Numbers]:
    """Densities, pressures, and numbers and nodes of the triangles, as they travel."""
    pressures = case.pressures
    if not pressures:
        return case.densities, NO_FLOATS, NO_NUMBERS, NO_NUMBERS
    return (
        case.densities,
        np.array([pressure.pressure for pressure in pressures], dtype=F64),
        np.array([len(pressure.triangles) for pressure in pressures], dtype=U32),
        np.concatenate([pressure.triangles for pressure in pressures]),
    )
