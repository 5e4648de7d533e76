"""Requests that belong to a trace: what is sent, and that answers are the same."""

import asyncio

import numpy as np
import pytest
from conftest import Bar
from golden import part_of, with_part

import softgrasp
from softgrasp import AsyncServer, LoadCase, Question, calls, traced

TRACE, SPAN = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"
PARENT = f"00-{TRACE}-{SPAN}-01"
FIELDS = b"\1" + bytes.fromhex(TRACE + SPAN) + b"\1"


def payload() -> bytes:
    return calls.frame(bytes(range(32)), LoadCase([9, 2], [0.0, -0.001]), Question()).payload


def test_trace_stands_behind_the_fields_of_a_part() -> None:
    plain = payload()
    with traced(PARENT):
        within = payload()
        with traced(PARENT[:-2] + "00"):
            unsampled = payload()
        assert payload() == within
    assert payload() == plain
    assert within == with_part(plain, part_of(plain) + FIELDS)
    assert unsampled == with_part(plain, part_of(plain) + FIELDS[:-1] + b"\0")


def test_other_requests_carry_none() -> None:
    with traced(PARENT):
        traced_bytes = [calls.ping().payload, calls.have_model(bytes(32)).payload]
    assert traced_bytes == [calls.ping().payload, calls.have_model(bytes(32)).payload]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "nonsense",
        f"00-{TRACE}-{SPAN}",
        f"00-{TRACE.upper()}-{SPAN}-01",
        f"ff-{TRACE}-{SPAN}-01",
        f"00-{'0' * 32}-{SPAN}-01",
        f"00-{TRACE}-{'0' * 16}-01",
    ],
)
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="trace"), traced(text):
        pass


def test_answers_are_the_same(server: softgrasp.Server, bar: Bar) -> None:
    kept = server.keep(bar.model)
    plain = kept.frame(bar.case)
    with traced(PARENT):
        again = server.keep(bar.model)
        within = again.frame(bar.case)
        whole = server.solve(bar.model, bar.case)
    np.testing.assert_array_equal(plain.displacements, within.displacements)
    assert whole.displacements.shape == plain.displacements.shape


def test_each_task_has_its_own(program: softgrasp.ServerProgram, bar: Bar) -> None:
    async def one(server: AsyncServer, span: str) -> bytes:
        with traced(f"00-{TRACE}-{span}-01"):
            await server.ping()
            return part_of(payload())[-9:-1]

    async def several() -> list[bytes]:
        async with await AsyncServer.connect(program.address) as server:
            return await asyncio.gather(*(one(server, f"{k:016x}") for k in range(1, 9)))

    assert asyncio.run(several()) == [k.to_bytes(8, "big") for k in range(1, 9)]
