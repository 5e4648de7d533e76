"""A server that says what a test wants it to say, and replies of a real one to begin with."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from softgrasp import Limits, Server
from softgrasp.calls import Call
from softgrasp.fields import Part
from softgrasp.framing import HEADER_LEN, VERSION, Header, Kind, decode_header, encode_frame
from softgrasp.payload import PayloadReader, payload_of


class Heard(NamedTuple):
    """A request as it came."""

    kind: int
    request_id: int
    payload: bytes


Speak = Callable[[socket.socket, Heard], None]


def welcome_payload(limits: Limits | None = None) -> bytes:
    """What a server says to `Hello`."""
    told = limits or Limits()
    counts = (told.payload_len_max, told.node_count_max, told.tet_count_max)
    counts += (told.dof_count_max, told.material_count_max, told.text_len_max)
    part = Part().text("stand-in").text("0").fields("I", 1).block(Part().fields("6I", *counts))
    return payload_of(part.fields("H", VERSION).texts(["cancel"]).fields("Q", 0))


def rejected_payload(code: int, text: str, detail: str = "", retry_after_ms: int = 0) -> bytes:
    """A refusal."""
    part = Part().fields("H", code).text(text).text(detail)
    return payload_of(part.fields("I", retry_after_ms))


def received(server: Server, call: Call) -> tuple[Header, bytes]:
    """Header and payload of a real server's reply, undecoded."""
    assert call.reply is not None

    def undecoded(reader: PayloadReader) -> bytes:
        return bytes(reader._bytes)

    payload = server._ask(Call(call.kind, call.payload, call.reply, undecoded))
    frame = encode_frame(call.reply, 1, payload)
    return decode_header(frame[:HEADER_LEN], Limits()), payload


def replayed(header: Header, payload: bytes) -> tuple[Header, np.ndarray]:
    """Header and payload as if a server had sent these bytes with right checksums."""
    frame = encode_frame(header.kind, header.request_id, payload)
    return (
        decode_header(frame[:HEADER_LEN], Limits()),
        np.frombuffer(frame[HEADER_LEN:], dtype=np.uint8).copy(),
    )


@contextlib.contextmanager
def stand_in(speak: Speak, greet: bool = True) -> Iterator[str]:
    """The address of a server that greets, and speaks as the test says to each request.

    `speak` gets the socket and a request.
    """
    listener = socket.create_server(("127.0.0.1", 0))
    sockets: list[socket.socket] = []

    def serve() -> None:
        with contextlib.suppress(OSError, ValueError):
            while True:
                stream, _ = listener.accept()
                sockets.append(stream)
                threading.Thread(target=talk, args=(stream,), daemon=True).start()

    def talk(stream: socket.socket) -> None:
        with contextlib.suppress(OSError, EOFError), stream:
            while True:
                header = decode_header(exactly(stream, HEADER_LEN), Limits())
                heard = Heard(header.kind, header.request_id, exactly(stream, header.length))
                if greet and heard.kind == Kind.HELLO:
                    stream.sendall(encode_frame(Kind.WELCOME, heard.request_id, welcome_payload()))
                else:
                    speak(stream, heard)

    threading.Thread(target=serve, daemon=True).start()
    try:
        yield f"127.0.0.1:{listener.getsockname()[1]}"
    finally:
        listener.close()
        for stream in sockets:
            with contextlib.suppress(OSError):
                stream.close()


def exactly(stream: socket.socket, length: int) -> bytes:
    data = bytearray()
    while len(data) < length:
        piece = stream.recv(length - len(data))
        if not piece:
            raise EOFError
        data += piece
    return bytes(data)
