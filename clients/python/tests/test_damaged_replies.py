"""Bytes that are no answer: a clear error, no hang, and no memory for what is only announced."""

import asyncio
import random
import struct
import tracemalloc

import pytest
from conftest import Bar
from recorded import received, rejected_payload, replayed, stand_in

import softgrasp
from softgrasp import (
    AsyncServer,
    BadStream,
    Body,
    ContactAnswer,
    ContactStep,
    LargeDeformation,
    Limits,
    ObjectState,
    Plane,
    Question,
    Server,
    SoftgraspError,
    calls,
)
from softgrasp.contact import read_contact_answer
from softgrasp.conversation import Conversation
from softgrasp.fields import Part
from softgrasp.framing import VERSION, Header, Kind, crc32c, encode_frame
from softgrasp.payload import PayloadReader, payload_of

SEED = 20261124


def all_calls(server: Server, bar: Bar) -> list[calls.Call]:
    """A call with each kind of answer."""
    kept = server.keep(bar.model)
    question = Question(nodes=[3, 1, 2], precision="f32")
    sets = [bar.case.known_displacements, 2.0 * bar.case.known_displacements]
    body, step = Body(Plane()), ContactStep(0.01)
    large = LargeDeformation(path="from-rest")
    return [
        calls.hello("a test", None),
        calls.ping(7),
        calls.have_model(kept.hash),
        calls.upload_model(bar.model, kept.fixed_dofs),
        calls.solve(bar.model, bar.case, Question()),
        calls.frame(kept.hash, bar.case, question),
        calls.large_frame(kept.hash, bar.case, large, Question()),
        calls.solve_several(bar.model, bar.case, sets, True, Question()),
        calls.contact_frame(kept.hash, bar.model, ObjectState(), [body], step, None, "f64"),
    ]


def judged(call: calls.Call, header: Header, payload: bytes) -> bool:
    """Whether a reply is taken. Errors other than those of this package go through."""
    conversation = Conversation(Limits())
    try:
        answer = conversation.reply(call, *replayed(header, payload))
        # It is read when it is looked at.
        getattr(answer, "report", None)
    except SoftgraspError:
        return False
    return True


def test_replies_with_changed_bytes_are_taken_or_refused_with_a_reason(
    server: Server, bar: Bar
) -> None:
    generator = random.Random(SEED)
    for call in all_calls(server, bar):
        header, payload = received(server, call)
        assert judged(call, header, payload), call.kind
        for _ in range(400):
            damaged = bytearray(payload)
            for _ in range(generator.choice((1, 1, 2, 8))):
                at = generator.randrange(min(len(damaged), generator.choice((64, 600, 1 << 20))))
                damaged[at] = generator.choice((0, 1, 0x7F, 0xFF, generator.randrange(256)))
            judged(call, header, bytes(damaged))


def test_replies_that_are_cut_or_too_long_are_refused(server: Server, bar: Bar) -> None:
    for call in all_calls(server, bar):
        header, payload = received(server, call)
        lengths = {*range(0, min(len(payload), 500)), *range(0, len(payload), 97)}
        for length in sorted(lengths - {len(payload)}):
            assert not judged(call, header, payload[:length]), (call.kind, length)
        assert not judged(call, header, payload + bytes(8)), call.kind


def test_announced_counts_take_no_memory(server: Server, bar: Bar) -> None:
    calls_with_counts = all_calls(server, bar)[4:]
    for call in calls_with_counts:
        header, payload = received(server, call)
        tracemalloc.start()
        for at in range(0, min(len(payload), 600) - 4):
            damaged = bytearray(payload)
            damaged[at : at + 4] = struct.pack("<I", 0xFFFF_FFFF)
            judged(call, header, bytes(damaged))
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 20 * len(payload) + 1_000_000, (call.kind, peak)


def test_announced_payload_takes_memory_only_as_it_comes() -> None:
    announced, sent = 200_000_000, 3_000_000

    def announce(stream, header) -> None:
        tracemalloc.reset_peak()
        stream.sendall(forged(Kind.PONG, header.request_id, length=announced))
        stream.sendall(bytes(sent))
        stream.close()

    tracemalloc.start()
    try:
        with stand_in(announce) as address, Server(address, timeout=20.0) as server:
            with pytest.raises(softgrasp.ConnectionLost):
                server.ping()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 5 * sent, peak


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("magic", "no Softgrasp server"),
        ("header", "header of a message is damaged"),
        ("flags", "flags"),
        ("length", "is announced"),
        ("payload", "a message is damaged"),
        ("id", "reply to request 77"),
        ("kind", "of kind 0x8003"),
        ("nonce", "came back"),
        ("padding", "padding"),
        ("left over", "left over"),
        ("part", "ends inside its small fields"),
        ("long part", "more than 65536 bytes"),
        ("echo", "of kind 0x0008"),
    ],
)
def test_each_fault_of_a_stream_has_its_words(what: str, words: str) -> None:
    def speak(stream, header) -> None:
        nonce = payload_of(Part().fields("Q", 0x736F6674))
        sound = bytearray(encode_frame(Kind.PONG, header.request_id, nonce))
        if what == "magic":
            sound = bytearray(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n")
        elif what == "header":
            sound[16] ^= 1
        elif what == "payload":
            sound[-1] ^= 1
        elif what == "flags":
            sound = bytearray(forged(Kind.PONG, header.request_id, flags=1))
        elif what == "length":
            sound = bytearray(forged(Kind.PONG, header.request_id, length=0xFFFF_FFF8))
        elif what == "id":
            sound = bytearray(encode_frame(Kind.PONG, 77, nonce))
        elif what == "kind":
            sound = bytearray(encode_frame(Kind.MODEL_STATE, header.request_id, bytes(16)))
        elif what == "nonce":
            other = payload_of(Part().fields("Q", 7))
            sound = bytearray(encode_frame(Kind.PONG, header.request_id, other))
        elif what == "padding":
            refused = rejected_payload(1, "")
            refused = refused[:-1] + b"\1"
            sound = bytearray(encode_frame(Kind.REJECTED, header.request_id, refused))
        elif what == "left over":
            sound = bytearray(encode_frame(Kind.PONG, header.request_id, nonce + bytes(8)))
        elif what == "part":
            sound = bytearray(encode_frame(Kind.PONG, header.request_id, b"\x10" + nonce[1:]))
        elif what == "long part":
            sound = bytearray(encode_frame(Kind.PONG, header.request_id, b"\0\0\2" + nonce[3:]))
        elif what == "echo":
            sound = bytearray(encode_frame(Kind.PING, header.request_id, nonce))
        stream.sendall(sound)

    with stand_in(speak) as address, Server(address, timeout=10.0) as server:
        with pytest.raises(BadStream, match=words):
            server.ping()
        assert not server.is_open


def forged(kind: int, request_id: int, flags: int = 0, length: int = 8) -> bytes:
    """A header with right checksums that announces so many bytes, of which eight follow."""
    start = struct.pack("<4sHHIIQ", b"SGRP", VERSION, kind, flags, length, request_id)
    start += struct.pack("<I", crc32c(start))
    return start + struct.pack("<I", crc32c(bytes(8), crc32c(start))) + bytes(8)


@pytest.mark.parametrize("length", [0, 1, 31, 32, 33, 39])
def test_stream_that_ends_inside_a_message_is_a_lost_connection(length: int) -> None:
    def speak(stream, header) -> None:
        nonce = payload_of(Part().fields("Q", 0x736F6674))
        stream.sendall(encode_frame(Kind.PONG, header.request_id, nonce)[:length])
        stream.close()

    with stand_in(speak) as address, Server(address, timeout=10.0) as server:
        with pytest.raises(softgrasp.ConnectionLost):
            server.ping()


@pytest.mark.parametrize("version", [3, 9])
def test_server_of_another_version_is_told_with_both_versions(version: int) -> None:
    def speak(stream, header) -> None:
        # What a server of version 3 says: the part has no length.
        words = b"another version"
        payload = struct.pack("<HQ", 13, len(words)) + words + struct.pack("<Q", 0)
        payload += bytes(-len(payload) % 8)
        head = struct.pack("<4sHHIIQ", b"SGRP", version, Kind.REJECTED, 0, len(payload), 0)
        head += struct.pack("<I", crc32c(head))
        stream.sendall(head + struct.pack("<I", crc32c(payload, crc32c(head))) + payload)

    with stand_in(speak, greet=False) as address:
        with pytest.raises(softgrasp.UnsupportedVersion, match=f"version {version} .* {VERSION}:"):
            Server(address, timeout=10.0)
        with pytest.raises(softgrasp.UnsupportedVersion, match=f"version {version} .* {VERSION}:"):
            asyncio.run(AsyncServer.connect(address, timeout=10.0))


def test_program_that_is_no_server_is_told_apart() -> None:
    def speak(stream, header) -> None:
        stream.sendall(b"220 mail.example ESMTP ready for whatever may come\r\n")

    with stand_in(speak, greet=False) as address:
        with pytest.raises(BadStream, match="no Softgrasp server"):
            Server(address, timeout=10.0)


def test_nodes_that_no_mesh_has_are_refused_in_a_contact_answer(server: Server, bar: Bar) -> None:
    model = server.keep(bar.model).hash
    bodies, step, wanted = [Body(Plane())], ContactStep(0.01), bar.mesh.boundary_nodes
    call = calls.contact_frame(model, bar.model, ObjectState(), bodies, step, wanted, "f64")
    header, payload = received(server, call)
    assert judged(call, header, payload)

    def read(reader: PayloadReader) -> ContactAnswer:
        return read_contact_answer(reader, 3)

    assert not judged(calls.Call(call.kind, call.payload, call.reply, read), header, payload)
