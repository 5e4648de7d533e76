"""A connection for asyncio: tasks ask, one task reads the replies of all."""

from __future__ import annotations

import asyncio
import ssl
import time
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import calls
from .address import prepare_socket
from .calls import Call
from .connection import FIRST_PIECE
from .conversation import Conversation
from .errors import ConnectionLost, NoAnswerInTime
from .framing import HEADER_LEN, Header, Kind, check_payload
from .limits import Limits
from .patience import Patience

T = TypeVar("T")
Received = tuple[Header, NDArray[np.uint8]]


class AwaitedConnection:
    """A socket on which requests are asked; tasks may ask at once. Made by `connect`."""

    def __init__(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        patience: Patience,
        limits: Limits,
    ) -> None:
        self.conversation = Conversation(limits)
        self._reader, self._writer, self._patience = reader, writer, patience
        self._order = asyncio.Lock()
        self._has_news = asyncio.Event()
        self._waiting: dict[int, asyncio.Future[Received]] = {}
        self._why_ended: str | None = None
        self._answered_at = self._heard_at = time.monotonic()
        self._listener = asyncio.create_task(self._listen())

    @classmethod
    async def connect(
        cls,
        host: str,
        port: int,
        context: ssl.SSLContext | None,
        patience: Patience,
        limits: Limits,
    ) -> AwaitedConnection:
        """Connects. Raises `ConnectionLost`, `NoAnswerInTime`, and `ssl.SSLError` for a
        certificate that is not trusted."""
        opening = asyncio.open_connection(host, port, ssl=context, limit=FIRST_PIECE)
        try:
            reader, writer = await asyncio.wait_for(opening, patience.answer)
        except asyncio.TimeoutError as error:
            what = f"{host}:{port} does not answer in {patience.answer} s"
            raise NoAnswerInTime(what) from error
        except ssl.SSLCertVerificationError:
            raise
        except OSError as error:
            raise ConnectionLost(f"{host}:{port} cannot be reached: {error}") from error
        prepare_socket(writer.get_extra_info("socket"))
        return cls(reader, writer, patience, limits)

    @property
    def is_open(self) -> bool:
        """Whether nothing has ended the connection, as far as is known."""
        return self._why_ended is None

    async def ask(self, call: Call[T]) -> T:
        """Sends a request and awaits its reply; a task that is cancelled cancels the request too.

        Raises `Refused`, `BadStream`, `ConnectionLost` and `NoAnswerInTime`; after all but a
        refusal of the request the connection is closed.
        """
        reply: asyncio.Future[Received] = asyncio.get_running_loop().create_future()
        request_id = await self._send(call, reply)
        try:
            header, payload = await self._reply(reply)
        except asyncio.CancelledError:
            self._give_up(request_id)
            raise
        try:
            return self.conversation.reply(call, header, payload)
        except BaseException as error:
            if self.conversation.ends_session(header, error):
                self._lose(ConnectionLost(str(error)))
            raise

    async def tell(self, call: Call[None]) -> None:
        """Sends a request that has no reply. Raises `ConnectionLost`."""
        await self._send(call, None)

    def cancel(self) -> None:
        """Says that the requests under way are not wanted any more."""
        for request_id in self.conversation.under_way:
            self._cancel(request_id)

    def close(self) -> None:
        """Ends the session once what was written is on its way; may be called again."""
        self._end("it was closed")
        self._writer.close()

    async def _send(self, call: Call[Any], reply: asyncio.Future[Received] | None) -> int:
        """Sends a request when its turn comes, and gives its number."""
        async with self._order:
            while self._why_ended is None and not self.conversation.has_room(call):
                self._has_news.clear()
                await self._has_news.wait()
            if self._why_ended is not None:
                raise ConnectionLost(f"the connection is closed: {self._why_ended}")
            request_id, data = self.conversation.begin(call)
            if reply is not None:
                self._waiting[request_id] = reply
            self._writer.write(data)
            try:
                await self._drained()
            except asyncio.CancelledError:
                if reply is not None:
                    self._give_up(request_id)
                raise
            except NoAnswerInTime as error:
                self._waiting.pop(request_id, None)
                self._lose(ConnectionLost(str(error)))
                raise
            except OSError as error:
                # Of a server that closed while it was sent to, the last words may be there.
                if reply is None:
                    lost = ConnectionLost(f"the connection broke: {error}")
                    self._lose(lost)
                    raise lost from error
            return request_id

    async def _drained(self) -> None:
        """Waits until what was written is on its way. Raises `NoAnswerInTime` and `OSError`."""
        if self._writer.transport.get_write_buffer_size() == 0:
            return
        # Not by `wait_for`: up to Python 3.11 a task may be cancelled in it and go on all the same.
        draining = asyncio.ensure_future(self._writer.drain())
        try:
            done, _ = await asyncio.wait([draining], timeout=self._patience.answer)
        finally:
            draining.cancel()
        if not done:
            raise NoAnswerInTime("the server does not take the request in time")
        draining.result()

    async def _reply(self, reply: asyncio.Future[Received]) -> Received:
        sent_at = time.monotonic()
        answer, silence = self._patience.answer, self._patience.silence
        if not self._patience.has_end:
            return await reply
        while True:
            now = time.monotonic()
            late_at = None if answer is None else max(sent_at, self._answered_at) + answer
            given_up_at = None if silence is None else max(sent_at, self._heard_at) + silence
            why: ConnectionLost | None = None
            if late_at is not None and now >= late_at:
                why = NoAnswerInTime(f"no answer came in {answer} s")
            elif given_up_at is not None and now >= given_up_at:
                why = ConnectionLost(f"the server has been silent for {silence:g} s")
            if why is not None:
                reply.cancel()
                self._lose(ConnectionLost(str(why)))
                raise why
            until = min(moment for moment in (late_at, given_up_at) if moment is not None)
            done, _ = await asyncio.wait([reply], timeout=until - now)
            if done:
                return reply.result()

    def _give_up(self, request_id: int) -> None:
        """Nobody waits for the reply any more: the server need not work for it."""
        self._waiting.pop(request_id, None)
        if request_id in self.conversation.under_way:
            self._cancel(request_id)

    def _cancel(self, request_id: int) -> None:
        if self._why_ended is None:
            self._writer.write(self.conversation.begin(calls.cancel(request_id))[1])

    async def _listen(self) -> None:
        """Reads what the server says until the connection ends."""
        try:
            while True:
                head = await self._reader.readexactly(HEADER_LEN)
                self._heard_at = time.monotonic()
                header = self.conversation.header(head)
                data = await self._reader.readexactly(header.length)
                self._heard_at = time.monotonic()
                payload = np.frombuffer(data, dtype=np.uint8)
                check_payload(header, payload)
                self._deliver(header, payload)
        except asyncio.IncompleteReadError:
            self._lose(ConnectionLost("the server closed the connection"))
        except OSError as error:
            self._lose(ConnectionLost(f"the connection broke: {error}"))
        except Exception as error:
            self._lose(error)

    def _deliver(self, header: Header, payload: NDArray[np.uint8]) -> None:
        if not self.conversation.answered(header):
            return
        self._answered_at = time.monotonic()
        self._has_news.set()
        if header.request_id != 0:
            reply = self._waiting.pop(header.request_id, None)
            if reply is not None and not reply.done():
                reply.set_result((header, payload))
            return
        # The last words are for all.
        for reply in self._waiting.values():
            if not reply.done():
                reply.set_result((header, payload))
        self._waiting.clear()
        if header.kind == Kind.REJECTED:
            self._end(self.conversation.last_words(payload))

    def _lose(self, error: Exception) -> None:
        """Ends the session with an error for all that wait, and the connection with it."""
        self._end(str(error), error)
        self._writer.transport.abort()

    def _end(self, why: str, error: Exception | None = None) -> None:
        """Ends the session; the first reason stays."""
        if self._why_ended is None:
            self._why_ended = why
        for reply in self._waiting.values():
            if not reply.done():
                reply.set_exception(error or ConnectionLost(self._why_ended))
        self._waiting.clear()
        self._has_news.set()
        if asyncio.current_task() is not self._listener:
            self._listener.cancel()
