"""Reports: how an answer was found, how long each stage took, and how wrong it can be."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from .model import ELEMENTS
from .payload import PayloadReader


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
    """How an answer was found and how wrong it can be."""

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
    warnings: tuple[str, ...]
    """Sentences for the user."""
    peak_rss_bytes: int
    """Largest resident memory of the server since its start; 0 where the system does not tell."""
    factor_reused: bool
    """Whether the factor, or the small system of `condensed`, was kept from an earlier frame."""
    chosen_because: str
    """Why this method and element."""


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


def read_solve_report(reader: PayloadReader) -> SolveReport:
    """Reads the first field of an answer's part."""
    method = reader.text()
    element, unknown, known, *times, residual = reader.fields(_EQUATIONS)
    bound, why = reader.option(), reader.text()
    refinement_steps, rotation, strain = reader.fields(_SHAPE)
    precision = reader.text()
    condition, estimate = reader.option(), reader.option()
    level = reader.choice(("none", "caution", "serious"), "warning level")
    warnings = reader.texts()
    peak, reused = reader.fields(_MEMORY)
    return SolveReport(
        method=method,
        element=reader.named(element, ELEMENTS, "element"),
        unknown_dofs=unknown,
        known_dofs=known,
        stage_ms=StageTimes(*times),
        residual_rel=residual,
        error_bound_rel=bound,
        error_bound_why=why,
        refinement_steps=refinement_steps,
        max_rotation_deg=rotation,
        max_strain=strain,
        precision=precision,
        condition_estimate=condition,
        error_estimate_rel=estimate,
        warning_level=level,
        warnings=warnings,
        peak_rss_bytes=peak,
        factor_reused=reader.truth(reused),
        chosen_because=reader.text(),
    )


def read_large_report(reader: PayloadReader) -> LargeReport:
    """Reads the last field of the part of an answer at large deformation."""
    deformation, newton, solves, age, substeps, jacobian = reader.fields(_LARGE)
    energy = reader.option()
    stretch, jumped, settled, plastic = reader.fields(_LARGE_END)
    return LargeReport(
        deformation=reader.named(deformation, ("linear", "large"), "deformation"),
        newton_steps=newton,
        linear_solves=solves,
        factor_age=age,
        substeps=substeps,
        min_jacobian=jacobian,
        energy_error_rel=energy,
        max_stretch=stretch,
        jumped=reader.truth(jumped),
        settled=reader.truth(settled),
        plastic_strain=plastic,
    )


def read_contact_report(reader: PayloadReader) -> ContactReport:
    """Reads the report of a contact frame."""
    depth, slip, residual, relative, cone, converged, *counts = reader.fields(_CONTACT)
    errors = (depth, slip, residual, relative, cone)
    deformation = reader.choice(("linear", "large"), "deformation")
    shapes = reader.fields(_CONTACT_END)
    return ContactReport(*errors, reader.truth(converged), *counts, deformation, *shapes)


_EQUATIONS = struct.Struct("<IQQ7dd")
_SHAPE = struct.Struct("<Idd")
_MEMORY = struct.Struct("<QB")
_LARGE = struct.Struct("<5Id")
_LARGE_END = struct.Struct("<dBBd")
_CONTACT = struct.Struct("<5dB4I")
_CONTACT_END = struct.Struct("<II")
