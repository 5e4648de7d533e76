"""The bytes of the wire: the examples of its page, and names of models."""

import re

import numpy as np
import pytest
from conftest import ROOT, Bar

from softgrasp import (
    LargeDeformation,
    Limits,
    LoadCase,
    Material,
    Mesh,
    Model,
    Question,
    Server,
    calls,
)
from softgrasp.answer import read_answer, read_large_answer
from softgrasp.framing import HEADER_LEN, check_payload, crc32c, decode_header, encode_frame
from softgrasp.payload import PayloadReader

PAGE = ROOT / "docs" / "wire.md"


def example(name: str) -> bytes:
    """The bytes of an example of the page."""
    if not PAGE.exists():
        pytest.skip("the page of the wire is not there")
    section = PAGE.read_text(encoding="utf-8").split(f"\n### {name}\n")[-1]
    block = re.search(r"```hex\n(.*?)```", section, re.DOTALL)
    assert block is not None
    return bytes.fromhex(" ".join(line.split(";")[0] for line in block[1].splitlines()))


def frame_of(call: calls.Call, request_id: int) -> bytes:
    return encode_frame(call.kind, request_id, call.payload)


def read(name: str, how):
    data = example(name)
    header = decode_header(data[:HEADER_LEN], Limits())
    payload = np.frombuffer(data[HEADER_LEN:], dtype=np.uint8)
    check_payload(header, payload)
    return how(PayloadReader(payload, Limits()))


def test_checksum_is_castagnoli() -> None:
    assert crc32c(b"123456789") == 0xE3069283
    assert crc32c(b"6789", crc32c(b"12345")) == 0xE3069283


def test_ping_of_the_page() -> None:
    assert frame_of(calls.ping(0x0123456789ABCDEF), 8) == example("Ping")


def test_solve_once_of_the_page() -> None:
    points = [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01], [0, 0, 0]]
    mesh = Mesh(points, [[0, 1, 2, 3]], [7])
    model = Model(mesh, {7: Material(20_000.0, 0.45)}, "t4")
    case = LoadCase([9, 2], [0.0, -0.001], [4], [0.5])
    question = Question(method="gauss-jordan", reactions=False, deadline_ms=16.5)
    assert frame_of(calls.solve(model, case, question), 2) == example("SolveOnce")


def test_large_frame_of_the_page() -> None:
    case = LoadCase([9, 2], [0.0, -0.001], [4], [0.5])
    question = Question(nodes=[0, 2, 3], precision="f32", max_error=0.01)
    large = LargeDeformation("auto", "neo-hookean-log", 1500.0, "from-rest", "timely")
    call = calls.large_frame(bytes(range(0xA0, 0xC0)), case, large, question)
    assert frame_of(call, 10) == example("LargeFrame")


def test_answer_of_the_page() -> None:
    answer = read("Answer", read_answer)
    assert answer.nodes is not None and answer.nodes.tolist() == [0, 2, 3]
    expected = [[0, -0.001, 0.0005], [0, 0, 0], [0.00025, 0, 0]]
    assert answer.displacements.tolist() == expected
    assert answer.reactions.dofs.tolist() == [2] and answer.reactions.forces.tolist() == [-1.25]
    assert answer.mask_forces.tolist() == [[0, -0.75, 0.125], [0.5, 0, 0]]
    assert answer.report.warnings == ("large rotation", "")
    assert answer.report.warning_level == "caution"
    assert answer.error_bound_rel == 1e-12
    assert answer.report.stage_ms.factor == 2.25
    assert answer.reactions.at([0, 5]).tolist() == [[0, 0, -1.25], [0, 0, 0]]


def test_large_answer_of_the_page() -> None:
    answer = read("LargeAnswer", read_large_answer)
    assert answer.nodes is not None and answer.nodes.tolist() == [1]
    assert answer.displacements.tolist() == [[0, -0.005, 0.0005]]
    assert answer.error_bound_rel is None and answer.error_bound_why == "large deformation"
    large = answer.large
    assert (large.deformation, large.newton_steps, large.factor_age) == ("large", 2, 7)
    assert (large.min_jacobian, large.energy_error_rel, large.settled) == (0.75, 0.001, True)


def test_name_of_a_model_is_that_of_the_server(server: Server, bar: Bar) -> None:
    labelled = Mesh(bar.mesh.points, bar.mesh.tets, np.arange(len(bar.mesh.tets)) % 3)
    several = {k: Material(1e4 * (k + 1), 0.1 * k) for k in range(3)}
    models = [
        bar.model,
        Model(labelled, several, "t4-anp"),
        Model(labelled, Material(1e4, 0.2), "t10"),
        Model(labelled, Material(1e4, 0.4999)),
    ]
    for model in models:
        for fixed in ([], bar.left, [*bar.left, *bar.left[::-1]]):
            kept = server.keep(model, fixed)
            assert kept.upload().model == kept.hash
