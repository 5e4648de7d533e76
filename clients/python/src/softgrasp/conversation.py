"""The rules of one session, without a socket: numbers of requests, replies, refusals."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .calls import Call
from .errors import BadStream, Refused, TooLarge, refusal_of
from .framing import Header, Kind, decode_header, encode_frame
from .limits import Limits
from .payload import PayloadReader

T = TypeVar("T")

AHEAD_MAX = 32_768
"""Bytes of requests that are sent while another one is under way. A server takes 64 KiB from a
client whose request it works on: what cancels the request is among them."""


class Conversation:
    """Numbers requests and tells what a reply means.

    Several requests may be under way. `limits` are those of this side; those of the server, once
    they are known, keep what it would not take from being sent.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._request_id = 0
        self._expected: dict[int, int] = {}
        self.server_limits: Limits | None = None

    @property
    def under_way(self) -> tuple[int, ...]:
        """Numbers of the requests that wait for their replies, the oldest first."""
        return tuple(self._expected)

    def has_room(self, call: Call[Any]) -> bool:
        """Whether a request may be sent before those under way are answered."""
        if not self._expected:
            return True
        # The oldest is what the server works on.
        waiting = sum(self._expected.values()) - next(iter(self._expected.values()))
        return waiting + len(call.payload) <= AHEAD_MAX

    def begin(self, call: Call[Any]) -> tuple[int, bytes]:
        """Number and bytes of the next request.

        Raises `TooLarge` for a payload that the server has said it does not take.
        """
        length = len(call.payload)
        length_max = (self.server_limits or Limits()).payload_len_max
        if length > length_max:
            raise TooLarge(
                TooLarge.code, f"the request has {length} bytes; the server takes {length_max}"
            )
        self._request_id += 1
        if call.reply is not None:
            self._expected[self._request_id] = length
        return self._request_id, encode_frame(call.kind, self._request_id, call.payload)

    def header(self, data: bytes) -> Header:
        """The header of a reply. Raises `BadStream`, and `UnsupportedVersion`."""
        header = decode_header(data, self._limits)
        if header.request_id != 0 and header.request_id not in self._expected:
            raise BadStream(
                f"the reply to request {header.request_id} came, {self.under_way} are under way"
            )
        return header

    def answered(self, header: Header) -> bool:
        """Takes note of a reply; false for one that only says that the server is there."""
        self._expected.pop(header.request_id, None)
        return header.kind != Kind.ALIVE or header.request_id != 0

    def reply(self, call: Call[T], header: Header, payload: NDArray[np.uint8]) -> T:
        """What a whole reply means. Raises `Refused`, or `BadStream`."""
        reader = PayloadReader(payload, self._limits)
        if header.kind == Kind.REJECTED:
            raise _refusal(reader)
        if header.kind != call.reply or header.request_id == 0:
            raise BadStream(f"a reply of kind {header.kind:#06x} came to {call.kind.name}")
        return call.read(reader)

    def last_words(self, payload: NDArray[np.uint8]) -> str:
        """Why the server ends the session. Raises `BadStream`."""
        return str(_refusal(PayloadReader(payload, self._limits)))

    @staticmethod
    def ends_session(header: Header, error: BaseException) -> bool:
        """Whether a session is over after this: only a refusal of a request leaves it alive."""
        return header.request_id == 0 or not isinstance(error, Refused)


def _refusal(reader: PayloadReader) -> Refused:
    fields = reader.part
    code, text, detail = fields.u16(), fields.text(), fields.text()
    retry_after_ms = fields.u32()
    reader.finish()
    return refusal_of(code, text, detail, 1e-3 * retry_after_ms if retry_after_ms else None)
