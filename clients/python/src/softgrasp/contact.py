"""Contact frames: one step in time of a free object among rigid bodies, with friction."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .answer import Answer, read_answer_part, read_whole_answer
from .arrays import U32, Floats, Numbers, numbers, positive, vector
from .body import Body, body_arrays
from .errors import BadStream
from .field_values import WantedFields, field_bits
from .fields import Part
from .large import DEFORMATIONS, LAWS, Deformation, Law
from .mesh import Mesh
from .model import Model
from .payload import PayloadReader, payload_of
from .pose import Pose
from .question import PRECISIONS, Precision
from .report import ContactReport, read_contact_report
from .trace import with_trace

_MARGIN_OF_SIZE = 0.02
"""Triangles this share of the object's size beyond the ways of a step are candidates too."""


@dataclass(frozen=True, eq=False)
class ObjectState:
    """What a free object is like between two steps: given by one answer, asked with in the next.

    `ObjectState(Pose(...))` is an object that comes to rest there, undeformed.
    """

    pose: Pose = field(default_factory=Pose)
    """Turns coordinates of the mesh at rest into those of the world."""
    velocity: Floats = field(default_factory=lambda: np.zeros(3))
    """Velocity of the centre of mass, m/s, world."""
    angular_velocity: Floats = field(default_factory=lambda: np.zeros(3))
    """rad/s, world."""
    force_nodes: Numbers = field(default_factory=lambda: np.zeros(0, U32))
    """Nodes with the forces that shape the object."""
    forces: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    """These forces, N, in the object's frame; shape (nodes, 3)."""
    contact_names: Numbers = field(default_factory=lambda: np.zeros((0, 4), U32))
    """Of each held contact the position of the body and three nodes; shape (contacts, 4)."""
    contact_numbers: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    """Weights of the nodes, then the force, N, in the object's frame; shape (contacts, 6)."""
    displacements: Floats | None = None
    """Displacements of all nodes in the object's frame, m; finds what is near. Does not travel."""

    def places(self, mesh: Mesh) -> Floats:
        """Where the nodes are in the world, m; shape (nodes, 3)."""
        points = mesh.points if self.displacements is None else mesh.points + self.displacements
        return self.pose.to_world(points)


@dataclass(frozen=True)
class ContactStep:
    """How a step is made. Raises `ValueError` for a length or a density of 0, and other words."""

    seconds: float
    """Length of the step, s."""
    density: float = 1000.0
    """Density of the object, kg/m³."""
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    """Acceleration of free fall, m/s², world."""
    viscosity: float = 0.005
    """Time in which the shape forgets a force (Kelvin and Voigt), s; 0 for none."""
    penetration_rel: float = 1e-7
    """Penetration that is small enough, as a share of the object's size."""
    residual_rel: float = 1e-9
    """Residual of the law that is small enough, as a share of the largest force."""
    rounds_max: int = 40
    """Most times that the contact problem is made anew."""
    newton_max: int = 1000
    """Steps of Newton's method after which no further round is begun."""
    deformation: Deformation | None = None
    """Large deformation, or linear elasticity where it suffices; None: linear elasticity."""
    law: Law = "neo-hookean"
    """Law of large deformation."""
    yield_stress: float | None = None
    """Stress above which the material flows and stays deformed, Pa; None: never."""
    from_rest: bool = False
    """Forget shape, factor and plastic strain of the session's last step."""
    deadline_ms: float | None = None
    """Time after which the step ends at the best that was found, ms; None: as long as it takes. A time
    needs the capability `contact-deadline`."""

    def __post_init__(self) -> None:
        positive(self.seconds, "the length of a step")
        positive(self.density, "the density")
        vector(self.gravity, "gravity")
        if self.deformation not in (None, *DEFORMATIONS):
            raise ValueError(f"deformation is None or one of {DEFORMATIONS}")
        if self.law not in LAWS:
            raise ValueError(f"law is one of {LAWS}, not {self.law!r}")
        if self.yield_stress is not None:
            positive(self.yield_stress, "the yield stress")
            if self.deformation in (None, "linear"):
                raise ValueError("a yield stress needs deformation large or auto")
        if self.deadline_ms is not None:
            positive(self.deadline_ms, "the deadline")

    def needs(self) -> frozenset[str]:
        """Capabilities of a server that the step needs."""
        return frozenset() if self.deadline_ms is None else frozenset({"contact-deadline"})

    def part(self) -> Part:
        """The fields on the wire."""
        part = Part().fields("d3ddd", self.seconds, *self.gravity, self.density, self.viscosity)
        part.fields(
            "ddII", self.penetration_rel, self.residual_rel, self.rounds_max, self.newton_max
        )
        if self.deformation is None:
            part.fields("B", 0)
        else:
            part.fields("BI", 1, DEFORMATIONS.index(self.deformation))
        part.fields("I", LAWS.index(self.law))
        if self.yield_stress is None:
            part.fields("B", 0)
        else:
            part.fields("Bd", 1, self.yield_stress)
        part.fields("I", int(self.from_rest))
        if self.deadline_ms is not None:
            # No small system, then the deadline.
            part.fields("BBd", 0, 1, self.deadline_ms)
        return part


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """The points of the object's surface that press on a body; world, m and N."""

    bodies: Numbers
    """Position of the body of each point."""
    slips: NDArray[np.bool_]
    """Whether the point slips."""
    places: Floats
    """Where it is; shape (points, 3)."""
    normals: Floats
    """Out of the body; shape (points, 3)."""
    forces: Floats
    """Force on the object; shape (points, 3)."""
    slip: Floats
    """Slip along the body in this step; shape (points, 3)."""


@dataclass(frozen=True, eq=False)
class BodyLoads:
    """What each body does to the object, in the order of the bodies; world, N and N m."""

    forces: Floats
    """Force on the object; shape (bodies, 3)."""
    torques: Floats
    """Torque about the place of the body's pose at the end; shape (bodies, 3)."""
    normal_forces: Floats
    """Sum of the normal parts; shape (bodies,)."""
    contacts: Numbers
    """Points that press; shape (bodies,)."""


@dataclass(frozen=True, eq=False)
class ContactAnswer(Answer):
    """A step that was made. Displacements are in the object's frame, without the rigid motion."""

    contact: ContactReport
    """How well the law of contact is met."""
    state: ObjectState
    """The object when the step has ended: the next step begins with it."""
    points: ContactPoints
    """Points that press."""
    loads: BodyLoads
    """What the bodies do to the object."""


def candidate_triangles(
    mesh: Mesh,
    state: ObjectState,
    bodies: Sequence[Body],
    step: ContactStep,
    triangles: Numbers | None = None,
) -> tuple[Numbers, Numbers]:
    """Boundary triangles that can touch a body in a step, and the position of the body of each.

    They are chosen from `triangles`, or from all of the mesh's boundary.

    Near are triangles within twice the ways that the bodies and the object can make in the step
    and 2 % of the object's size. What is left out cannot touch.
    """
    boundary = mesh.boundary if triangles is None else triangles
    corners = state.places(mesh)[boundary]
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    low, high = mesh.bounds
    size = float(np.linalg.norm(high - low))
    fall = float(np.linalg.norm(step.gravity)) * step.seconds
    speed = float(np.linalg.norm(state.velocity)) + fall
    turning = float(np.linalg.norm(state.angular_velocity)) * size
    reach = 2.0 * step.seconds * (speed + turning) + _MARGIN_OF_SIZE * size
    near, of_body = [np.zeros((0, 3), U32)], [np.zeros(0, U32)]
    for position, body in enumerate(bodies):
        away = np.minimum(
            body.shape.distance(body.start.to_body(middle)),
            body.shape.distance(body.at_end.to_body(middle)),
        )
        chosen = boundary[away <= radius + reach + 2.0 * body.way]
        near.append(chosen)
        of_body.append(np.full(len(chosen), position, dtype=U32))
    return np.concatenate(near), np.concatenate(of_body)


def contact_payload(
    model: bytes,
    of: Model,
    state: ObjectState,
    bodies: Sequence[Body],
    step: ContactStep,
    nodes: ArrayLike | None,
    precision: Precision,
    fields: WantedFields = (),
) -> bytes:
    """The payload of a `ContactFrame` about the kept model of this name, and what it is of."""
    triangles, of_body = candidate_triangles(of.mesh, state, bodies, step, of.pressed_triangles)
    wanted = np.zeros(0, U32) if nodes is None else numbers(nodes, "wanted nodes")
    moved = Part().fields("7d", *state.pose.numbers)
    moved.fields("6d", *state.velocity, *state.angular_velocity)
    moved.fields("II", len(state.force_nodes), len(state.contact_names))
    part = Part().raw(model).block(step.part()).block(moved)
    part.fields("II?I", len(bodies), len(triangles), nodes is not None, len(wanted))
    part.fields("II", PRECISIONS.index(precision), field_bits(fields, with_contact=True))
    of_state = (state.force_nodes, state.forces, state.contact_names, state.contact_numbers)
    of_bodies = body_arrays(bodies)
    return payload_of(with_trace(part), *of_state, *of_bodies, triangles, of_body, wanted)


def read_contact_answer(reader: PayloadReader, node_count: int) -> ContactAnswer:
    """Reads a whole `ContactAnswer` about a mesh of so many nodes."""
    part = read_answer_part(reader.part.block())
    contact = read_contact_report(reader.part.block())
    *motion, force_count, contact_count = reader.part.block().fields(_STATE)
    point_count, load_count = reader.part.fields(_COUNTS)
    answer = read_whole_answer(reader, part)
    if answer.nodes is not None and len(answer.nodes) and int(answer.nodes.max()) >= node_count:
        reader.claimed(int(answer.nodes.max()), node_count - 1, "as the largest node")
    limits = reader.limits
    force_nodes = reader.numbers(force_count, limits.node_count_max, "nodes with forces")
    forces = reader.floats(force_count, limits.node_count_max, "forces", 3)
    names = reader.numbers(contact_count, limits.dof_count_max, "held contacts", 4)
    of_contacts = reader.floats(contact_count, limits.dof_count_max, "held contacts", 6)
    point_names = reader.numbers(point_count, limits.dof_count_max, "points", 2)
    of_points = reader.floats(point_count, limits.dof_count_max, "points", 12)
    contacts = reader.numbers(load_count, limits.node_count_max, "loads")
    of_loads = reader.floats(load_count, limits.node_count_max, "loads", 7)
    reader.finish()
    moved = np.array(motion)
    state = ObjectState(
        _pose(moved[:7]),
        moved[7:10],
        moved[10:13],
        force_nodes,
        forces,
        names,
        of_contacts,
        answer.on_mesh(node_count),
    )
    return ContactAnswer(
        answer.nodes,
        answer.displacements,
        answer.reactions,
        answer.mask_forces,
        part.report,
        answer.fields,
        None,
        contact,
        state,
        _points(point_names, of_points),
        BodyLoads(of_loads[:, :3], of_loads[:, 3:6], of_loads[:, 6], contacts),
    )


def _pose(given: Floats) -> Pose:
    try:
        return Pose.from_numbers(given)
    except ValueError as error:
        raise BadStream(f"an answer has an impossible pose: {error}") from error


def _points(names: Numbers, of_points: NDArray[Any]) -> ContactPoints:
    three = [of_points[:, first : first + 3] for first in (0, 3, 6, 9)]
    return ContactPoints(names[:, 0], names[:, 1] != 0, *three)


_STATE = struct.Struct("<13dII")
_COUNTS = struct.Struct("<II")
