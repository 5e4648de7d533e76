"""A server that is asked and waited for."""

from __future__ import annotations

import os
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, TypeVar

from numpy.typing import ArrayLike

from . import calls
from .address import Tls, split_address, tls_context
from .answer import Answer, LargeAnswer, SeveralAnswers
from .body import Body
from .calls import Call, ModelReady
from .connection import Connection
from .contact import ContactAnswer, ContactStep, ObjectState
from .errors import UnknownModel
from .field_values import WantedFields
from .gradient import GradientQuestion
from .large import AT_LARGE, LargeDeformation
from .limits import Limits
from .load_case import LoadCase, Mask
from .model import Model
from .program import ServerProgram
from .quantity import Gradient
from .question import FrameOptions, Options, Precision, Question
from .session import NamedModel, Session

if TYPE_CHECKING:
    from typing_extensions import Unpack

T = TypeVar("T")


class Server(Session):
    """A session with a server; threads may ask at once and are answered in turn.

    Use it in a `with` block, or call `close`. Everything that asks raises `Refused` (by its
    subclasses, one for each number), `ConnectionLost`, `NoAnswerInTime` and `BadStream`, and
    `ValueError` for arguments that no server could take.
    """

    def __init__(
        self,
        address: str,
        *,
        token: str | None = None,
        tls: Tls = None,
        timeout: float | None = None,
        limits: Limits | None = None,
        alive_every: float | None = None,
    ) -> None:
        """Connects to `HOST:PORT` and introduces itself.

        `token` is what the server was started with, `tls` how the way is encrypted (see
        `softgrasp.address.Tls`), `timeout` how many seconds an answer may take: None waits as
        long as it takes. `limits` are what is read at most. With `alive_every` the server says
        that it is there when it has said nothing for so many seconds (0.1 at least), and is given
        up after three times its silence, however long it may work. Raises what every request
        raises, `ssl.SSLError` for a certificate that is not trusted, and `OSError` for one not
        readable.
        """
        super().__init__(address, token, tls, timeout, limits, alive_every)
        self._connect()

    @classmethod
    def spawn(
        cls,
        program: str | os.PathLike[str] | None = None,
        *,
        threads: int | None = None,
        arguments: Sequence[str] = (),
        timeout: float | None = None,
    ) -> Server:
        """Starts a server of one's own on this machine and connects to it.

        It listens on a free port of the loopback and ends with the session. `program` is its path;
        without one `fea-server` is looked for on the PATH. `arguments` are further options of the
        program. Raises `ServerNotStarted`.
        """
        started = ServerProgram(program, arguments, threads=threads)
        try:
            server = cls(started.address, timeout=timeout)
        except BaseException:
            started.end()
            raise
        server._program = started
        return server

    @property
    def is_open(self) -> bool:
        """Whether nothing has ended the session, as far as is known."""
        return self._connection.is_open

    def solve(self, model: Model, case: LoadCase, **options: Unpack[Options]) -> Answer:
        """Solves a load case once, by linear elasticity; the server keeps nothing.

        Options are those of `Question`.
        """
        return self._ask(calls.solve(model, case, Question(**options)))

    def solve_several(
        self,
        model: Model,
        case: LoadCase,
        displacements: ArrayLike,
        *,
        estimate: bool = True,
        **options: Unpack[Options],
    ) -> SeveralAnswers:
        """Solves for several sets of values of the case's known displacements by one factor.

        `displacements` has the shape (sets, known degrees of freedom), m; the values of `case`
        itself do not matter. Forces act in all sets, masks are not allowed. Without `estimate`
        the report has no estimates, which then take no time.
        """
        call = calls.solve_several(model, case, displacements, estimate, Question(**options))
        return self._ask(call)

    def solve_large(
        self,
        model: Model,
        case: LoadCase,
        large: LargeDeformation = AT_LARGE,
        **options: Unpack[Options],
    ) -> LargeAnswer:
        """Finds an equilibrium at large deformation, from rest; the server keeps nothing."""
        return self._ask(calls.solve_large(model, case, large, Question(**options)))

    def keep(self, model: Model, fixed: ArrayLike = ()) -> KeptModel:
        """Has the server keep a model for frames; uploads it unless it is there already.

        All three axes of the nodes `fixed` stay at zero in frames that do not prescribe them.
        """
        return KeptModel(self, model, fixed)

    def ping(self) -> None:
        """Waits until the server has done all that was asked before."""
        self._ask(calls.ping())

    def cancel(self) -> None:
        """Says, from another thread, that the requests under way are not wanted any more.

        The server refuses them as `Cancelled`, unless it has answered by then; the session goes on.
        """
        self._connection.cancel()

    def reconnect(self) -> None:
        """Ends the session and begins a new one with the same server.

        Models stay where the server lives on; a large deformation begins at rest again.
        """
        self._connection.close()
        self._connect()

    def close(self) -> None:
        """Ends the session, and a server that was spawned; may be called again."""
        self._connection.close()
        if self._program is not None:
            self._program.end()

    def __enter__(self) -> Server:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _connect(self) -> None:
        host, port = split_address(self.address)
        context = tls_context(self._tls)
        self._connection = Connection(host, port, context, self._patience, self._limits)
        try:
            self._welcome = self._ask(self._hello())
        except BaseException:
            self._connection.close()
            raise
        self._connection.conversation.server_limits = self._welcome.limits

    def _ask(self, call: Call[T]) -> T:
        self._check(call)
        return self._connection.ask(call)

    def _tell(self, call: Call[None]) -> None:
        self._connection.tell(call)


class KeptModel(NamedModel):
    """A model that a server keeps: frames send only what changes.

    A server may have to forget it; it is then uploaded again by itself.
    """

    def __init__(self, server: Server, model: Model, fixed: ArrayLike) -> None:
        super().__init__(model, fixed)
        self._server = server
        if not server._ask(calls.have_model(self.hash)):
            self.upload()

    def upload(self) -> ModelReady:
        """Sends the model, which makes it ready for frames; without harm where it is there."""
        return self._server._ask(calls.upload_model(self.model, self.fixed_dofs))

    def frame(self, case: LoadCase, **options: Unpack[FrameOptions]) -> Answer:
        """Solves a load case by linear elasticity; the fixed nodes stay at zero."""
        return self._ask(calls.frame(self.hash, case, self._question(options), self.model.labels))

    def large_frame(
        self,
        case: LoadCase,
        large: LargeDeformation = AT_LARGE,
        **options: Unpack[FrameOptions],
    ) -> LargeAnswer:
        """Finds an equilibrium at large deformation, from this session's last one on the model."""
        return self._ask(
            calls.large_frame(
                self.hash, case, large, self._question(options), self.model.labels
            )
        )

    def solve_several(
        self, case: LoadCase, displacements: ArrayLike, **options: Unpack[FrameOptions]
    ) -> SeveralAnswers:
        """Solves for several sets of values of the case's known displacements in one request.

        `displacements` has the shape (sets, known degrees of freedom), m; forces and masks act in
        all sets.
        """
        call = calls.solve_several(self.hash, case, displacements, True, Question(**options))
        return self._ask(call)

    def gradient(
        self,
        case: LoadCase,
        *,
        by_displacements: ArrayLike | None = None,
        by_reactions: ArrayLike | None = None,
        answer: Answer | None = None,
    ) -> Gradient:
        """Derivatives of a quantity J at a load case, by one more solve with the same factor.

        J is told by its own derivatives there: `by_displacements` by each displacement (nodes, 3),
        `by_reactions` by the reaction at each known degree of freedom of the case, in its order. `answer`
        is that to the case, of all nodes; without it the case is asked once more. Linear elasticity;
        by places of nodes and materials with `t4` only; all elements and large deformation have
        derivatives by `quantity=` of the other methods. `ValueError` for masks and other shapes.
        """
        question = GradientQuestion(
            self.model, self.fixed_dofs, case, by_displacements, by_reactions
        )
        adjoint = self.frame(question.adjoint)
        if answer is None and question.needs_answer:
            answer = self.frame(case)
        return question.gradient(adjoint, answer)

    def contact_frame(
        self,
        state: ObjectState,
        bodies: Sequence[Body],
        step: ContactStep,
        *,
        nodes: ArrayLike | None = None,
        precision: Precision = "f64",
        fields: WantedFields = (),
    ) -> ContactAnswer:
        """Makes one step in time of the free object among rigid bodies, with friction.

        The model must have no fixed nodes. `state` is that of the last answer, or
        `ObjectState(pose)` for an object that is put down; the server keeps nothing of it. With
        `nodes`, which should then be the boundary's at least, others count as not displaced when
        triangles near a body are looked for.
        """
        of = self.model
        return self._ask(
            calls.contact_frame(self.hash, of, state, bodies, step, nodes, precision, fields)
        )

    def prefetch(self, nodes: ArrayLike = (), masks: Sequence[Mask] = ()) -> None:
        """Names what will probably be touched soon, so that its first frame takes less time."""
        self._server._tell(calls.prefetch(self.hash, nodes, masks))

    def drop(self) -> None:
        """Gives the model up; the server forgets it unless another session holds it."""
        self._server._tell(calls.drop(self.hash))

    def _ask(self, call: Call[T]) -> T:
        try:
            return self._server._ask(call)
        except UnknownModel:
            self.upload()
            return self._server._ask(call)
