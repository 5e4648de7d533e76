"""A blocking connection: threads ask, one of those that wait reads the replies of all."""

from __future__ import annotations

import contextlib
import socket
import ssl
import threading
import time
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import calls
from .address import prepare_socket
from .calls import Call
from .conversation import Conversation
from .errors import BadStream, ConnectionLost, NoAnswerInTime, UnsupportedVersion
from .framing import HEADER_LEN, Header, Kind, check_payload
from .limits import Limits
from .patience import Patience
from .stream import Stream, TlsStream

T = TypeVar("T")

FIRST_PIECE = 1 << 20
"""Memory for a payload grows from so many bytes with the bytes that come."""


class _Waiting:
    """A thread that waits for the reply to a request."""

    sent_at: float | None = None
    reply: tuple[Header, NDArray[np.uint8]] | None = None


class Connection:
    """A socket on which requests are asked; threads may ask at once."""

    def __init__(
        self,
        host: str,
        port: int,
        context: ssl.SSLContext | None,
        patience: Patience,
        limits: Limits,
    ) -> None:
        """Connects. Raises `ConnectionLost`, `NoAnswerInTime`, and `ssl.SSLError` for a
        certificate that is not trusted."""
        self.conversation = Conversation(limits)
        self._patience, self._silence = patience, patience.silence
        self._head = memoryview(bytearray(HEADER_LEN))
        self._order = threading.Lock()
        """Of the thread whose request is the next to be sent."""
        self._sending = threading.Lock()
        """Of the thread whose frame is on the way out."""
        self._lock = threading.Lock()
        """Guards what follows, and the conversation."""
        self._state = threading.Condition(self._lock)
        self._sleepers = 0
        self._waiting: dict[int, _Waiting] = {}
        self._is_read = False
        self._why_ended: str | None = None
        self._answered_at = time.monotonic()
        self._stream = _connected(host, port, context, patience)
        self._has_ended = threading.Event()
        if patience.alive_every is not None:
            listener = threading.Thread(target=self._listen, args=(patience.alive_every,))
            listener.daemon = True
            listener.start()

    @property
    def is_open(self) -> bool:
        """Whether nothing has ended the connection, as far as is known."""
        return self._why_ended is None

    def ask(self, call: Call[T]) -> T:
        """Sends a request and waits for its reply.

        Raises `Refused`, `BadStream`, `ConnectionLost` and `NoAnswerInTime`. After all but a
        refusal of the request the connection is closed, for its bytes cannot be told apart any
        more; the same holds where the wait is interrupted.
        """
        waiting, header, lost = _Waiting(), None, None
        try:
            self._send(call, waiting)
        except NoAnswerInTime:
            raise
        except ConnectionLost as error:
            if waiting.sent_at is None:
                raise
            # Of a server that closed while it was sent to, the last words may be there.
            lost = error
        try:
            header, payload = self._reply(waiting)
            return self.conversation.reply(call, header, payload)
        except BaseException as error:
            if header is None or self.conversation.ends_session(header, error):
                self._end(str(error))
            if lost is not None and header is None and not isinstance(error, NoAnswerInTime):
                raise lost from error
            raise

    def tell(self, call: Call[None]) -> None:
        """Sends a request that has no reply. Raises `ConnectionLost` and `NoAnswerInTime`."""
        try:
            self._send(call, None)
        except ConnectionLost as error:
            self._end(str(error))
            raise

    def cancel(self) -> None:
        """Says that the requests under way are not wanted any more. Raises as `tell`."""
        # Whatever is under way has been sent by then.
        with self._sending:
            with self._lock:
                if self._why_ended is not None:
                    return
                numbers = self.conversation.under_way
                frames = [self.conversation.begin(calls.cancel(number))[1] for number in numbers]
            self._send_bytes(b"".join(frames), time.monotonic())

    def close(self) -> None:
        """Ends the session, also one that waits in another thread; may be called again."""
        self._end("it was closed")
        with self._lock:
            given_up = time.monotonic() + 1.0
            while self._is_read and time.monotonic() < given_up:
                self._sleep(0.1)
        with self._sending:
            self._stream.close()

    def _send(self, call: Call[Any], waiting: _Waiting | None) -> None:
        """Sends a request when its turn comes; `waiting` is to have its reply."""
        with self._order:
            with self._lock:
                while self._why_ended is None and not self.conversation.has_room(call):
                    self._sleep(None)
            with self._sending:
                with self._lock:
                    if self._why_ended is not None:
                        raise ConnectionLost(f"the connection is closed: {self._why_ended}")
                    request_id, data = self.conversation.begin(call)
                    now = time.monotonic()
                    if waiting is not None:
                        waiting.sent_at = now
                        self._waiting[request_id] = waiting
                self._send_bytes(data, now)

    def _send_bytes(self, data: bytes, since: float) -> None:
        answer = self._patience.answer
        try:
            self._stream.send(data, None if answer is None else since + answer)
        except TimeoutError as error:
            self._end("the server does not take a request in time")
            raise NoAnswerInTime("the server does not take the request in time") from error
        except OSError as error:
            what = f"the connection broke while a request was sent: {error}"
            raise ConnectionLost(what) from error
        except BaseException:
            self._end("a request was interrupted")
            raise

    def _reply(self, waiting: _Waiting) -> tuple[Header, NDArray[np.uint8]]:
        """The reply to a request; reads those of others too, unless another thread does."""
        while True:
            with self._lock:
                while waiting.reply is None and self._is_read and self._why_ended is None:
                    self._sleep(self._until_late(waiting))
                if waiting.reply is not None:
                    return waiting.reply
                if self._why_ended is not None:
                    raise ConnectionLost(self._why_ended)
                self._is_read = True
            self._read(self._deadline(waiting))

    def _read(self, deadline: float | None) -> None:
        """Reads one frame and gives it to whoever waits for it. Whoever calls has the turn."""
        try:
            header, payload = self._receive_frame(deadline)
        except BaseException as error:
            self._leave(str(error))
            raise
        with self._lock:
            self._is_read = False
            try:
                self._deliver(header, payload)
            except BadStream as error:
                self._why_ended = self._why_ended or str(error)
                raise
            finally:
                self._wake()

    def _leave(self, why: str) -> None:
        """Ends the session and the turn of reading."""
        with self._lock:
            self._is_read = False
        self._end(why)

    def _deliver(self, header: Header, payload: NDArray[np.uint8]) -> None:
        if not self.conversation.answered(header):
            return
        self._answered_at = time.monotonic()
        if header.request_id != 0:
            self._waiting.pop(header.request_id).reply = header, payload
            return
        # The last words are for all.
        for waiting in self._waiting.values():
            waiting.reply = header, payload
        self._waiting.clear()
        if header.kind == Kind.REJECTED:
            self._why_ended = self.conversation.last_words(payload)

    def _sleep(self, timeout: float | None) -> None:
        """Waits for news, with the lock."""
        self._sleepers += 1
        try:
            self._state.wait(timeout)
        finally:
            self._sleepers -= 1

    def _wake(self) -> None:
        """Tells whoever waits that there is news, with the lock."""
        if self._sleepers:
            self._state.notify_all()

    def _until_late(self, waiting: _Waiting) -> float | None:
        """Seconds until the server has taken too long. Raises `NoAnswerInTime`."""
        deadline = self._deadline(waiting)
        if deadline is None:
            return None
        left = deadline - time.monotonic()
        if left <= 0.0:
            raise self._late()
        return left

    def _deadline(self, waiting: _Waiting) -> float | None:
        answer = self._patience.answer
        if answer is None or waiting.sent_at is None:
            return None
        return max(waiting.sent_at, self._answered_at) + answer

    def _look_at_clock(self, deadline: float | None) -> None:
        if deadline is not None and time.monotonic() > deadline:
            raise self._late()

    def _late(self) -> NoAnswerInTime:
        return NoAnswerInTime(f"no answer came in {self._patience.answer} s")

    def _receive_frame(self, deadline: float | None) -> tuple[Header, NDArray[np.uint8]]:
        self._fill(self._head, deadline)
        header = self.conversation.header(bytes(self._head))
        payload = np.empty(min(header.length, FIRST_PIECE), dtype=np.uint8)
        self._fill(payload.data, deadline)
        while len(payload) < header.length:
            # What is announced is taken on trust only as far as what has come.
            grown = np.empty(min(2 * len(payload), header.length), dtype=np.uint8)
            grown[: len(payload)] = payload
            self._fill(grown.data[len(payload) :], deadline)
            payload = grown
        check_payload(header, payload)
        return header, payload

    def _fill(self, view: memoryview, deadline: float | None) -> None:
        at, silence = 0, self._silence
        until = deadline
        while at < len(view):
            if at:
                # Whoever sends byte by byte never lets a wait end.
                self._look_at_clock(deadline)
            if silence is not None:
                given_up = time.monotonic() + silence
                until = given_up if deadline is None else min(deadline, given_up)
            try:
                count = self._stream.receive(view[at:] if at else view, until)
            except TimeoutError as error:
                if until == deadline:
                    raise self._late() from error
                raise ConnectionLost(f"the server has been silent for {silence:g} s") from error
            except OSError as error:
                raise ConnectionLost(f"the connection broke: {error}") from error
            if count == 0:
                raise ConnectionLost("the server closed the connection")
            at += count

    def _listen(self, every: float) -> None:
        """Takes what the server says while nobody asks, so that it can go on saying it."""
        while not self._has_ended.wait(every):
            with self._lock:
                if self._is_read or self._waiting:
                    continue
                self._is_read = True
            with contextlib.suppress(ConnectionLost, BadStream, UnsupportedVersion):
                self._read_what_is_there()

    def _read_what_is_there(self) -> None:
        while self._stream.is_readable():
            self._read(None)
            with self._lock:
                if self._is_read or self._why_ended is not None:
                    return
                self._is_read = True
        with self._lock:
            self._is_read = False
            self._wake()

    def _end(self, why: str) -> None:
        """Ends the session; the first reason stays."""
        with self._lock:
            self._why_ended = self._why_ended or why
            self._wake()
        self._has_ended.set()
        self._stream.shut_down()


def _connected(host: str, port: int, context: ssl.SSLContext | None, patience: Patience) -> Stream:
    timeout = patience.answer
    try:
        plain = socket.create_connection((host, port), timeout=timeout)
    except TimeoutError as error:
        raise NoAnswerInTime(f"{host}:{port} does not answer in {timeout} s") from error
    except OSError as error:
        raise ConnectionLost(f"{host}:{port} cannot be reached: {error}") from error
    prepare_socket(plain)
    if context is None:
        return Stream(plain, patience.has_end)
    try:
        return TlsStream(context.wrap_socket(plain, server_hostname=host))
    except ssl.SSLCertVerificationError:
        plain.close()
        raise
    except TimeoutError as error:
        plain.close()
        raise NoAnswerInTime(f"{host}:{port} agrees on no encryption in time") from error
    except OSError as error:
        plain.close()
        raise ConnectionLost(f"{host}:{port} agrees on no encryption: {error}") from error
