"""The recorded bytes of each message, which the tests of the wire in Rust keep."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ROOT

from softgrasp import Limits
from softgrasp.framing import HEADER_LEN, Header, check_payload, decode_header
from softgrasp.payload import PayloadReader

FOLDER = ROOT / "crates" / "protocol" / "tests" / "golden"


def golden(name: str) -> bytes:
    """The bytes of a recorded frame."""
    path = FOLDER / f"{name}.hex"
    if not path.exists():
        pytest.skip("the recorded messages are not there")
    return bytes.fromhex(path.read_text())


def header_of(frame: bytes) -> Header:
    return decode_header(frame[:HEADER_LEN], Limits())


def reader_of(payload: bytes) -> PayloadReader:
    return PayloadReader(np.frombuffer(payload, dtype=np.uint8), Limits())


def golden_reader(name: str) -> PayloadReader:
    """The payload of a recorded frame, whose checksums are looked at."""
    frame = golden(name)
    payload = np.frombuffer(frame[HEADER_LEN:], dtype=np.uint8)
    check_payload(header_of(frame), payload)
    return PayloadReader(payload, Limits())


def part_of(payload: bytes) -> bytes:
    """The small fields of a payload."""
    return payload[8 : 8 + int.from_bytes(payload[:8], "little")]


def with_part(payload: bytes, part: bytes) -> bytes:
    """The payload with other small fields and the same arrays."""
    behind = 8 + len(part_of(payload))
    arrays = payload[behind + -behind % 8 :]
    return len(part).to_bytes(8, "little") + part + bytes(-len(part) % 8) + arrays
