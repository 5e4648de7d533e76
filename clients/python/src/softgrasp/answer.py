"""Answers: displacements, reactions, and the report that says how far to trust them."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .arrays import F32, Floats, Numbers, numbers
from .errors import BadStream
from .field_values import FieldsPart, FieldValues, read_field_values, read_fields_part
from .fields import Fields
from .load_case import LoadCase
from .payload import PayloadReader
from .quantity import (
    Gradient,
    GradientArrays,
    read_gradient,
    read_gradient_part,
)
from .report import LargeReport, SolveReport, late_report, read_large_report, reads_report_late


@dataclass(frozen=True, eq=False)
class Reactions:
    """The forces that hold the body at its known degrees of freedom; they act on the body."""

    dofs: Numbers
    """Degrees of freedom, ascending, each once."""
    forces: Floats
    """Forces, N."""

    def total(self, nodes: ArrayLike | None = None) -> Floats:
        """The sum of the forces on some nodes, or on all: x, y, z, N."""
        dofs, forces = self.dofs, self.forces
        if nodes is not None:
            chosen = np.isin(dofs // 3, numbers(nodes, "nodes"))
            dofs, forces = dofs[chosen], forces[chosen]
        total: Floats = np.bincount(dofs % 3, weights=forces, minlength=3).astype(np.float64)
        return total

    def at(self, nodes: ArrayLike) -> Floats:
        """The force on each of some nodes, N; shape (nodes, 3), 0 where nothing is known."""
        chosen = numbers(nodes, "nodes")
        wanted = 3 * chosen.astype(np.int64)[:, None] + np.arange(3)
        if len(self.dofs) == 0:
            return np.zeros(wanted.shape)
        place = np.minimum(np.searchsorted(self.dofs, wanted), len(self.dofs) - 1)
        return np.where(self.dofs[place] == wanted, self.forces[place], 0.0)


@reads_report_late
@dataclass(frozen=True, eq=False)
class Answer:
    """Displacements and what is known of their error.

    Arrays are views into the bytes that came and cannot be written to; copy what is to be changed.
    """

    nodes: Numbers | None
    """Nodes of the displacements, in the order of the question; None: all, in that of the mesh."""
    displacements: Floats
    """Displacements from rest, m; shape (nodes, 3)."""
    reactions: Reactions
    """Forces at known degrees of freedom; empty where they were not asked for."""
    mask_forces: Floats
    """Force of each mask on the body, N; shape (masks, 3)."""
    report: SolveReport
    """How the answer was found and how wrong it can be; read when it is first looked at."""
    fields: FieldValues | None
    """Strain, stress and energy, where they were asked for; None too where the server does not know
    them, which is an older one then."""
    gradient: Gradient | None
    """Derivatives of the question's quantity; None where there was none."""

    @property
    def residual_rel(self) -> float:
        """Norm of the residual, relative: how well the answer fits its equations."""
        return self.report.residual_rel

    @property
    def error_bound_rel(self) -> float | None:
        """Proven bound of the error, relative, or None; `error_bound_why` says why."""
        return self.report.error_bound_rel

    @property
    def error_bound_why(self) -> str:
        """Why there is no bound; empty where there is one."""
        return self.report.error_bound_why

    def on_mesh(self, node_count: int) -> Floats:
        """Displacements of all nodes, m; 0 for those that were not asked for."""
        if self.nodes is None:
            return self.displacements
        spread = np.zeros((node_count, 3))
        spread[self.nodes] = self.displacements
        return spread


@dataclass(frozen=True, eq=False)
class LargeAnswer(Answer):
    """An equilibrium of the deformed body, or a linear answer where that was good enough."""

    large: LargeReport
    """How the equilibrium was found."""


@dataclass(frozen=True, eq=False)
class CaseAnswer:
    """Displacements and reactions of one case of several."""

    displacements: Floats
    """Displacements from rest, m; shape (nodes, 3)."""
    reactions: Reactions
    """Forces at known degrees of freedom."""
    fields: FieldValues | None = None
    """Strain, stress and energy, where they were asked for."""


@reads_report_late
@dataclass(frozen=True, eq=False)
class SeveralAnswers:
    """Answers for several sets of displacements of the same degrees of freedom."""

    nodes: Numbers | None
    """Nodes of the displacements; None: all."""
    cases: tuple[CaseAnswer, ...]
    """One for each set, in the order of the question."""
    report: SolveReport
    """One report for all; what it says of errors is the worst of them."""


class AnswerPart(NamedTuple):
    """What an answer's part tells, with the counts that announce its arrays."""

    report: SolveReport
    large: LargeReport | None
    listed: bool
    quantised: bool
    scale: float
    node_count: int
    reaction_count: int
    mask_count: int
    case_count: int
    fields: FieldsPart | None


@dataclass(frozen=True)
class Asked:
    """What derivatives of an answer are told by: its load case, and the labels of the materials."""

    case: LoadCase
    labels: tuple[int, ...]

    def gradient(self, arrays: GradientArrays | None) -> Gradient | None:
        """The derivatives in the order of the load case."""
        return None if arrays is None else arrays.of_case(self.case, self.labels)


def read_answer(reader: PayloadReader, asked: Asked | None = None) -> Answer:
    """Reads an answer to a linear question of one case; `asked` where derivatives were wanted."""
    answer = read_whole_answer(reader, read_answer_part(reader.part))
    gradient = _read_last(reader, asked)
    return answer if gradient is None else replace(answer, gradient=gradient)


def read_large_answer(reader: PayloadReader, asked: Asked | None = None) -> LargeAnswer:
    """Reads an answer to a question about large deformation."""
    part = read_answer_part(reader.part)
    if part.large is None:
        raise BadStream("an answer to a question about large deformation does not speak of it")
    answer = read_whole_answer(reader, part)
    gradient = _read_last(reader, asked)
    return LargeAnswer(
        answer.nodes,
        answer.displacements,
        answer.reactions,
        answer.mask_forces,
        part.report,
        answer.fields,
        gradient,
        part.large,
    )


def _read_last(reader: PayloadReader, asked: Asked | None) -> Gradient | None:
    """Reads the derivatives behind all else, if they were wanted."""
    arrays = None
    if asked is not None:
        arrays = read_gradient(reader, read_gradient_part(reader.part.option_block()))
    reader.finish()
    return None if asked is None else asked.gradient(arrays)


def read_several_answers(reader: PayloadReader) -> SeveralAnswers:
    """Reads an answer of one case or several."""
    part = read_answer_part(reader.part)
    first = read_answer_arrays(reader, part)
    case_count = part.case_count
    if case_count and not (part.node_count or part.reaction_count):
        # Cases without a number take no bytes, so any count of them would pass.
        case_count = reader.claimed(case_count, 0, "cases without a number")
    of_cases = [(first.displacements, first.reactions)]
    limits = reader.limits
    for _ in range(reader.claimed(case_count, limits.dof_count_max, "cases")):
        displacements = reader.floats(part.node_count, limits.node_count_max, "nodes", 3)
        forces = reader.floats(part.reaction_count, limits.dof_count_max, "reactions")
        of_cases.append((displacements, Reactions(first.reactions.dofs, forces)))
    cases = [
        CaseAnswer(*of_case, read_field_values(reader, part.fields, part.node_count))
        for of_case in of_cases
    ]
    reader.finish()
    return SeveralAnswers(first.nodes, tuple(cases), part.report)


def read_answer_part(fields: Fields) -> AnswerPart:
    """Reads the fields of an answer."""
    report = late_report(fields)
    large = fields.option_block()
    listed, precision, scale, *counts = fields.fields(_COUNTS)
    nodes, reactions, masks, cases = counts
    precision = fields.named(precision, ("f64", "f32"), "precision")
    wanted = read_fields_part(fields.option_block())
    return AnswerPart(
        report,
        None if large is None else read_large_report(large),
        fields.truth(listed),
        precision == "f32",
        scale,
        nodes,
        reactions,
        masks,
        cases,
        wanted,
    )


def read_whole_answer(reader: PayloadReader, part: AnswerPart) -> Answer:
    """Reads the arrays of an answer of one case, its fields among them."""
    answer = read_answer_arrays(reader, part)
    fields = read_field_values(reader, part.fields, part.node_count)
    return answer if fields is None else replace(answer, fields=fields)


def read_answer_arrays(reader: PayloadReader, part: AnswerPart) -> Answer:
    """Reads the arrays of the first case, without fields."""
    limits = reader.limits
    count = reader.claimed(part.node_count, limits.node_count_max, "answered nodes")
    nodes = reader.numbers(count, limits.node_count_max, "nodes") if part.listed else None
    if part.quantised:
        rounded = reader.array(F32, 3 * count, 3 * limits.node_count_max, "displacements")
        with np.errstate(all="ignore"):
            scaled = np.multiply(rounded, part.scale, dtype=np.float64)
            displacements = scaled.reshape(count, 3)
    else:
        displacements = reader.floats(count, limits.node_count_max, "displacements", 3)
    dofs = reader.numbers(part.reaction_count, limits.dof_count_max, "reactions")
    forces = reader.floats(part.reaction_count, limits.dof_count_max, "reactions")
    mask_forces = reader.floats(part.mask_count, limits.dof_count_max, "forces of masks", 3)
    # What a frozen dataclass does by itself takes three times as long: a frame should not wait for it.
    reactions = object.__new__(Reactions)
    reactions.__dict__.update(dofs=dofs, forces=forces)
    answer = object.__new__(Answer)
    answer.__dict__.update(
        nodes=nodes,
        displacements=displacements,
        reactions=reactions,
        mask_forces=mask_forces,
        report=part.report,
        fields=None,
        gradient=None,
    )
    return answer


_COUNTS = struct.Struct("<BId4I")
