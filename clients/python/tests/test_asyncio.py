"""The same calls awaited: answers, turns of tasks, cancelling, a killed server."""

import asyncio
import time

import numpy as np
import pytest
from conftest import PROGRAM, Bar, Spawn
from recorded import stand_in

import softgrasp
from softgrasp import AsyncServer, Body, ContactStep, ObjectState, Plane, Server


def test_answers_are_those_of_blocking_calls(server: Server, bar: Bar) -> None:
    async def ask() -> None:
        async with await AsyncServer.connect(server.address, timeout=60.0) as other:
            assert other.welcome == server.welcome
            await other.ping()
            once = await other.solve(bar.model, bar.case)
            assert np.array_equal(
                once.displacements, server.solve(bar.model, bar.case).displacements
            )
            kept = await other.keep(bar.model)
            frame = await kept.frame(bar.case, precision="f32", nodes=[0, 5])
            assert frame.displacements.shape == (2, 3)
            large = await kept.large_frame(bar.case)
            assert large.large.deformation == "large"
            assert (await other.solve_large(bar.model, bar.case)).large.settled
            sets = [bar.case.known_displacements] * 2
            assert len((await other.solve_several(bar.model, bar.case, sets)).cases) == 2
            assert len((await kept.solve_several(bar.case, sets)).cases) == 2
            assert "cancel" in other.capabilities
            step = await kept.contact_frame(ObjectState(), [Body(Plane())], ContactStep(0.01))
            assert len(step.loads.contacts) == 1
            await kept.prefetch(nodes=bar.right)
            await kept.drop()
            again = await kept.frame(bar.case)
            assert np.abs(again.displacements - bar.exact).max() < 1e-12
            with pytest.raises(softgrasp.UnknownMethod):
                await other.solve(bar.model, bar.case, method="nobody")
            await other.ping()

    asyncio.run(ask())


def test_tasks_of_one_session_take_turns(server: Server, bar: Bar) -> None:
    async def ask() -> None:
        async with await AsyncServer.connect(server.address, timeout=60.0) as other:
            kept = await other.keep(bar.model)
            frames = [kept.frame(bar.case.scaled(k)) for k in range(1, 30)]
            answers = await asyncio.gather(*frames)
            for k, answer in enumerate(answers, 1):
                assert np.abs(answer.displacements - k * bar.exact).max() < 1e-11

    asyncio.run(ask())


def test_cancelled_task_leaves_the_session_as_it_was(spawn: Spawn, bar: Bar) -> None:
    async def ask() -> None:
        async with await AsyncServer.connect(spawn().address, timeout=60.0) as server:
            kept = await server.keep(bar.model)
            for _ in range(20):
                task = asyncio.create_task(kept.frame(bar.case))
                await asyncio.sleep(0)
                task.cancel()
                with pytest.raises(asyncio.CancelledError):
                    await task
                answer = await kept.frame(bar.case)
                assert np.abs(answer.displacements - bar.exact).max() < 1e-12

    asyncio.run(ask())


def test_killed_and_silent_servers_are_noticed(bar: Bar) -> None:
    async def killed() -> None:
        async with await AsyncServer.spawn(PROGRAM, threads=1) as server:
            kept = await server.keep(bar.model)
            assert server.program is not None
            server.program.kill()
            with pytest.raises(softgrasp.ConnectionLost):
                await kept.frame(bar.case)
            assert not server.is_open

    async def silent(address: str) -> None:
        async with await AsyncServer.connect(address, timeout=0.3) as server:
            with pytest.raises(softgrasp.NoAnswerInTime):
                await server.ping()

    start = time.monotonic()
    asyncio.run(killed())
    with stand_in(lambda stream, header: None) as address:
        asyncio.run(silent(address))
    assert time.monotonic() - start < 10.0
    with pytest.raises(softgrasp.ConnectionLost):
        asyncio.run(AsyncServer.connect("127.0.0.1:1"))


def test_large_answers_come_whole(server: Server) -> None:
    mesh = softgrasp.Mesh.block((0.1, 0.1, 0.1), (16, 16, 16))
    model = softgrasp.Model(mesh, softgrasp.Material(1e4, 0.3))
    case = softgrasp.LoadCase().prescribe(mesh.nodes_at(x=0.0), (0.0, 0.0, 0.0))
    case = case.prescribe(mesh.nodes_at(x=0.1), (0.001, 0.0, 0.0))
    # Several megabytes in one message, more than any buffer on the way.
    sets = [case.known_displacements * k for k in range(1, 30)]

    async def ask() -> softgrasp.SeveralAnswers:
        async with await AsyncServer.connect(server.address, timeout=60.0) as other:
            return await other.solve_several(model, case, sets, estimate=False)

    awaited = asyncio.run(ask())
    blocking = server.solve_several(model, case, sets, estimate=False)
    for one, other in zip(awaited.cases, blocking.cases, strict=True):
        assert np.array_equal(one.displacements, other.displacements)
    assert len(awaited.cases) == 29
