"""Where a server is, how the way to it is encrypted, and how a way that is cut is noticed."""

from __future__ import annotations

import contextlib
import os
import socket
import ssl
from typing import TypeAlias

Tls: TypeAlias = "bool | str | os.PathLike[str] | ssl.SSLContext | None"
"""None or False: plain. True: the authorities of the system. A path: a certificate to trust, of the
server itself or of an authority (PEM). Or a context of one's own."""

DEFAULT_PORT = 7878
"""Port on which a server listens unless it is told another one."""


def split_address(address: str) -> tuple[str, int]:
    """Host and port of `host:port`, `[IPv6]:port` or `host`. Raises `ValueError`."""
    host, colon, port = address.rpartition(":")
    if not colon or (address.count(":") > 1 and not host.endswith("]")):
        host, port = address, str(DEFAULT_PORT)
    try:
        number = int(port)
    except ValueError:
        raise ValueError(f"{address!r} is no address: the port {port!r} is no number") from None
    host = host.removeprefix("[").removesuffix("]")
    if not host or not 0 < number < 65_536:
        raise ValueError(f"{address!r} is no address; expected HOST:PORT")
    return host, number


def tls_context(tls: Tls) -> ssl.SSLContext | None:
    """The context for a connection: TLS 1.3, certificate and host name are checked.

    Raises `OSError`, of which `ssl.SSLError` is one, where the certificate cannot be read.
    """
    if tls is None or tls is False:
        return None
    if isinstance(tls, ssl.SSLContext):
        return tls
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    if tls is True:
        context.load_default_certs()
    else:
        context.load_verify_locations(cafile=os.fspath(tls))
        # The certificate of the server itself may be what is trusted.
        context.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    return context


def prepare_socket(stream: socket.socket) -> None:
    """Sends small requests at once, and notices a machine that is gone after about ten seconds.

    A server may be silent for as long as it works: its machine answers probes all the same.
    """
    stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    stream.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    # What a system does not have of these, it does in its own time.
    for name, value in _PROBES:
        if hasattr(socket, name):
            with contextlib.suppress(OSError):
                stream.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)


_PROBES = (
    ("TCP_KEEPIDLE", 4),
    ("TCP_KEEPINTVL", 2),
    ("TCP_KEEPCNT", 3),
    ("TCP_USER_TIMEOUT", 10_000),
)
"""Seconds until the first probe, between probes, their number; ms for what is not confirmed."""
