"""The small fields of messages: written into parts, read from blocks.

A part, and a structure inside it that may grow, is a *block*. A reader passes over the fields
behind those it knows, and takes the missing ones of an older writer as zero bytes: 0, false, none,
empty.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from typing import Any

from .errors import BadStream
from .limits import PART_LEN_MAX, Limits


class Part:
    """Writes the small fields of a message, one behind the other."""

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
        return self._behind_length(text.encode())

    def texts(self, texts: Iterable[str]) -> Part:
        """A list of texts."""
        texts = tuple(texts)
        self.fields("Q", len(texts))
        for text in texts:
            self.text(text)
        return self

    def option(self, value: float | None) -> Part:
        """A number that may be absent."""
        self._pieces.append(b"\0" if value is None else struct.pack("<Bd", 1, value))
        return self

    def block(self, fields: Part) -> Part:
        """A structure that may grow: its length, then its fields."""
        return self._behind_length(fields.data())

    def option_block(self, fields: Part | None) -> Part:
        """Such a structure, which may be absent."""
        self._pieces.append(b"\0" if fields is None else b"\1")
        return self if fields is None else self.block(fields)

    def join(self, other: Part) -> Part:
        """The fields of another part behind these."""
        self._pieces.extend(other._pieces)
        return self

    def data(self) -> bytes:
        """The fields. Raises `ValueError` if they are longer than the format allows."""
        data = b"".join(self._pieces)
        if len(data) > PART_LEN_MAX:
            raise ValueError(f"the texts of a message have {len(data)} bytes, {PART_LEN_MAX} fit")
        return data

    def _behind_length(self, data: bytes) -> Part:
        self._pieces.append(_U64.pack(len(data)) + data)
        return self


class Fields:
    """Reads the fields of one block, front to back. All methods raise `BadStream`."""

    def __init__(self, data: bytes, limits: Limits) -> None:
        self.limits = limits
        self._bytes = data
        self._len = len(data)
        self._at = 0

    @property
    def is_empty(self) -> bool:
        """Whether the block has no field at all."""
        return self._len == 0

    def fields(self, form: struct.Struct) -> tuple[Any, ...]:
        """Fields of fixed size that follow each other; `form` begins with `<`."""
        at = self._at
        self._at = at + form.size
        if self._at <= self._len:
            return form.unpack_from(self._bytes, at)
        # An older writer does not know them all.
        return form.unpack(self._bytes[at:].ljust(form.size, b"\0"))

    def u16(self) -> int:
        """A number of 16 bits."""
        return int(self.fields(_U16)[0])

    def u32(self) -> int:
        """A number of 32 bits."""
        return int(self.fields(_U32)[0])

    def u64(self) -> int:
        """A number of 64 bits."""
        return int(self.fields(_U64)[0])

    def f64(self) -> float:
        """A number in double precision."""
        return float(self.fields(_F64)[0])

    def flag(self) -> bool:
        """A truth value."""
        at = self._at
        self._at = at + 1
        return at < self._len and self.truth(self._bytes[at])

    @staticmethod
    def truth(value: int) -> bool:
        """The truth value of a byte."""
        if value > 1:
            raise BadStream(f"a truth value is {value}")
        return value == 1

    def option(self) -> float | None:
        """A number that may be absent."""
        return self.f64() if self.flag() else None

    def option_text(self) -> str | None:
        """A text that may be absent."""
        return self.text() if self.flag() else None

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
        try:
            return self._take(length, "a text").decode()
        except UnicodeDecodeError as error:
            raise BadStream(f"a text is not UTF-8: {error}") from None

    def texts(self) -> tuple[str, ...]:
        """A list of texts."""
        return tuple(self.text() for _ in range(self.count(_U64.size, "texts")))

    def count(self, entry_len_min: int, what: str) -> int:
        """Announced entries of a list, each of which takes so many bytes at least."""
        count = self.u64()
        if count * entry_len_min > max(self._len - self._at, 0):
            raise BadStream(f"{count} {what} are announced and not there")
        return count

    def raw(self, length: int) -> bytes:
        """Bytes as they are: a hash."""
        return self._take(length, "its small fields")

    def block(self) -> Fields:
        """A structure that may grow; without fields where an older writer does not know it."""
        return Fields(self.block_bytes(), self.limits)

    def block_bytes(self) -> bytes:
        """The bytes of such a structure, to be read later."""
        return self._take(self.u64(), "a structure")

    def option_block(self) -> Fields | None:
        """Such a structure, which may be absent."""
        return self.block() if self.flag() else None

    def _take(self, length: int, what: str) -> bytes:
        end = self._at + length
        if length and end > self._len:
            raise BadStream(f"a message ends inside {what}")
        data = self._bytes[self._at : end]
        self._at = end
        return data


_U16 = struct.Struct("<H")
_U32 = struct.Struct("<I")
_U64 = struct.Struct("<Q")
_F64 = struct.Struct("<d")
