"""What is asked of large deformation: the law of the material, its yield stress, the path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from .arrays import positive
from .fields import Part

Deformation: TypeAlias = Literal["large", "auto"]
"""An equilibrium in any case, or a linear answer where its error is within `max_error`."""
Law: TypeAlias = Literal["neo-hookean", "neo-hookean-log"]
"""Energy of the material; for small strains both are linear elasticity."""
Path: TypeAlias = Literal["continue", "from-rest"]
"""Whether a frame goes on from this session's last one on the model, or begins at rest."""
Pace: TypeAlias = Literal["repeatable", "timely"]
"""Whether what is done must not depend on the clock, or may use what is ready."""


@dataclass(frozen=True)
class LargeDeformation:
    """How an equilibrium of the deformed body is sought. Raises `ValueError` for other words."""

    deformation: Deformation = "large"
    """Whether the answer may be linear where that is good enough."""
    law: Law = "neo-hookean"
    """Energy of the material."""
    yield_stress: float | None = None
    """Stress above which the material flows and stays deformed, Pa; None: it never flows."""
    path: Path = "continue"
    """Where the path of a frame begins; a `solve_large` always begins at rest."""
    pace: Pace = "repeatable"
    """Whether the same frames give the same bits."""

    def __post_init__(self) -> None:
        for name, words in _WORDS.items():
            if getattr(self, name) not in words:
                raise ValueError(f"{name} is one of {words}, not {getattr(self, name)!r}")
        if self.yield_stress is not None:
            positive(self.yield_stress, "the yield stress")

    def part(self) -> Part:
        """The fields on the wire."""
        number = {name: words.index(getattr(self, name)) for name, words in _WORDS.items()}
        part = Part().fields("II", number["deformation"], number["law"])
        return part.option(self.yield_stress).fields("II", number["path"], number["pace"])


_WORDS: dict[str, tuple[str, ...]] = {
    "deformation": get_args(Deformation),
    "law": get_args(Law),
    "path": get_args(Path),
    "pace": get_args(Pace),
}

DEFORMATIONS = _WORDS["deformation"]
LAWS = _WORDS["law"]
"""The words by their numbers on the wire."""

AT_LARGE = LargeDeformation()
"""What is asked unless something else is said."""
