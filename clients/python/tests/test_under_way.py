"""Requests that are under way: cancelled, several at once, and a server that says it is there."""

import asyncio
import contextlib
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import Bar
from recorded import rejected_payload, stand_in

import softgrasp
from softgrasp import AsyncServer, Limits, LoadCase, Material, Mesh, Model, Server, calls
from softgrasp.conversation import AHEAD_MAX, Conversation
from softgrasp.fields import Part
from softgrasp.framing import Kind, encode_frame
from softgrasp.payload import payload_of

ALIVE = encode_frame(Kind.ALIVE, 0, payload_of(Part()))


def pong(header) -> bytes:
    """The reply to a ping."""
    return encode_frame(Kind.PONG, header.request_id, header.payload)


class Hesitant:
    """A server that answers no ping but cancelled ones; a second `Cancel` makes it answer all."""

    def __init__(self) -> None:
        self.asked = threading.Semaphore(0)
        self.cancelled: list[int] = []
        self.heard: list = []

    def __call__(self, stream, header) -> None:
        if header.kind == Kind.CANCEL:
            number = int.from_bytes(header.payload[8:], "little")
            self.cancelled.append(number)
            words = rejected_payload(15, "cancelled")
            stream.sendall(encode_frame(Kind.REJECTED, number, words))
        elif self.cancelled:
            stream.sendall(pong(header))
        self.heard.append(header)
        self.asked.release()


def test_request_is_cancelled_from_another_thread_and_the_session_goes_on() -> None:
    hesitant = Hesitant()
    with stand_in(hesitant) as address, Server(address) as server, ThreadPoolExecutor(1) as pool:
        waits = pool.submit(server.ping)
        assert hesitant.asked.acquire(timeout=10.0)
        server.cancel()
        with pytest.raises(softgrasp.Cancelled):
            waits.result(timeout=10.0)
        assert hesitant.cancelled == [hesitant.heard[0].request_id]
        server.ping()
        server.cancel()
        server.ping()
        assert len(hesitant.cancelled) == 1, "nothing was under way"


def test_cancelled_task_cancels_its_request_and_the_session_goes_on() -> None:
    hesitant = Hesitant()

    async def ask(address: str) -> None:
        async with await AsyncServer.connect(address) as server:
            task = asyncio.create_task(server.ping())
            await asyncio.to_thread(hesitant.asked.acquire, timeout=10.0)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
            await asyncio.to_thread(hesitant.asked.acquire, timeout=10.0)
            assert hesitant.cancelled == [hesitant.heard[0].request_id]
            # What comes to the cancelled one is for nobody.
            await server.ping()
            assert server.is_open

    with stand_in(hesitant) as address:
        asyncio.run(ask(address))


def test_answer_that_comes_to_a_cancelled_request_is_passed_over() -> None:
    kept: list = []

    def speak(stream, header) -> None:
        if header.kind == Kind.CANCEL:
            stream.sendall(pong(kept[0]))
        elif kept:
            stream.sendall(pong(header))
        kept.append(header)

    async def ask(address: str) -> None:
        async with await AsyncServer.connect(address) as server:
            with pytest.raises(asyncio.TimeoutError):
                await asyncio.wait_for(server.ping(), 0.1)
            await server.ping()

    with stand_in(speak) as address:
        asyncio.run(ask(address))


def test_replies_find_their_requests_in_any_order() -> None:
    waiting: list = []

    def speak(stream, header) -> None:
        waiting.append(header)
        if len(waiting) == 4:
            stream.sendall(b"".join(pong(header) for header in reversed(waiting)))

    with stand_in(speak) as address, Server(address, timeout=20.0) as server:
        with ThreadPoolExecutor(4) as pool:
            nonces = list(pool.map(lambda n: server._ask(calls.ping(n)), range(4)))
    assert nonces == [0, 1, 2, 3]
    waiting.clear()

    async def ask(address: str) -> None:
        async with await AsyncServer.connect(address, timeout=20.0) as server:
            pings = [server._ask(calls.ping(n)) for n in range(4)]
            assert await asyncio.gather(*pings) == [0, 1, 2, 3]

    with stand_in(speak) as address:
        asyncio.run(ask(address))


def test_small_requests_are_sent_ahead_and_large_ones_wait() -> None:
    def call(length: int) -> calls.Call:
        return calls.Call(Kind.PING, bytes(length), Kind.PONG, lambda reader: None)

    conversation = Conversation(Limits())
    assert conversation.has_room(call(10 * AHEAD_MAX)), "nothing is under way"
    conversation.begin(call(10 * AHEAD_MAX))
    assert not conversation.has_room(call(AHEAD_MAX + 1))
    assert conversation.has_room(call(AHEAD_MAX))
    conversation.begin(call(AHEAD_MAX - 8))
    assert conversation.has_room(call(8)) and not conversation.has_room(call(9))


def test_last_words_are_for_all_that_wait() -> None:
    waiting: list = []

    def speak(stream, header) -> None:
        waiting.append(header)
        if len(waiting) == 3:
            stream.sendall(encode_frame(Kind.REJECTED, 0, rejected_payload(11, "it stops")))

    def ask(server: Server) -> str:
        try:
            server.ping()
        except softgrasp.SoftgraspError as error:
            return f"{type(error).__name__} {error}"
        return "answered"

    with stand_in(speak) as address, Server(address, timeout=20.0) as server:
        with ThreadPoolExecutor(3) as pool:
            words = list(pool.map(ask, [server] * 3))
        assert all("it stops" in each for each in words), words
        assert not server.is_open


def test_word_that_the_server_is_there_is_passed_over() -> None:
    def speak(stream, header) -> None:
        for _ in range(5):
            stream.sendall(ALIVE)
            time.sleep(0.05)
        stream.sendall(ALIVE + pong(header) + ALIVE)

    async def ask(address: str) -> None:
        async with await AsyncServer.connect(address, alive_every=0.1) as server:
            await server.ping()
            await server.ping()

    with stand_in(speak) as address:
        for alive_every in (None, 0.1):
            with Server(address, alive_every=alive_every) as server:
                server.ping()
                server.ping()
        asyncio.run(ask(address))


def test_server_that_does_not_say_that_it_is_there_is_given_up() -> None:
    async def ask(address: str) -> None:
        async with await AsyncServer.connect(address, alive_every=0.1) as server:
            with pytest.raises(softgrasp.ConnectionLost, match=r"silent for 0\.3 s"):
                await server.ping()
            assert not server.is_open

    with stand_in(lambda stream, header: None) as address:
        start = time.monotonic()
        with Server(address, alive_every=0.1) as server:
            with pytest.raises(softgrasp.ConnectionLost, match=r"silent for 0\.3 s"):
                server.ping()
            assert not server.is_open
        asyncio.run(ask(address))
        assert time.monotonic() - start < 5.0


def test_resting_session_takes_what_the_server_says() -> None:
    told = threading.Event()

    def speak(stream, header) -> None:
        stream.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 16_384)
        # Far more than lies in buffers on the way.
        stream.sendall(pong(header) + ALIVE * 25_000)
        told.set()

    with stand_in(speak) as address, Server(address, alive_every=0.1) as server:
        server.ping()
        assert told.wait(timeout=30.0)
        server.ping()


def test_resting_session_hears_why_it_ends() -> None:
    def speak(stream, header) -> None:
        words = rejected_payload(11, "the server stops")
        stream.sendall(pong(header) + encode_frame(Kind.REJECTED, 0, words))

    with stand_in(speak) as address, Server(address, alive_every=0.1) as server:
        server.ping()
        until = time.monotonic() + 10.0
        while server.is_open and time.monotonic() < until:
            time.sleep(0.01)
        with pytest.raises(softgrasp.ConnectionLost, match="the server stops"):
            server.ping()


def test_time_of_an_answer_counts_from_the_answer_before() -> None:
    def speak(stream, header) -> None:
        time.sleep(0.3)
        stream.sendall(pong(header))

    async def ask(address: str) -> None:
        async with await AsyncServer.connect(address, timeout=0.8) as server:
            await asyncio.gather(*(server.ping() for _ in range(4)))

    with stand_in(speak) as address:
        with Server(address, timeout=0.8) as server, ThreadPoolExecutor(4) as pool:
            list(pool.map(lambda _: server.ping(), range(4)))
        asyncio.run(ask(address))


def slow_request() -> tuple[Model, LoadCase]:
    """What the loop of 1998 takes seconds for, on any machine."""
    mesh = Mesh.block((0.1, 0.1, 0.1), (9, 9, 9))
    held = LoadCase().prescribe(mesh.nodes_at(x=0.0), (0.0, 0.0, 0.0))
    case = held.prescribe(mesh.nodes_at(x=0.1), (0.001, 0.0, 0.0))
    return Model(mesh, Material(1e4, 0.3), "t4"), case


def test_real_server_gives_up_what_is_cancelled(server: Server, bar: Bar) -> None:
    model, case = slow_request()
    with ThreadPoolExecutor(1) as pool:
        work = pool.submit(server.solve, model, case, method="gauss-jordan-plain")
        while not server._connection.conversation.under_way:
            time.sleep(0.01)
        start = time.monotonic()
        server.cancel()
        with pytest.raises(softgrasp.Cancelled) as caught:
            work.result(timeout=60.0)
        assert caught.value.code == 15 and time.monotonic() - start < 2.0
    assert np.abs(server.solve(bar.model, bar.case).displacements - bar.exact).max() < 1e-12


def test_real_server_answers_the_newest_of_frames(server: Server, bar: Bar) -> None:
    async def ask() -> None:
        async with await AsyncServer.connect(server.address, timeout=60.0) as session:
            kept = await session.keep(bar.model)
            model, case = slow_request()
            slow = asyncio.create_task(session.solve(model, case, method="gauss-jordan-plain"))
            await asyncio.sleep(0.2)
            frames = [kept.frame(bar.case.scaled(k), newest_wins=True) for k in range(1, 5)]
            older = kept.frame(bar.case.scaled(9))
            tasks = [asyncio.create_task(frame) for frame in (older, *frames)]
            while len(session._connection.conversation.under_way) < 6:
                await asyncio.sleep(0.01)
            slow.cancel()
            first, *others, last = await asyncio.gather(*tasks, return_exceptions=True)
            assert all(isinstance(each, softgrasp.Superseded) for each in others), others
            assert np.abs(first.displacements - 9 * bar.exact).max() < 1e-11
            assert np.abs(last.displacements - 4 * bar.exact).max() < 1e-11

    asyncio.run(ask())


def test_real_server_says_that_it_is_there_while_it_works_and_rests(server: Server) -> None:
    model, case = slow_request()
    with Server(server.address, alive_every=0.5) as session, ThreadPoolExecutor(1) as pool:
        work = pool.submit(session.solve, model, case, method="gauss-jordan-plain")
        # Longer than the silence after which it would be given up.
        time.sleep(2.0)
        session.cancel()
        with contextlib.suppress(softgrasp.Cancelled):
            work.result(timeout=60.0)
        time.sleep(2.0)
        assert session.is_open
        session.ping()
