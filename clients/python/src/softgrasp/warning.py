"""Warnings of an answer: sentences for people that have a number for programs."""

from __future__ import annotations

from enum import IntEnum

from .fields import Fields


class WarningCode(IntEnum):
    """What a warning is about. A later server may have more numbers than these."""

    ROTATION = 1
    """An element turns so far that linear elasticity is off there."""
    STRAIN = 2
    """An element is strained more than linear elasticity is meant for."""
    DIGITS = 3
    """Rounding has taken digits."""
    LATE = 4
    """The answer is later than the deadline of the question."""
    ERROR = 5
    """The error may be larger than the question asked for."""
    CHOICE = 6
    """Deadline, error and memory did not go together: one of them was given up."""
    LOCKING = 7
    """Elements lock: the object seems stiffer than it is."""
    HOLD = 8
    """The touched nodes hold the body weakly."""
    SNAP = 9
    """The equilibrium snapped to another shape."""
    CREASE = 10
    """An element is pressed so far that surfaces crease."""
    PREPARING = 11
    """Linear elasticity answers while the equilibrium at large deformation is prepared."""
    MESH = 12
    """The mesh itself: parts of it lie in one another."""


class AnswerWarning(str):
    """A warning: its sentence, and what it is about as `code`."""

    code: int
    """A `WarningCode`, or the plain number where this package does not know it."""

    def __new__(cls, text: str, code: int = 0) -> AnswerWarning:
        warning = super().__new__(cls, text)
        warning.code = WarningCode(code) if code in _KNOWN else code
        return warning


def read_warnings(fields: Fields) -> tuple[AnswerWarning, ...]:
    """Reads the list of warnings of a report."""
    count = fields.count(_WARNING_LEN_MIN, "warnings")
    return tuple([_read_warning(fields) for _ in range(count)])


def _read_warning(fields: Fields) -> AnswerWarning:
    code = fields.u16()
    return AnswerWarning(fields.text(), code)


_KNOWN = frozenset(WarningCode)
_WARNING_LEN_MIN = 10
"""Bytes of the number and of the length of the text."""
