"""The rules of one session, without a socket: numbers of requests, replies, refusals."""

from __future__ import annotations

import struct
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .calls import Call
from .errors import BadStream, Refused, TooLarge, refusal_of
from .framing import Header, Kind, check_payload, decode_header, encode_frame
from .limits import Limits
from .payload import PayloadReader

T = TypeVar("T")


class Conversation:
    """Numbers requests and tells what a reply means.

    One request is under way at a time. `limits` are those of this side; those of the server, once
    they are known, keep what it would not take from being sent.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._request_id = 0
        self.server_limits: Limits | None = None

    def begin(self, call: Call[Any]) -> bytes:
        """The bytes of the next request.

        Raises `TooLarge` for a payload that the server has said it does not take.
        """
        length = len(call.payload)
        length_max = (self.server_limits or Limits()).payload_len_max
        if length > length_max:
            raise TooLarge(
                TooLarge.code, f"the request has {length} bytes; the server takes {length_max}"
            )
        self._request_id += 1
        return encode_frame(call.kind, self._request_id, call.payload)

    def header(self, data: bytes) -> Header:
        """The header of a reply. Raises `BadStream`."""
        header = decode_header(data, self._limits)
        if header.request_id not in (self._request_id, 0):
            raise BadStream(
                f"the reply to request {header.request_id} came, {self._request_id} was asked"
            )
        return header

    def reply(self, call: Call[T], header: Header, payload: NDArray[np.uint8]) -> T:
        """What a whole reply means. Raises `Refused`, or `BadStream`."""
        check_payload(header, payload)
        payload.flags.writeable = False
        reader = PayloadReader(payload, self._limits)
        if header.kind == Kind.REJECTED:
            raise _refusal(reader)
        if header.kind != call.reply or header.request_id == 0:
            raise BadStream(f"a reply of kind {header.kind:#06x} came to {call.kind.name}")
        return call.read(reader)

    @staticmethod
    def ends_session(header: Header, error: BaseException) -> bool:
        """Whether a session is over after this: only a refusal of a request leaves it alive."""
        return header.request_id == 0 or not isinstance(error, Refused)


def _refusal(reader: PayloadReader) -> Refused:
    (code,) = reader.fields(_CODE)
    text, detail = reader.text(), reader.text()
    reader.end_part()
    reader.finish()
    return refusal_of(code, text, detail)


_CODE = struct.Struct("<H")
