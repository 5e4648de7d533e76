"""The bytes of the wire: the examples of its page, and names of models."""

import re

import numpy as np
import pytest
from conftest import ROOT, Bar
from golden import golden

from softgrasp import Material, Mesh, Model, Server
from softgrasp.framing import crc32c

PAGE = ROOT / "docs" / "wire.md"


def example(name: str) -> bytes:
    """The bytes of an example of the page."""
    if not PAGE.exists():
        pytest.skip("the page of the wire is not there")
    section = PAGE.read_text(encoding="utf-8").split(f"\n### {name}\n")[-1]
    block = re.search(r"```hex\n(.*?)```", section, re.DOTALL)
    assert block is not None
    return bytes.fromhex(" ".join(line.split(";")[0] for line in block[1].splitlines()))


def test_checksum_is_castagnoli() -> None:
    assert crc32c(b"123456789") == 0xE3069283
    assert crc32c(b"6789", crc32c(b"12345")) == 0xE3069283


@pytest.mark.parametrize("name", ["Ping", "Ask", "Ask-large", "Answer-large", "Answer"])
def test_examples_of_the_page_are_the_recorded_messages(name: str) -> None:
    assert example(name) == golden(name)


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
