"""A socket that one thread may read while another one writes, each until a deadline."""

from __future__ import annotations

import contextlib
import selectors
import socket
import ssl
import threading
import time

LOOK_EVERY = 0.1
"""Seconds after which whoever waits looks at the clock."""


class Stream:
    """A plain connection.

    Deadlines are moments of `time.monotonic`. All methods raise `TimeoutError` after one, and other
    kinds of `OSError` where the connection broke.
    """

    def __init__(self, plain: socket.socket, has_deadlines: bool) -> None:
        """Without deadlines nothing looks at the clock; those of the methods are None then."""
        self._socket = plain
        # Who has no deadline sleeps once for all that is to come, and not once for each packet.
        self._flags = 0 if has_deadlines else _UNTIL_FULL
        plain.settimeout(LOOK_EVERY if has_deadlines else None)

    def send(self, data: bytes, deadline: float | None) -> None:
        """Sends all bytes."""
        sent = self._send_some(data, deadline)
        while sent < len(data):
            look_at_clock(deadline)
            sent += self._send_some(memoryview(data)[sent:], deadline)

    def receive(self, target: memoryview, deadline: float | None) -> int:
        """Receives what is there, at least a byte; 0 where the other side has closed."""
        while True:
            try:
                return self._socket.recv_into(target, 0, self._flags)
            except TimeoutError:
                look_at_clock(deadline)

    def is_readable(self) -> bool:
        """Whether something can be received without waiting."""
        return self._wait(selectors.EVENT_READ, 0.0)

    def shut_down(self) -> None:
        """Ends both directions: whoever waits in another thread wakes."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Gives the socket back."""
        self._socket.close()

    def _send_some(self, view: bytes | memoryview, deadline: float | None) -> int:
        while True:
            try:
                return self._socket.send(view)
            except TimeoutError:
                look_at_clock(deadline)

    def _wait(self, for_what: int, timeout: float) -> bool:
        with _Selector() as selector:
            selector.register(self._socket, for_what)
            return bool(selector.select(timeout))


class TlsStream(Stream):
    """An encrypted connection, whose two directions share a state: they take turns."""

    def __init__(self, wrapped: ssl.SSLSocket) -> None:
        super().__init__(wrapped, has_deadlines=True)
        wrapped.setblocking(False)
        self._wrapped = wrapped
        self._turn = threading.Lock()

    def receive(self, target: memoryview, deadline: float | None) -> int:
        while True:
            try:
                with self._turn:
                    return self._wrapped.recv_into(target)
            except (ssl.SSLWantReadError, ssl.SSLWantWriteError) as wanted:
                self._wait_until(wanted, deadline)

    def is_readable(self) -> bool:
        with self._turn:
            is_decrypted = self._wrapped.pending() > 0
        return is_decrypted or super().is_readable()

    def shut_down(self) -> None:
        # The socket only: the state is that of whoever reads or writes.
        with contextlib.suppress(OSError):
            socket.socket.shutdown(self._wrapped, socket.SHUT_RDWR)

    def _send_some(self, view: bytes | memoryview, deadline: float | None) -> int:
        while True:
            try:
                with self._turn:
                    return self._wrapped.send(view)
            except (ssl.SSLWantReadError, ssl.SSLWantWriteError) as wanted:
                self._wait_until(wanted, deadline)

    def _wait_until(self, wanted: ssl.SSLError, deadline: float | None) -> None:
        # Another thread may take what this one waits for: it looks again after a moment.
        is_write = isinstance(wanted, ssl.SSLWantWriteError)
        self._wait(selectors.EVENT_WRITE if is_write else selectors.EVENT_READ, LOOK_EVERY)
        look_at_clock(deadline)


def look_at_clock(deadline: float | None) -> None:
    """Raises `TimeoutError` after a deadline."""
    if deadline is not None and time.monotonic() > deadline:
        raise TimeoutError


_Selector = getattr(selectors, "PollSelector", selectors.SelectSelector)
"""Knows sockets of any number where the system has one that does."""
_UNTIL_FULL = getattr(socket, "MSG_WAITALL", 0)
