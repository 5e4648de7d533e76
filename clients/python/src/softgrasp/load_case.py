"""A load case: prescribed displacements, forces, and masks that hold means of nodes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from .arrays import F64, NO_FLOATS, NO_NUMBERS, U32, Floats, Numbers, floats, numbers, vector


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

    def __post_init__(self) -> None:
        pairs = [("known", "known_dofs", "known_displacements"), ("force", "force_dofs", "forces")]
        for what, of_dofs, of_values in pairs:
            dofs = numbers(getattr(self, of_dofs), f"{what} degrees of freedom")
            values = floats(getattr(self, of_values), f"{what} values")
            if len(dofs) != len(values):
                raise ValueError(f"{len(values)} {what} values for {len(dofs)} degrees of freedom")
            object.__setattr__(self, of_dofs, dofs)
            object.__setattr__(self, of_values, values)

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
        """This case with displacements, forces and those of masks times a factor."""
        masks = [Mask(m.nodes, m.weights, m.displacement * factor) for m in self.masks]
        return replace(
            self,
            known_displacements=self.known_displacements * factor,
            forces=self.forces * factor,
            masks=tuple(masks),
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
