"""Frames of the wire: a header of 32 bytes with two checksums, then a payload."""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import NamedTuple

import google_crc32c
import numpy as np
from numpy.typing import NDArray

from .errors import BadStream, UnsupportedVersion
from .limits import Limits

VERSION = 4
"""Version of the wire that this package speaks."""
HEADER_LEN = 32
"""Bytes of a header."""
_MAGIC = b"SGRP"
_START = struct.Struct("<4sHHIIQ")
_WHOLE = struct.Struct("<4sHHIIQII")
_U32 = struct.Struct("<I")
_NEEDS_BYTES = google_crc32c.implementation == "python"


class Kind(IntEnum):
    """Kinds of messages; bit 15 is set when the server sends it."""

    HELLO = 0x0001
    ASK = 0x0002
    HAVE_MODEL = 0x0003
    UPLOAD_MODEL = 0x0004
    CANCEL = 0x0005
    PREFETCH = 0x0006
    DROP = 0x0007
    PING = 0x0008
    CONTACT_FRAME = 0x0009
    WELCOME = 0x8001
    ANSWER = 0x8002
    MODEL_STATE = 0x8003
    MODEL_READY = 0x8004
    REJECTED = 0x8005
    ALIVE = 0x8006
    PONG = 0x8008
    CONTACT_ANSWER = 0x8009


class Header(NamedTuple):
    """A header whose own checksum fits."""

    kind: int
    length: int
    """Bytes of the payload."""
    request_id: int
    seed: int
    """Checksum of the bytes 0 to 27, with which that of the frame begins."""
    checksum: int
    """Checksum of the bytes 0 to 27 and the payload."""


def crc32c(data: bytes | NDArray[np.uint8], crc: int = 0) -> int:
    """CRC-32C (Castagnoli) of bytes that follow those whose checksum is `crc`."""
    if _NEEDS_BYTES and not isinstance(data, bytes):
        data = data.tobytes()
    return int(google_crc32c.extend(crc, data))


def encode_frame(kind: int, request_id: int, payload: bytes) -> bytes:
    """The bytes of one frame."""
    start = _START.pack(_MAGIC, VERSION, kind, 0, len(payload), request_id)
    start += _U32.pack(crc32c(start))
    return b"".join((start, _U32.pack(crc32c(payload, crc32c(start))), payload))


def decode_header(data: bytes, limits: Limits) -> Header:
    """The header in 32 bytes.

    Raises `UnsupportedVersion` for another version, and `BadStream` for another magic, a wrong
    checksum, reserved flags, and a payload over the limit: nothing is allocated for a length that
    cannot be trusted.
    """
    magic, version, kind, flags, length, request_id, head_crc, checksum = _WHOLE.unpack(data)
    if magic != _MAGIC:
        raise BadStream(f"this is no Softgrasp server: it begins with {data[:4]!r}")
    if version != VERSION:
        raise UnsupportedVersion(
            UnsupportedVersion.code,
            f"the server speaks version {version} of the wire, this package version {VERSION}: "
            "bring the older of the two up to date",
        )
    if head_crc != crc32c(data[:24]):
        raise BadStream("the header of a message is damaged: its checksum does not fit")
    if flags != 0:
        raise BadStream(f"the flags {flags:#x} of a message mean nothing in version {VERSION}")
    if length > limits.payload_len_max:
        raise BadStream(
            f"a message of {length} bytes is announced; {limits.payload_len_max} are allowed"
        )
    return Header(kind, length, request_id, crc32c(data[:28]), checksum)


def check_payload(header: Header, payload: NDArray[np.uint8]) -> None:
    """Says that a payload is sound, and keeps it from being written to.

    Raises `BadStream` if the checksum of the frame does not fit.
    """
    if crc32c(payload, header.seed) != header.checksum:
        raise BadStream("a message is damaged: its checksum does not fit")
    payload.flags.writeable = False
