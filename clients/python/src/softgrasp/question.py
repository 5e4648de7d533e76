"""What is asked about a load case: method, nodes, precision, and how exact and how soon."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, TypedDict, cast, get_args

from numpy.typing import ArrayLike, NDArray

from .arrays import NO_NUMBERS, Numbers, numbers, positive
from .field_values import WantedFields, field_bits
from .fields import Part
from .load_case import LoadCase, mask_arrays, spread_arrays, spread_part
from .quantity import Quantity

Precision = Literal["f64", "f32"]
"""How displacements travel: in double precision, or in half the bytes, to 2⁻²⁴ of the largest."""
PRECISIONS: tuple[str, ...] = get_args(Precision)
Report = Literal["full", "short", "none"]
"""How much an answer's report tells: all, its numbers without texts, or nothing."""
REPORTS: tuple[str, ...] = get_args(Report)


class Options(TypedDict, total=False):
    """The keyword arguments of everything that asks for displacements; see `Question`."""

    method: str
    nodes: ArrayLike | None
    reactions: bool
    precision: Precision
    max_error: float | None
    deadline_ms: float | None
    report: Report
    fields: WantedFields
    quantity: Quantity | None


class FrameOptions(Options, total=False):
    """The keyword arguments of frames, which ask about a kept model; see `Question`."""

    newest_wins: bool


@dataclass(frozen=True, eq=False)
class Question:
    """What is asked. Raises `ValueError` for what no server could take."""

    method: str = "auto"
    """Method by which the equations are solved; `auto` leaves the choice to the server."""
    nodes: ArrayLike | None = None
    """Nodes whose displacements are wanted, in any order; None for all."""
    reactions: bool = True
    """Whether the forces are wanted that hold the body at its known degrees of freedom."""
    precision: Precision = "f64"
    """How displacements travel."""
    max_error: float | None = None
    """Relative error that is good enough; an answer that misses it has a warning."""
    deadline_ms: float | None = None
    """Time after which the answer is of little use; a late answer has a warning."""
    report: Report = "full"
    """How much the report of the answer tells; less of it has fewer bytes."""
    fields: WantedFields = ()
    """Fields of strain, stress and energy that are wanted too, by name, or "all"."""
    quantity: Quantity | None = None
    """A quantity whose derivatives are wanted too: `gradient` of the answer. One more solve."""
    newest_wins: bool = False
    """Of frames of one model: one that has not been begun when a newer one with `newest_wins` comes
    is refused as `Superseded`."""

    def __post_init__(self) -> None:
        if self.precision not in PRECISIONS:
            raise ValueError(f"precision is one of {PRECISIONS}, not {self.precision!r}")
        if self.report not in REPORTS:
            raise ValueError(f"report is one of {REPORTS}, not {self.report!r}")
        if self.fields:
            wanted = (self.fields,) if isinstance(self.fields, str) else tuple(self.fields)
            field_bits(wanted)
            object.__setattr__(self, "fields", wanted)
        if self.nodes is not None:
            object.__setattr__(self, "nodes", numbers(self.nodes, "wanted nodes"))
        for name in ("max_error", "deadline_ms"):
            value = getattr(self, name)
            if value is not None:
                positive(value, name)

    @cached_property
    def _of_all_cases(self) -> bytes:
        """The fields that do not depend on the load case, on the wire."""
        part = Part().text(self.method)
        precision = PRECISIONS.index(self.precision)
        if self.nodes is None:
            part.raw(_ALL_NODES.pack(0, self.reactions, precision))
        else:
            part.raw(_NODES.pack(1, len(self._wanted()), self.reactions, precision))
        return part.option(self.max_error).option(self.deadline_ms).data()

    def part(self, case: LoadCase) -> Part:
        """The fields of the question on the wire."""
        part = Part().raw(self._of_all_cases)
        mask_nodes = sum([len(mask.nodes) for mask in case.masks]) if case.masks else 0
        counts = (len(case.known_dofs), len(case.force_dofs), len(case.masks), mask_nodes)
        part.raw(_COUNTS.pack(*counts, field_bits(self.fields) if self.fields else 0))
        if self.quantity is not None:
            return part.join(spread_part(case)).join(self.quantity.part(case))
        return part.join(spread_part(case)) if case.has_spread_loads else part

    def arrays(self, case: LoadCase) -> tuple[NDArray[Any], ...]:
        """The arrays of the question on the wire."""
        return (
            case.known_dofs,
            case.known_displacements,
            case.force_dofs,
            case.forces,
            self._wanted(),
            *mask_arrays(case.masks),
            *(spread_arrays(case) if case.has_spread_loads else ()),
            *(() if self.quantity is None else self.quantity.arrays(case)),
        )

    def _wanted(self) -> Numbers:
        """The wanted nodes, which were checked; none where all are wanted."""
        return NO_NUMBERS if self.nodes is None else cast(Numbers, self.nodes)


_ALL_NODES = struct.Struct("<I?I")
_NODES = struct.Struct("<II?I")
_COUNTS = struct.Struct("<5I")
