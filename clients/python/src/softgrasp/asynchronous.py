"""A server that is awaited: the same calls as those of `Server`, for asyncio."""

from __future__ import annotations

import asyncio
import os
import ssl
from collections.abc import Sequence
from types import TracebackType
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import calls
from .address import Tls, prepare_socket, split_address, tls_context
from .answer import Answer, LargeAnswer, SeveralAnswers
from .body import Body
from .calls import Call, ModelReady
from .connection import FIRST_PIECE
from .contact import ContactAnswer, ContactStep, ObjectState
from .conversation import Conversation
from .errors import ConnectionLost, NoAnswerInTime, UnknownModel
from .framing import HEADER_LEN, Header
from .large import AT_LARGE, LargeDeformation
from .limits import Limits
from .load_case import LoadCase, Mask
from .model import Model
from .program import ServerProgram
from .question import Options, Precision, Question
from .session import CLIENT, NamedModel, Session

if TYPE_CHECKING:
    from typing_extensions import Unpack

T = TypeVar("T")


class AsyncServer(Session):
    """A session with a server, for asyncio; one request at a time, tasks take turns.

    Made by `await AsyncServer.connect(…)` or `await AsyncServer.spawn(…)`, used in `async with`.
    Errors are those of `Server`. A request whose task is cancelled closes the connection, because
    its reply would come in place of the next one.
    """

    def __init__(
        self,
        address: str,
        token: str | None,
        tls: Tls,
        timeout: float | None,
        limits: Limits | None,
    ) -> None:
        """Made by `connect`, which also connects."""
        super().__init__(address, token, tls, timeout, limits)
        self._turn = asyncio.Lock()
        self._writer: asyncio.StreamWriter | None = None

    @classmethod
    async def connect(
        cls,
        address: str,
        *,
        token: str | None = None,
        tls: Tls = None,
        timeout: float | None = None,
        limits: Limits | None = None,
    ) -> AsyncServer:
        """Connects to `HOST:PORT` and introduces itself; arguments and errors as of `Server`."""
        server = cls(address, token, tls, timeout, limits)
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
        return self._writer is not None

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

    async def reconnect(self) -> None:
        """As `Server.reconnect`."""
        self._hang_up()
        await self._connect()

    async def close(self) -> None:
        """Ends the session, and a server that was spawned; may be called again."""
        self._hang_up()
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
        opening = asyncio.open_connection(host, port, ssl=context, limit=FIRST_PIECE)
        try:
            reader, writer = await asyncio.wait_for(opening, self._timeout)
        except asyncio.TimeoutError as error:
            raise NoAnswerInTime(f"{self.address} does not answer in {self._timeout} s") from error
        except ssl.SSLCertVerificationError:
            raise
        except OSError as error:
            raise ConnectionLost(f"{self.address} cannot be reached: {error}") from error
        self._reader, self._writer = reader, writer
        prepare_socket(writer.get_extra_info("socket"))
        self._conversation = Conversation(self._limits)
        try:
            self._welcome = await self._ask(calls.hello(CLIENT, self._token))
        except BaseException:
            self._hang_up()
            raise
        self._conversation.server_limits = self._welcome.limits

    def _hang_up(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None

    async def _ask(self, call: Call[T]) -> T:
        async with self._turn:
            if self._writer is None:
                raise ConnectionLost("the connection is closed")
            data = self._conversation.begin(call)
            header: Header | None = None
            try:
                answered = await asyncio.wait_for(self._exchange(data), self._timeout)
                header, payload = answered
                return self._conversation.reply(call, header, payload)
            except BaseException as error:
                if header is None or self._conversation.ends_session(header, error):
                    self._hang_up()
                if isinstance(error, asyncio.TimeoutError):
                    raise NoAnswerInTime(f"no answer came in {self._timeout} s") from error
                if isinstance(error, asyncio.IncompleteReadError):
                    raise ConnectionLost("the server closed the connection") from error
                if isinstance(error, OSError) and not isinstance(error, ConnectionLost):
                    raise ConnectionLost(f"the connection broke: {error}") from error
                raise

    async def _exchange(self, data: bytes) -> tuple[Header, NDArray[np.uint8]]:
        assert self._writer is not None
        self._writer.write(data)
        try:
            await self._writer.drain()
        except OSError:
            # Of a server that closed while it was sent to, the last words may be there.
            pass
        header = self._conversation.header(await self._reader.readexactly(HEADER_LEN))
        payload = await self._reader.readexactly(header.length)
        return header, np.frombuffer(payload, dtype=np.uint8)

    async def _tell(self, call: Call[None]) -> None:
        async with self._turn:
            if self._writer is None:
                raise ConnectionLost("the connection is closed")
            self._writer.write(self._conversation.begin(call))
            try:
                await self._writer.drain()
            except OSError as error:
                self._hang_up()
                raise ConnectionLost(f"the connection broke: {error}") from error


class AsyncKeptModel(NamedModel):
    """A model that a server keeps, for asyncio; methods are those of `KeptModel`."""

    def __init__(self, server: AsyncServer, model: Model, fixed: ArrayLike) -> None:
        super().__init__(model, fixed)
        self._server = server

    async def upload(self) -> ModelReady:
        """As `KeptModel.upload`."""
        return await self._server._ask(calls.upload_model(self.model, self.fixed_dofs))

    async def frame(self, case: LoadCase, **options: Unpack[Options]) -> Answer:
        """As `KeptModel.frame`."""
        return await self._ask(calls.frame(self.hash, case, Question(**options)))

    async def large_frame(
        self,
        case: LoadCase,
        large: LargeDeformation = AT_LARGE,
        **options: Unpack[Options],
    ) -> LargeAnswer:
        """As `KeptModel.large_frame`."""
        return await self._ask(calls.large_frame(self.hash, case, large, Question(**options)))

    async def contact_frame(
        self,
        state: ObjectState,
        bodies: Sequence[Body],
        step: ContactStep,
        *,
        nodes: ArrayLike | None = None,
        precision: Precision = "f64",
    ) -> ContactAnswer:
        """As `KeptModel.contact_frame`."""
        mesh = self.model.mesh
        return await self._ask(
            calls.contact_frame(self.hash, mesh, state, bodies, step, nodes, precision)
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
