"""Reports: how an answer was found, how long each stage took, and how wrong it can be."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import Any, TypeVar, cast

from .fields import Fields
from .limits import Limits
from .model import ELEMENTS
from .warning import AnswerWarning, read_warnings

T = TypeVar("T")


@dataclass(frozen=True)
class StageTimes:
    """Wall time of each stage, ms; 0 for one that was not needed."""

    decode: float
    """Payload to message."""
    assemble: float
    """Stiffness matrix."""
    order: float
    """Order of the unknowns that keeps the factor small."""
    factor: float
    """Factor or inverse; for `condensed` missing columns and the small system."""
    solve: float
    """Right-hand sides and refinement."""
    encode: float
    """Collecting and rounding what was asked for."""
    queue: float
    """Until a thread begins the work."""


@dataclass(frozen=True)
class SolveReport:
    """How an answer was found and how wrong it can be.

    A short one (`report="short"`) has empty texts and no warnings; of one that nobody wanted
    (`report="none"`) `is_told` is false, what can be None is None, and errors are NaN.
    """

    method: str
    """Method that was used; never `auto`."""
    element: str
    """Element that was used."""
    unknown_dofs: int
    """Degrees of freedom that were solved for."""
    known_dofs: int
    """Degrees of freedom known by the question or the model, and three for each mask."""
    stage_ms: StageTimes
    """Wall time by stage, ms."""
    residual_rel: float
    """Norm of the residual over that of the right-hand side; large: over the reactions."""
    error_bound_rel: float | None
    """Proven bound of the displacements' error in the Euclidean norm, relative; or None."""
    error_bound_why: str
    """Why there is no bound; empty where there is one."""
    refinement_steps: int
    """Steps of refinement or of conjugate gradients."""
    max_rotation_deg: float
    """Largest rotation of an element, degrees; NaN where it was not worked out."""
    max_strain: float
    """Largest principal strain of an element in magnitude; NaN where it was not worked out."""
    precision: str
    """Arithmetic that was used."""
    condition_estimate: float | None
    """Estimate of the condition number."""
    error_estimate_rel: float | None
    """Estimate of the largest error of a displacement, relative to the largest; no bound."""
    warning_level: str
    """`none`, `caution` or `serious`."""
    warnings: tuple[AnswerWarning, ...]
    """Sentences for the user; each has its number as `code`."""
    peak_rss_bytes: int
    """Largest resident memory of the server since its start; 0 where the system does not tell."""
    factor_reused: bool
    """Whether the factor, or the small system of `condensed`, was kept from an earlier frame."""
    chosen_because: str
    """Why this method and element."""

    @property
    def is_told(self) -> bool:
        """Whether the server has told anything."""
        return not math.isnan(self.residual_rel)


@dataclass(frozen=True)
class LargeReport:
    """How an equilibrium at large deformation was found."""

    deformation: str
    """What the answer is: `linear`, or `large` for an equilibrium of the deformed body."""
    newton_steps: int
    """Steps of Newton's method."""
    linear_solves: int
    """Linear systems that were solved."""
    factor_age: int
    """Frames since the shape that the newest factor belongs to."""
    substeps: int
    """Pieces that the motion was cut into."""
    min_jacobian: float
    """Smallest ratio of an element's volume to that at rest."""
    energy_error_rel: float | None
    """Estimated error in the energy norm, relative."""
    max_stretch: float
    """Largest principal stretch of an element, 1 at rest; NaN where it was not worked out."""
    jumped: bool
    """Whether the equilibrium jumped (snap-through)."""
    settled: bool
    """Whether nothing is gained by asking again."""
    plastic_strain: float
    """Largest accumulated plastic strain."""


@dataclass(frozen=True)
class ContactReport:
    """How well a step meets the law of Signorini and Coulomb."""

    penetration_max: float
    """Depth of the deepest point of the candidate triangles in a body, m."""
    slip_max: float
    """Longest slip of a pressing point in this step, m."""
    residual: float
    """Largest residual of the natural map of the law, N."""
    residual_rel: float
    """The same over the largest force of a point."""
    cone_violation: float
    """Largest part of a force outside its cone of friction, N."""
    is_converged: bool
    """Whether penetration and residual are within what was asked for."""
    rounds: int
    """Times the contact problem was made."""
    sweeps: int
    """Sweeps over all points."""
    newton_steps: int
    """Steps of Newton's method."""
    columns_computed: int
    """Nodes whose columns were computed for this step, by linear elasticity."""
    deformation: str
    """Which equations the elastic part was solved by: `linear` or `large`."""
    shapes: int
    """Shapes that contact was solved about; 1 for linear elasticity."""
    factors: int
    """Factors of the tangent that were made."""
    plastic_strain: float
    """Largest accumulated plastic strain."""
    is_late: bool = False
    """Whether the deadline has ended the step before it met what was asked for."""


@dataclass(frozen=True)
class _ReportBytes:
    """The block of a report as it came."""

    data: bytes
    limits: Limits


class _ReadLate:
    """The attribute `report`, which is read from its bytes by who looks at it first."""

    def __get__(self, answer: Any, owner: type) -> SolveReport:
        report: SolveReport | _ReportBytes = answer.__dict__["report"]
        if isinstance(report, _ReportBytes):
            report = read_solve_report(Fields(report.data, report.limits))
            answer.__dict__["report"] = report
        return report

    def __set__(self, answer: Any, report: SolveReport | _ReportBytes) -> None:
        answer.__dict__["report"] = report


def reads_report_late(answer: type[T]) -> type[T]:
    """Has a dataclass keep the bytes of its field `report` until somebody looks at it.

    A frame whose report nobody looks at takes a third less of this package's time. Looking raises
    `BadStream` where the bytes are no report.
    """
    setattr(answer, "report", _ReadLate())  # noqa: B010  its type is that of the field
    return answer


def late_report(fields: Fields) -> SolveReport:
    """The report in the next block, for a dataclass that `reads_report_late`."""
    # To whoever looks at the attribute it is what it says.
    return cast(SolveReport, _ReportBytes(fields.block_bytes(), fields.limits))


def read_solve_report(fields: Fields) -> SolveReport:
    """Reads the block that an answer's part begins with; one without fields tells nothing."""
    if fields.is_empty:
        return _UNTOLD
    method = fields.text()
    element, unknown, known, *times, residual = fields.fields(_EQUATIONS)
    bound, why = fields.option(), fields.option_text()
    refinement_steps, rotation, strain = fields.fields(_SHAPE)
    precision = fields.text()
    condition, estimate = fields.option(), fields.option()
    level = fields.u32()
    warnings = read_warnings(fields)
    peak, reused = fields.fields(_MEMORY)
    return SolveReport(
        method=method,
        element=ELEMENTS[element] if element < len(ELEMENTS) else f"element {element}",
        unknown_dofs=unknown,
        known_dofs=known,
        stage_ms=StageTimes(*times),
        residual_rel=residual,
        error_bound_rel=bound,
        error_bound_why=why or "",
        refinement_steps=refinement_steps,
        max_rotation_deg=rotation,
        max_strain=strain,
        precision=precision,
        condition_estimate=condition,
        error_estimate_rel=estimate,
        # A level that is not known is at least serious.
        warning_level=_LEVELS[min(level, len(_LEVELS) - 1)],
        warnings=warnings,
        peak_rss_bytes=peak,
        factor_reused=fields.truth(reused),
        chosen_because=fields.text(),
    )


def read_large_report(fields: Fields) -> LargeReport:
    """Reads the block of an answer at large deformation."""
    is_linear, newton, solves, age, substeps, jacobian = fields.fields(_LARGE)
    energy = fields.option()
    stretch, jumped, settled, plastic = fields.fields(_LARGE_END)
    return LargeReport(
        deformation="linear" if fields.truth(is_linear) else "large",
        newton_steps=newton,
        linear_solves=solves,
        factor_age=age,
        substeps=substeps,
        min_jacobian=jacobian,
        energy_error_rel=energy,
        max_stretch=stretch,
        jumped=fields.truth(jumped),
        settled=fields.truth(settled),
        plastic_strain=plastic,
    )


def read_contact_report(fields: Fields) -> ContactReport:
    """Reads the report of a contact frame."""
    depth, slip, residual, relative, cone, converged, *counts = fields.fields(_CONTACT)
    errors = (depth, slip, residual, relative, cone)
    rounds, sweeps, newton, columns = counts
    is_large, shapes, factors, plastic, _, is_late = fields.fields(_CONTACT_END)
    deformation = "large" if fields.truth(is_large) else "linear"
    told = (fields.truth(converged), rounds, sweeps, newton, columns)
    late = fields.truth(is_late)
    return ContactReport(*errors, *told, deformation, shapes, factors, plastic, late)


_LEVELS = ("none", "caution", "serious")
_NO_TIMES = StageTimes(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_UNTOLD = SolveReport(
    method="",
    element="",
    unknown_dofs=0,
    known_dofs=0,
    stage_ms=_NO_TIMES,
    residual_rel=math.nan,
    error_bound_rel=None,
    error_bound_why="",
    refinement_steps=0,
    max_rotation_deg=math.nan,
    max_strain=math.nan,
    precision="",
    condition_estimate=None,
    error_estimate_rel=None,
    warning_level="none",
    warnings=(),
    peak_rss_bytes=0,
    factor_reused=False,
    chosen_because="",
)
_EQUATIONS = struct.Struct("<IQQ7dd")
_SHAPE = struct.Struct("<Idd")
_MEMORY = struct.Struct("<QB")
_LARGE = struct.Struct("<B4Id")
_LARGE_END = struct.Struct("<dBBd")
_CONTACT = struct.Struct("<5dB4I")
_CONTACT_END = struct.Struct("<BIIdIB")
