"""A blocking connection: one request, one reply."""

from __future__ import annotations

import contextlib
import socket
import ssl
import threading
import time
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from .address import prepare_socket
from .calls import Call
from .conversation import Conversation
from .errors import ConnectionLost, NoAnswerInTime
from .framing import HEADER_LEN, Header
from .limits import Limits

T = TypeVar("T")

FIRST_PIECE = 1 << 20
"""Memory for a payload grows from so many bytes with the bytes that come."""


class Connection:
    """A socket on which one request at a time is asked; threads take turns."""

    def __init__(
        self,
        host: str,
        port: int,
        context: ssl.SSLContext | None,
        timeout: float | None,
        limits: Limits,
    ) -> None:
        """Connects. Raises `ConnectionLost`, `NoAnswerInTime`, and `ssl.SSLError` for a
        certificate that is not trusted."""
        self.conversation = Conversation(limits)
        self._lock = threading.Lock()
        self._timeout = timeout
        self._socket: socket.socket | ssl.SSLSocket | None = None
        try:
            plain = socket.create_connection((host, port), timeout=timeout)
        except TimeoutError as error:
            raise NoAnswerInTime(f"{host}:{port} does not answer in {timeout} s") from error
        except OSError as error:
            raise ConnectionLost(f"{host}:{port} cannot be reached: {error}") from error
        prepare_socket(plain)
        if context is None:
            self._socket = plain
            return
        try:
            self._socket = context.wrap_socket(plain, server_hostname=host)
        except ssl.SSLCertVerificationError:
            plain.close()
            raise
        except TimeoutError as error:
            plain.close()
            raise NoAnswerInTime(f"{host}:{port} agrees on no encryption in time") from error
        except OSError as error:
            plain.close()
            raise ConnectionLost(f"{host}:{port} agrees on no encryption: {error}") from error

    @property
    def is_open(self) -> bool:
        """Whether nothing has ended the connection, as far as is known."""
        return self._socket is not None

    def ask(self, call: Call[T]) -> T:
        """Sends a request and waits for its reply.

        Raises `Refused`, `BadStream`, `ConnectionLost` and `NoAnswerInTime`. After all but a
        refusal of the request the connection is closed, for its bytes cannot be told apart any
        more; the same holds where the wait is interrupted.
        """
        with self._lock:
            if self._socket is None:
                raise ConnectionLost("the connection is closed")
            data = self.conversation.begin(call)
            deadline = None if self._timeout is None else time.monotonic() + self._timeout
            header: Header | None = None
            try:
                lost = self._send(data, deadline)
                try:
                    # Of a server that closed while it was sent to, the last words may be there.
                    header = self.conversation.header(self._receive_header(deadline))
                except ConnectionLost as error:
                    raise lost or error from error
                return self.conversation.reply(call, header, self._receive(header.length, deadline))
            except BaseException as error:
                if header is None or self.conversation.ends_session(header, error):
                    self._close()
                raise

    def tell(self, call: Call[None]) -> None:
        """Sends a request that has no reply. Raises `ConnectionLost` and `NoAnswerInTime`."""
        with self._lock:
            if self._socket is None:
                raise ConnectionLost("the connection is closed")
            deadline = None if self._timeout is None else time.monotonic() + self._timeout
            try:
                lost = self._send(self.conversation.begin(call), deadline)
                if lost is not None:
                    raise lost
            except BaseException:
                self._close()
                raise

    def close(self) -> None:
        """Ends the session, also one that waits in another thread; may be called again."""
        open_socket = self._socket
        if open_socket is not None:
            with contextlib.suppress(OSError):
                open_socket.shutdown(socket.SHUT_RDWR)
        with self._lock:
            self._close()

    def _close(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _send(self, data: bytes, deadline: float | None) -> ConnectionLost | None:
        assert self._socket is not None
        self._socket.settimeout(_left(deadline))
        try:
            self._socket.sendall(data)
        except TimeoutError as error:
            raise NoAnswerInTime("the server does not take the request in time") from error
        except OSError as error:
            lost = ConnectionLost(f"the connection broke while a request was sent: {error}")
            lost.__cause__ = error
            return lost
        return None

    def _receive_header(self, deadline: float | None) -> bytes:
        head = np.empty(HEADER_LEN, dtype=np.uint8)
        self._fill(head, deadline)
        return head.tobytes()

    def _receive(self, length: int, deadline: float | None) -> NDArray[np.uint8]:
        payload = np.empty(min(length, FIRST_PIECE), dtype=np.uint8)
        self._fill(payload, deadline)
        while len(payload) < length:
            # What is announced is taken on trust only as far as what has come.
            grown = np.empty(min(2 * len(payload), length), dtype=np.uint8)
            grown[: len(payload)] = payload
            self._fill(grown[len(payload) :], deadline)
            payload = grown
        return payload

    def _fill(self, target: NDArray[np.uint8], deadline: float | None) -> None:
        assert self._socket is not None
        view, at = target.data, 0
        while at < len(view):
            if deadline is not None:
                self._socket.settimeout(_left(deadline))
            try:
                count = self._socket.recv_into(view[at:])
            except TimeoutError as error:
                raise NoAnswerInTime(f"no answer came in {self._timeout} s") from error
            except OSError as error:
                raise ConnectionLost(f"the connection broke: {error}") from error
            if count == 0:
                raise ConnectionLost("the server closed the connection")
            at += count


def _left(deadline: float | None) -> float | None:
    """Seconds until a deadline, a moment at least."""
    return None if deadline is None else max(deadline - time.monotonic(), 1e-3)
