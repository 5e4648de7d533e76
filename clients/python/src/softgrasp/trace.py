"""The trace that requests belong to, as W3C's `traceparent`, so that a server's spans stand below it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from .fields import Part

_TRACEPARENT = re.compile(r"[0-9a-f]{2}-([0-9a-f]{32})-([0-9a-f]{16})-([0-9a-f]{2})(-.*)?")
_SAMPLED = 1
# Fields behind those of a part; empty outside of any trace.
_FIELDS: ContextVar[bytes] = ContextVar("softgrasp_trace", default=b"")


@contextmanager
def traced(traceparent: str) -> Iterator[None]:
    """Requests made inside belong to a trace: what server and cluster tell of them is below its span.

    `traceparent` is what OpenTelemetry's `inject` puts into a carrier under this name. It holds for
    this thread or task, and for tasks that are started inside. It changes no answer, and a server
    that tells no collector passes over it. Raises `ValueError` for another text.
    """
    token = _FIELDS.set(_fields(traceparent))
    try:
        yield
    finally:
        _FIELDS.reset(token)


def with_trace(part: Part) -> Part:
    """The part of a request, with the trace that it is made in behind its fields."""
    fields = _FIELDS.get()
    return part.raw(fields) if fields else part


def _fields(traceparent: str) -> bytes:
    found = _TRACEPARENT.fullmatch(traceparent)
    if found is None or traceparent.startswith("ff"):
        raise ValueError(f"{traceparent!r} is no traceparent, as 00-<32 hex>-<16 hex>-01")
    trace, span = bytes.fromhex(found[1]), bytes.fromhex(found[2])
    if not any(trace) or not any(span):
        raise ValueError(f"{traceparent!r} names no trace: an identity is all zeros")
    sampled = int(found[3], 16) & _SAMPLED
    return b"\1" + trace + span + bytes([sampled])
