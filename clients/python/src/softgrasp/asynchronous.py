"""A server that is awaited: the same calls as those of `Server`, for asyncio."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, TypeVar

from numpy.typing import ArrayLike

from . import calls
from .address import Tls, split_address, tls_context
from .answer import Answer, LargeAnswer, SeveralAnswers
from .awaited import AwaitedConnection
from .body import Body
from .calls import Call, ModelReady
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


class AsyncServer(Session):
    """A session with a server, for asyncio; tasks may ask at once and are answered in turn.

    Made by `await AsyncServer.connect(…)` or `await AsyncServer.spawn(…)`, used in `async with`.
    Errors are those of `Server`. A task that is cancelled cancels its request on the server, and
    the session goes on.
    """

    _connection: AwaitedConnection

    @classmethod
    async def connect(
        cls,
        address: str,
        *,
        token: str | None = None,
        tls: Tls = None,
        timeout: float | None = None,
        limits: Limits | None = None,
        alive_every: float | None = None,
    ) -> AsyncServer:
        """Connects to `HOST:PORT` and introduces itself; arguments and errors as of `Server`."""
        server = cls(address, token, tls, timeout, limits, alive_every)
        await server._connect()
        return server

    @classmethod
    async def spawn(
        cls,
        program: str | os.PathLike[str] | None = None,
        *,
        threads: int | None = None,
        arguments: Sequence[str] = (),
        timeout: float | None = None,
    ) -> AsyncServer:
        """Starts a server of one's own on this machine; arguments as of `Server.spawn`."""
        started = await asyncio.to_thread(ServerProgram, program, arguments, threads=threads)
        try:
            server = await cls.connect(started.address, timeout=timeout)
        except BaseException:
            started.end()
            raise
        server._program = started
        return server

    @property
    def is_open(self) -> bool:
        """Whether nothing has ended the session, as far as is known."""
        return self._connection.is_open

    async def solve(self, model: Model, case: LoadCase, **options: Unpack[Options]) -> Answer:
        """As `Server.solve`."""
        return await self._ask(calls.solve(model, case, Question(**options)))

    async def solve_several(
        self,
        model: Model,
        case: LoadCase,
        displacements: ArrayLike,
        *,
        estimate: bool = True,
        **options: Unpack[Options],
    ) -> SeveralAnswers:
        """As `Server.solve_several`."""
        call = calls.solve_several(model, case, displacements, estimate, Question(**options))
        return await self._ask(call)

    async def solve_large(
        self,
        model: Model,
        case: LoadCase,
        large: LargeDeformation = AT_LARGE,
        **options: Unpack[Options],
    ) -> LargeAnswer:
        """As `Server.solve_large`."""
        return await self._ask(calls.solve_large(model, case, large, Question(**options)))

    async def keep(self, model: Model, fixed: ArrayLike = ()) -> AsyncKeptModel:
        """As `Server.keep`."""
        kept = AsyncKeptModel(self, model, fixed)
        if not await self._ask(calls.have_model(kept.hash)):
            await kept.upload()
        return kept

    async def ping(self) -> None:
        """As `Server.ping`."""
        await self._ask(calls.ping())

    def cancel(self) -> None:
        """As `Server.cancel`; does not wait for anything."""
        self._connection.cancel()

    async def reconnect(self) -> None:
        """As `Server.reconnect`."""
        self._connection.close()
        await self._connect()

    async def close(self) -> None:
        """Ends the session, and a server that was spawned; may be called again."""
        self._connection.close()
        if self._program is not None:
            await asyncio.to_thread(self._program.end)

    async def __aenter__(self) -> AsyncServer:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()

    async def _connect(self) -> None:
        host, port = split_address(self.address)
        context = tls_context(self._tls)
        connection = await AwaitedConnection.connect(
            host, port, context, self._patience, self._limits
        )
        self._connection = connection
        try:
            self._welcome = await self._ask(self._hello())
        except BaseException:
            connection.close()
            raise
        connection.conversation.server_limits = self._welcome.limits

    async def _ask(self, call: Call[T]) -> T:
        self._check(call)
        return await self._connection.ask(call)

    async def _tell(self, call: Call[None]) -> None:
        await self._connection.tell(call)


class AsyncKeptModel(NamedModel):
    """A model that a server keeps, for asyncio; methods are those of `KeptModel`."""

    def __init__(self, server: AsyncServer, model: Model, fixed: ArrayLike) -> None:
        super().__init__(model, fixed)
        self._server = server

    async def upload(self) -> ModelReady:
        """As `KeptModel.upload`."""
        return await self._server._ask(calls.upload_model(self.model, self.fixed_dofs))

    async def frame(self, case: LoadCase, **options: Unpack[FrameOptions]) -> Answer:
        """As `KeptModel.frame`."""
        return await self._ask(calls.frame(self.hash, case, self._question(options), self.model.labels))

    async def large_frame(
        self,
        case: LoadCase,
        large: LargeDeformation = AT_LARGE,
        **options: Unpack[FrameOptions],
    ) -> LargeAnswer:
        """As `KeptModel.large_frame`."""
        return await self._ask(
            calls.large_frame(
                self.hash, case, large, self._question(options), self.model.labels
            )
        )

    async def solve_several(
        self, case: LoadCase, displacements: ArrayLike, **options: Unpack[FrameOptions]
    ) -> SeveralAnswers:
        """As `KeptModel.solve_several`."""
        call = calls.solve_several(self.hash, case, displacements, True, Question(**options))
        return await self._ask(call)

    async def gradient(
        self,
        case: LoadCase,
        *,
        by_displacements: ArrayLike | None = None,
        by_reactions: ArrayLike | None = None,
        answer: Answer | None = None,
    ) -> Gradient:
        """As `KeptModel.gradient`."""
        question = GradientQuestion(
            self.model, self.fixed_dofs, case, by_displacements, by_reactions
        )
        adjoint = self.frame(question.adjoint)
        if answer is None and question.needs_answer:
            # Both travel at once.
            of_adjoint, answer = await asyncio.gather(adjoint, self.frame(case))
        else:
            of_adjoint = await adjoint
        return question.gradient(of_adjoint, answer)

    async def contact_frame(
        self,
        state: ObjectState,
        bodies: Sequence[Body],
        step: ContactStep,
        *,
        nodes: ArrayLike | None = None,
        precision: Precision = "f64",
        fields: WantedFields = (),
    ) -> ContactAnswer:
        """As `KeptModel.contact_frame`."""
        of = self.model
        return await self._ask(
            calls.contact_frame(self.hash, of, state, bodies, step, nodes, precision, fields)
        )

    async def prefetch(self, nodes: ArrayLike = (), masks: Sequence[Mask] = ()) -> None:
        """As `KeptModel.prefetch`."""
        await self._server._tell(calls.prefetch(self.hash, nodes, masks))

    async def drop(self) -> None:
        """As `KeptModel.drop`."""
        await self._server._tell(calls.drop(self.hash))

    async def _ask(self, call: Call[T]) -> T:
        try:
            return await self._server._ask(call)
        except UnknownModel:
            await self.upload()
            return await self._server._ask(call)
