"""Calls: each request with its bytes and the way to read its reply, without any socket.

The blocking and the asynchronous server share these; neither knows a byte of the protocol.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .answer import (
    Answer,
    LargeAnswer,
    SeveralAnswers,
    read_answer,
    read_large_answer,
    read_several_answers,
)
from .arrays import Numbers, floats, numbers
from .body import Body
from .contact import (
    ContactAnswer,
    ContactStep,
    ObjectState,
    contact_payload,
    read_contact_answer,
)
from .errors import BadStream
from .framing import Kind
from .large import LargeDeformation
from .limits import Limits
from .load_case import LoadCase, Mask, mask_arrays
from .mesh import Mesh
from .model import ELEMENTS, Model
from .payload import Part, PayloadReader
from .question import Precision, Question

T = TypeVar("T")


@dataclass(frozen=True)
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


def hello(client: str, token: str | None) -> Call[Welcome]:
    """Introduces the client, with the token where the server wants one."""
    part = Part().text(client)
    if token is None:
        part.raw(b"\0")
    else:
        part.raw(b"\1").text(token)

    def read(reader: PayloadReader) -> Welcome:
        server, version = reader.text(), reader.text()
        threads = reader.u32()
        limits = Limits(*(reader.u32() for _ in range(6)))
        reader.end_part()
        reader.finish()
        return Welcome(server, version, threads, limits)

    return Call(Kind.HELLO, part.payload(), Kind.WELCOME, read)


def ping(nonce: int = 0x736F6674) -> Call[int]:
    """Asks for a number back."""

    def read(reader: PayloadReader) -> int:
        (back,) = np.frombuffer(reader.raw(8), dtype="<u8")
        reader.finish()
        if int(back) != nonce:
            raise BadStream(f"a ping of {nonce} came back as {back}")
        return nonce

    return Call(Kind.PING, Part().fields("Q", nonce).payload(), Kind.PONG, read)


def solve(model: Model, case: LoadCase, question: Question) -> Call[Answer]:
    """One self-contained linear request."""
    part = model.part().join(_element_choice(model)).join(question.part(case))
    payload = part.payload(*model.arrays(), *question.arrays(case))
    return Call(Kind.SOLVE_ONCE, payload, Kind.ANSWER, read_answer)


def solve_large(
    model: Model, case: LoadCase, large: LargeDeformation, question: Question
) -> Call[LargeAnswer]:
    """One self-contained request at large deformation."""
    part = model.part().join(_element_choice(model)).join(large.part()).join(question.part(case))
    payload = part.payload(*model.arrays(), *question.arrays(case))
    return Call(Kind.SOLVE_LARGE, payload, Kind.LARGE_ANSWER, read_large_answer)


def solve_several(
    model: Model, case: LoadCase, displacements: ArrayLike, estimate: bool, question: Question
) -> Call[SeveralAnswers]:
    """One request with several sets of values of the same known displacements."""
    sets = floats(displacements, "sets of displacements", len(case.known_dofs))
    if len(sets) == 0:
        raise ValueError("there is no set of displacements to solve for")
    case = case.with_displacements(sets[0])
    part = model.part().join(_element_choice(model))
    part.fields("?I", estimate, len(sets) - 1).join(question.part(case))
    payload = part.payload(*model.arrays(), *question.arrays(case), sets[1:])
    return Call(Kind.SOLVE_SEVERAL, payload, Kind.SEVERAL_ANSWERS, read_several_answers)


def have_model(model: bytes) -> Call[bool]:
    """Asks whether the server knows a model."""

    def read(reader: PayloadReader) -> bool:
        known = reader.flag()
        reader.end_part()
        reader.finish()
        return known

    return Call(Kind.HAVE_MODEL, Part().raw(model).payload(), Kind.MODEL_STATE, read)


def upload_model(model: Model, fixed_dofs: Numbers) -> Call[ModelReady]:
    """Sends a model that the server is to keep."""
    part = model.part().fields("II", ELEMENTS.index(model.kept_element), len(fixed_dofs))

    def read(reader: PayloadReader) -> ModelReady:
        name = reader.raw(32)
        unknown, fixed = (int(count) for count in np.frombuffer(reader.raw(16), dtype="<u8"))
        reused = reader.flag()
        for _ in range(7):
            reader.f64()
        reader.end_part()
        reader.finish()
        return ModelReady(name, unknown, fixed, reused)

    payload = part.payload(*model.arrays(), fixed_dofs)
    return Call(Kind.UPLOAD_MODEL, payload, Kind.MODEL_READY, read)


def frame(model: bytes, case: LoadCase, question: Question) -> Call[Answer]:
    """A linear question about a kept model."""
    payload = Part().raw(model).join(question.part(case)).payload(*question.arrays(case))
    return Call(Kind.FRAME, payload, Kind.ANSWER, read_answer)


def large_frame(
    model: bytes, case: LoadCase, large: LargeDeformation, question: Question
) -> Call[LargeAnswer]:
    """A question about a kept model at large deformation, on this session's path."""
    part = Part().raw(model).join(large.part()).join(question.part(case))
    payload = part.payload(*question.arrays(case))
    return Call(Kind.LARGE_FRAME, payload, Kind.LARGE_ANSWER, read_large_answer)


def contact_frame(
    model: bytes,
    mesh: Mesh,
    state: ObjectState,
    bodies: Sequence[Body],
    step: ContactStep,
    nodes: ArrayLike | None,
    precision: Precision,
) -> Call[ContactAnswer]:
    """One step of a kept model that nothing holds, among rigid bodies."""
    payload = contact_payload(model, mesh, state, bodies, step, nodes, precision)

    def read(reader: PayloadReader) -> ContactAnswer:
        return read_contact_answer(reader, mesh.node_count)

    return Call(Kind.CONTACT_FRAME, payload, Kind.CONTACT_ANSWER, read)


def prefetch(model: bytes, nodes: ArrayLike, masks: Sequence[Mask]) -> Call[None]:
    """Names nodes and masks that will probably be touched soon; has no reply."""
    chosen = numbers(nodes, "nodes")
    lengths, of_masks, weights, _ = mask_arrays(masks)
    part = Part().raw(model).fields("III", len(chosen), len(lengths), len(of_masks))
    payload = part.payload(chosen, lengths, of_masks, weights)
    return Call(Kind.PREFETCH, payload, None, _nothing)


def drop(model: bytes) -> Call[None]:
    """Gives a model up; has no reply."""
    return Call(Kind.DROP, Part().raw(model).payload(), None, _nothing)


def _element_choice(model: Model) -> Part:
    return Part().fields("I", (*ELEMENTS, "auto").index(model.asked_element))


def _nothing(_reader: PayloadReader) -> None:
    return None
