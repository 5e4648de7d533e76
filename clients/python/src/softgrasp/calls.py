"""Calls: each request with its bytes and the way to read its reply, without any socket.

The blocking and the asynchronous server share these; neither knows a byte of the protocol.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from numpy.typing import ArrayLike, NDArray

from .answer import (
    Answer,
    Asked,
    LargeAnswer,
    SeveralAnswers,
    read_answer,
    read_large_answer,
    read_several_answers,
)
from .arrays import NO_FLOATS, Floats, Numbers, floats, numbers
from .body import Body, body_needs
from .contact import (
    ContactAnswer,
    ContactStep,
    ObjectState,
    contact_payload,
    read_contact_answer,
)
from .errors import BadStream
from .field_values import WantedFields
from .fields import Fields, Part
from .framing import VERSION, Kind
from .large import LargeDeformation
from .limits import Limits
from .load_case import LoadCase, Mask, mask_arrays
from .model import ELEMENTS, Model
from .payload import PayloadReader, payload_of
from .question import REPORTS, Precision, Question
from .trace import with_trace

T = TypeVar("T")


@dataclass(slots=True)
class Call(Generic[T]):
    """A request that is ready to be sent."""

    kind: Kind
    """Its kind."""
    payload: bytes
    """Its payload."""
    reply: Kind | None
    """Kind of the reply; None for a request that has none."""
    read: Callable[[PayloadReader], T]
    """Reads the reply."""
    needs: frozenset[str] = frozenset()
    """Capabilities without which a server does not understand the request."""


@dataclass(frozen=True)
class Welcome:
    """How a server introduces itself."""

    server: str
    """Name of the server program."""
    version: str
    """Its version, which is not that of the protocol."""
    threads: int
    """Threads that solve a request."""
    limits: Limits
    """What it reads at most."""
    wire: int
    """Version of the wire that both sides speak from now on."""
    capabilities: frozenset[str]
    """What it can do, by name: `large`, `cases`, `contact`, `cancel`, `newest-wins`, …"""
    idle: float | None
    """A client that has sent nothing for so many seconds is given up; None: it may rest."""


@dataclass(frozen=True)
class ModelReady:
    """A model that the server keeps from now on."""

    model: bytes
    """Its name: 32 bytes."""
    unknown_dofs: int
    """Degrees of freedom that frames solve for."""
    fixed_dofs: int
    """Degrees of freedom that stay at zero."""
    reused: bool
    """Whether the server had the model already."""


def hello(
    client: str,
    token: str | None,
    alive_every: float | None = None,
    capabilities: Sequence[str] = (),
) -> Call[Welcome]:
    """Introduces the client, with the token where the server wants one.

    The server is asked to say that it is there when it has said nothing for `alive_every` seconds.
    """
    part = Part().text(client)
    if token is None:
        part.raw(b"\0")
    else:
        part.raw(b"\1").text(token)
    alive_ms = 0 if alive_every is None else max(1, round(1e3 * alive_every))
    part.fields("HH", VERSION, VERSION).texts(capabilities)
    part.fields("I", min(alive_ms, 0xFFFF_FFFF))
    return Call(Kind.HELLO, payload_of(part), Kind.WELCOME, _read_welcome)


def ping(nonce: int = 0x736F6674) -> Call[int]:
    """Asks for a number back."""

    def read(reader: PayloadReader) -> int:
        back = reader.part.u64()
        reader.finish()
        if back != nonce:
            raise BadStream(f"a ping of {nonce} came back as {back}")
        return nonce

    return Call(Kind.PING, payload_of(Part().fields("Q", nonce)), Kind.PONG, read)


def cancel(request_id: int) -> Call[None]:
    """Says that an earlier request is not wanted any more; has no reply."""
    payload = payload_of(Part().fields("Q", request_id))
    return Call(Kind.CANCEL, payload, None, _nothing)


def solve(model: Model, case: LoadCase, question: Question) -> Call[Answer]:
    """One self-contained linear request."""
    asked = _asked(question, case, model.labels)
    return _ask(model, case, question, partial(read_answer, asked=asked))


def solve_large(
    model: Model, case: LoadCase, large: LargeDeformation, question: Question
) -> Call[LargeAnswer]:
    """One self-contained request at large deformation."""
    asked = _asked(question, case, model.labels)
    read = partial(read_large_answer, asked=asked)
    return _ask(model, case, question, read, large=large)


def solve_several(
    subject: Model | bytes,
    case: LoadCase,
    displacements: ArrayLike,
    estimate: bool,
    question: Question,
) -> Call[SeveralAnswers]:
    """One request for several sets of displacements of the case's known degrees of freedom.

    `subject` is a model that comes along, or the name of one that the server keeps.
    """
    if question.quantity is not None:
        raise ValueError("derivatives are those of one case; ask for one case at a time")
    sets = floats(displacements, "sets of displacements", len(case.known_dofs))
    if len(sets) == 0:
        raise ValueError("there is no set of displacements to solve for")
    case = case.with_displacements(sets[0])
    return _ask(subject, case, question, read_several_answers, further=sets[1:], estimate=estimate)


def have_model(model: bytes) -> Call[bool]:
    """Asks whether the server knows a model."""

    def read(reader: PayloadReader) -> bool:
        known = reader.part.flag()
        reader.finish()
        return known

    return Call(Kind.HAVE_MODEL, payload_of(Part().raw(model)), Kind.MODEL_STATE, read)


def upload_model(model: Model, fixed_dofs: Numbers) -> Call[ModelReady]:
    """Sends a model that the server is to keep."""
    part = model.part().fields("II", ELEMENTS.index(model.kept_element), len(fixed_dofs))

    def read(reader: PayloadReader) -> ModelReady:
        fields = reader.part
        ready = ModelReady(fields.raw(32), fields.u64(), fields.u64(), fields.flag())
        reader.finish()
        return ready

    payload = payload_of(with_trace(part), *model.arrays(), fixed_dofs)
    return Call(Kind.UPLOAD_MODEL, payload, Kind.MODEL_READY, read, model.needs)


def frame(
    model: bytes, case: LoadCase, question: Question, labels: tuple[int, ...] = (0,)
) -> Call[Answer]:
    """A linear question about a kept model; `labels` are those of its materials."""
    read = partial(read_answer, asked=_asked(question, case, labels))
    return _ask(model, case, question, read)


def large_frame(
    model: bytes,
    case: LoadCase,
    large: LargeDeformation,
    question: Question,
    labels: tuple[int, ...] = (0,),
) -> Call[LargeAnswer]:
    """A question about a kept model at large deformation, on this session's path."""
    read = partial(read_large_answer, asked=_asked(question, case, labels))
    return _ask(model, case, question, read, large=large)


def contact_frame(
    model: bytes,
    of: Model,
    state: ObjectState,
    bodies: Sequence[Body],
    step: ContactStep,
    nodes: ArrayLike | None,
    precision: Precision,
    fields: WantedFields = (),
) -> Call[ContactAnswer]:
    """One step of a kept model that nothing holds, among rigid bodies."""
    payload = contact_payload(model, of, state, bodies, step, nodes, precision, fields)

    def read(reader: PayloadReader) -> ContactAnswer:
        return read_contact_answer(reader, of.mesh.node_count)

    needs = body_needs(bodies) | step.needs()
    return Call(Kind.CONTACT_FRAME, payload, Kind.CONTACT_ANSWER, read, needs)


def prefetch(model: bytes, nodes: ArrayLike, masks: Sequence[Mask]) -> Call[None]:
    """Names nodes and masks that will probably be touched soon; has no reply."""
    chosen = numbers(nodes, "nodes")
    lengths, of_masks, weights, _ = mask_arrays(masks)
    part = Part().raw(model).fields("III", len(chosen), len(lengths), len(of_masks))
    payload = payload_of(part, chosen, lengths, of_masks, weights)
    return Call(Kind.PREFETCH, payload, None, _nothing)


def drop(model: bytes) -> Call[None]:
    """Gives a model up; has no reply."""
    return Call(Kind.DROP, payload_of(Part().raw(model)), None, _nothing)


def _ask(
    subject: Model | bytes,
    case: LoadCase,
    question: Question,
    read: Callable[[PayloadReader], T],
    *,
    large: LargeDeformation | None = None,
    further: Floats = NO_FLOATS,
    estimate: bool = True,
) -> Call[T]:
    """Everything that one request for displacements says.

    `subject` is a model that comes along, or the name of one that the server keeps; `further` are
    the displacements of further cases, shape (cases, known degrees of freedom).
    """
    mesh: tuple[NDArray[Any], ...] = ()
    if isinstance(subject, Model):
        if question.newest_wins:
            raise ValueError("newest_wins is for frames of a model that the server keeps")
        mesh = subject.arrays()
        element = (*ELEMENTS, "auto").index(subject.asked_element)
        part = Part().fields("I", _OF_MESH).join(subject.part()).fields("I", element)
    else:
        part = Part().raw(_OF_MODEL_BYTES).raw(subject)
    part.raw(b"\1" if question.newest_wins else b"\0").block(question.part(case))
    part.option_block(None if large is None else large.part())
    level = REPORTS.index(question.report)
    part.raw(_FURTHER.pack(len(further), not estimate, level))
    payload = payload_of(with_trace(part), *mesh, *question.arrays(case), further)
    needs = subject.needs if isinstance(subject, Model) else _NOTHING_NEEDED
    if case.has_spread_loads:
        needs |= {"loads"}
    if question.quantity is not None:
        needs |= {"gradients"}
    return Call(Kind.ASK, payload, Kind.ANSWER, read, needs)


def _asked(question: Question, case: LoadCase, labels: tuple[int, ...]) -> Asked | None:
    return None if question.quantity is None else Asked(case, labels)


def _read_welcome(reader: PayloadReader) -> Welcome:
    fields = reader.part
    server, version = fields.text(), fields.text()
    threads = fields.u32()
    limits = _read_limits(fields.block())
    wire, capabilities, idle_ms = fields.u16(), fields.texts(), fields.u64()
    reader.finish()
    idle = 1e-3 * idle_ms if idle_ms else None
    return Welcome(server, version, threads, limits, wire, frozenset(capabilities), idle)


def _read_limits(fields: Fields) -> Limits:
    return Limits(*(fields.u32() for _ in range(6)))


def _nothing(_reader: PayloadReader) -> None:
    return None


_OF_MESH, _OF_MODEL = 0, 1
"""What a request is about, on the wire."""
_OF_MODEL_BYTES = struct.pack("<I", _OF_MODEL)
_FURTHER = struct.Struct("<I?I")
_NOTHING_NEEDED: frozenset[str] = frozenset()
