"""Payloads: a part of small fields, then arrays on borders of eight bytes."""

from __future__ import annotations

import struct
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import F64, NO_FLOATS, NO_NUMBERS, U32, Floats, Numbers
from .errors import BadStream
from .limits import PART_LEN_MAX, Limits


class Part:
    """Writes the small fields of a message, in bincode's default format."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []

    def fields(self, form: str, *values: Any) -> Part:
        """Fields of fixed size, as `struct` names them, without padding between them."""
        self._pieces.append(struct.pack("<" + form, *values))
        return self

    def raw(self, data: bytes) -> Part:
        """Bytes as they are: a hash."""
        self._pieces.append(data)
        return self

    def text(self, text: str) -> Part:
        """A text: its length, then UTF-8."""
        data = text.encode()
        self._pieces.append(struct.pack("<Q", len(data)) + data)
        return self

    def option(self, value: float | None) -> Part:
        """A number that may be absent."""
        self._pieces.append(b"\0" if value is None else struct.pack("<Bd", 1, value))
        return self

    def join(self, other: Part) -> Part:
        """The fields of another part behind these."""
        self._pieces.extend(other._pieces)
        return self

    def payload(self, *arrays: NDArray[Any]) -> bytes:
        """The whole payload: this part and the arrays, each padded to eight bytes.

        Raises `ValueError` if the part is longer than the format allows.
        """
        part = b"".join(self._pieces)
        if len(part) > PART_LEN_MAX:
            raise ValueError(f"the texts of a message have {len(part)} bytes, {PART_LEN_MAX} fit")
        pieces = [part, bytes(-len(part) % 8)]
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
    """Reads one payload, front to back.

    Every number is compared with the limits and with the bytes that are there; arrays are views
    into the payload that cannot be written to. All methods raise `BadStream`.
    """

    def __init__(self, payload: NDArray[np.uint8], limits: Limits) -> None:
        self.limits = limits
        self._payload = payload
        self._bytes = payload.data
        self._len = len(payload)
        self._at = 0

    def fields(self, form: struct.Struct) -> tuple[Any, ...]:
        """Fields of fixed size that follow each other; `form` begins with `<`."""
        try:
            values = form.unpack_from(self._bytes, self._at)
        except struct.error:
            raise BadStream("a message ends inside its small fields") from None
        self._at += form.size
        return values

    def u32(self) -> int:
        """A number of 32 bits."""
        return int(self.fields(_U32)[0])

    def f64(self) -> float:
        """A number in double precision."""
        return float(self.fields(_F64)[0])

    def flag(self) -> bool:
        """A truth value."""
        return self.truth(self.fields(_U8)[0])

    @staticmethod
    def truth(value: int) -> bool:
        """The truth value of a byte."""
        if value > 1:
            raise BadStream(f"a truth value is {value}")
        return value == 1

    def option(self) -> float | None:
        """A number that may be absent."""
        return self.f64() if self.flag() else None

    def choice(self, names: tuple[str, ...], what: str) -> str:
        """One of several names, by its number."""
        return self.named(self.u32(), names, what)

    @staticmethod
    def named(number: int, names: tuple[str, ...], what: str) -> str:
        """The name with a number."""
        if number >= len(names):
            raise BadStream(f"there is no {what} {number}")
        return names[number]

    def text(self) -> str:
        """A text."""
        (length,) = self.fields(_U64)
        if length > self.limits.text_len_max:
            raise BadStream(f"a text of {length} bytes; {self.limits.text_len_max} are allowed")
        end = self._at + length
        if end > self._len:
            raise BadStream("a message ends inside a text")
        data = self._bytes[self._at : end]
        self._at = end
        try:
            return str(data, "utf-8")
        except UnicodeDecodeError as error:
            raise BadStream(f"a text is not UTF-8: {error}") from None

    def texts(self) -> tuple[str, ...]:
        """A list of texts, each of which takes eight bytes at least."""
        count = int(self.fields(_U64)[0])
        if count * 8 > self._len - self._at:
            raise BadStream(f"{count} texts are announced and not there")
        return tuple(self.text() for _ in range(count))

    def raw(self, length: int) -> bytes:
        """Bytes as they are: a hash."""
        data = bytes(self._bytes[self._at : self._at + length])
        if len(data) != length:
            raise BadStream("a message ends inside its small fields")
        self._at += length
        return data

    def end_part(self) -> None:
        """Ends the part of small fields."""
        if self._at > PART_LEN_MAX:
            raise BadStream(f"the small fields of a message have more than {PART_LEN_MAX} bytes")
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
_U8 = struct.Struct("<B")
_U32 = struct.Struct("<I")
_U64 = struct.Struct("<Q")
_F64 = struct.Struct("<d")
