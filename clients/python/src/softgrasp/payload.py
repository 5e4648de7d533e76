"""Payloads: the length of a part, the part, then arrays on borders of eight bytes."""

from __future__ import annotations

import struct
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import F64, NO_FLOATS, NO_NUMBERS, U32, Floats, Numbers
from .errors import BadStream
from .fields import Fields, Part
from .limits import PART_LEN_MAX, Limits


def payload_of(part: Part, *arrays: NDArray[Any]) -> bytes:
    """The whole payload: a part behind its length and the arrays, each padded to eight bytes.

    Raises `ValueError` if the part is longer than the format allows.
    """
    data = part.data()
    pieces = [_U64.pack(len(data)), data, bytes(-len(data) % 8)]
    for array in arrays:
        if array.size == 0:
            continue
        if not array.dtype.isnative or _IS_BIG_ENDIAN:
            array = array.astype(array.dtype.newbyteorder("<"))
        pieces.append(array.tobytes())
        if array.nbytes % 8:
            pieces.append(bytes(-array.nbytes % 8))
    return b"".join(pieces)


class PayloadReader:
    """Reads one payload: first `part`, then the arrays, front to back.

    Every number is compared with the limits and with the bytes that are there; arrays are views
    into the payload that cannot be written to. All methods raise `BadStream`.
    """

    def __init__(self, payload: NDArray[np.uint8], limits: Limits) -> None:
        """Finds the part. Raises `BadStream`."""
        self.limits = limits
        self._payload = payload
        self._bytes = payload.data
        self._len = len(payload)
        if self._len < _U64.size:
            raise BadStream("a message ends before its small fields")
        (length,) = _U64.unpack_from(self._bytes, 0)
        if length > PART_LEN_MAX:
            raise BadStream(f"the small fields of a message have more than {PART_LEN_MAX} bytes")
        self._at = _U64.size + length
        if self._at > self._len:
            raise BadStream("a message ends inside its small fields")
        self.part = Fields(self._bytes[_U64.size : self._at].tobytes(), limits)
        """The small fields of the message."""
        self._skip_padding()

    def array(self, dtype: np.dtype[Any], count: int, count_max: int, what: str) -> NDArray[Any]:
        """An array of `count` numbers: a view, not to be written to."""
        end = self._at + self.claimed(count, count_max, what) * dtype.itemsize
        if end > self._len:
            raise BadStream(f"{count} {what} are announced and not there")
        values = self._payload[self._at : end].view(dtype)
        self._at = end
        if end % 8:
            self._skip_padding()
        return values

    def numbers(self, count: int, count_max: int, what: str, width: int = 1) -> Numbers:
        """Whole numbers; with `width`, `count` rows of so many."""
        if count == 0:
            return NO_NUMBERS if width == 1 else NO_NUMBERS.reshape(0, width)
        values = self.array(U32, count * width, count_max * width, what)
        return values if width == 1 else values.reshape(count, width)

    def floats(self, count: int, count_max: int, what: str, width: int = 1) -> Floats:
        """Numbers in double precision; with `width`, `count` rows of so many."""
        if count == 0:
            return NO_FLOATS if width == 1 else NO_FLOATS.reshape(0, width)
        values = self.array(F64, count * width, count_max * width, what)
        return values if width == 1 else values.reshape(count, width)

    @staticmethod
    def claimed(count: int, count_max: int, what: str) -> int:
        """An announced count that is within its limit."""
        if count > count_max:
            raise BadStream(f"{count} {what} are announced; {count_max} are allowed")
        return count

    def finish(self) -> None:
        """Says that nothing may be left over."""
        left = self._len - self._at
        if left:
            raise BadStream(f"{left} bytes are left over at the end of a message")

    def _skip_padding(self) -> None:
        end = self._at + -self._at % 8
        if end == self._at:
            return
        padding = self._bytes[self._at : end]
        if len(padding) != end - self._at or any(padding):
            raise BadStream("the padding of a message is not zero or not there")
        self._at = end


_IS_BIG_ENDIAN = sys.byteorder == "big"
_U64 = struct.Struct("<Q")
