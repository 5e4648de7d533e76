"""A server that says what a test wants it to say, and replies of a real one to begin with."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable, Iterator

import numpy as np

from softgrasp import Limits, Server
from softgrasp.calls import Call
from softgrasp.framing import HEADER_LEN, Header, Kind, encode_frame
from softgrasp.payload import Part

Speak = Callable[[socket.socket, Header], None]


def welcome_payload(limits: Limits | None = None) -> bytes:
    """What a server says to `Hello`."""
    told = limits or Limits()
    part = Part().text("stand-in").text("0").fields("I", 1)
    counts = (told.payload_len_max, told.node_count_max, told.tet_count_max)
    part.fields("6I", *counts, told.dof_count_max, told.material_count_max, told.text_len_max)
    return part.payload()


def rejected_payload(code: int, text: str, detail: str = "") -> bytes:
    """A refusal."""
    return Part().fields("H", code).text(text).text(detail).payload()


def received(server: Server, call: Call) -> tuple[Header, bytes]:
    """Header and payload of a real server's reply, undecoded."""
    connection = server._connection
    connection._send(connection.conversation.begin(call), None)
    header = connection.conversation.header(connection._receive_header(None))
    return header, connection._receive(header.length, None).tobytes()


def replayed(header: Header, payload: bytes) -> tuple[Header, np.ndarray]:
    """Header and payload as if a server had sent these bytes with right checksums."""
    from softgrasp.framing import decode_header

    frame = encode_frame(header.kind, header.request_id, payload)
    return (
        decode_header(frame[:HEADER_LEN], Limits()),
        np.frombuffer(frame[HEADER_LEN:], dtype=np.uint8).copy(),
    )


@contextlib.contextmanager
def stand_in(speak: Speak, greet: bool = True) -> Iterator[str]:
    """The address of a server that greets, and speaks as the test says to each request.

    `speak` gets the socket and the header of a request, whose payload has been read.
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
        from softgrasp.framing import decode_header

        with contextlib.suppress(OSError, EOFError), stream:
            while True:
                header = decode_header(exactly(stream, HEADER_LEN), Limits())
                exactly(stream, header.length)
                if greet and header.kind == Kind.HELLO:
                    stream.sendall(encode_frame(Kind.WELCOME, header.request_id, welcome_payload()))
                else:
                    speak(stream, header)

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
