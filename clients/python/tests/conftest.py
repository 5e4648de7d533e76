"""What the tests share: a real server, a bar, and servers with other options."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import softgrasp

PROGRAM = os.environ.get("SOFTGRASP_SERVER")
"""Path of the server program; without it the PATH is searched."""
ROOT = Path(__file__).resolve().parents[3]
"""The repository, whose documents some tests read."""

Spawn = Callable[..., softgrasp.ServerProgram]


@pytest.fixture
def spawn() -> Iterator[Spawn]:
    """Starts servers with options, and ends them."""
    started: list[softgrasp.ServerProgram] = []

    def start(*arguments: str) -> softgrasp.ServerProgram:
        started.append(softgrasp.ServerProgram(PROGRAM, ["--threads", "2", *arguments]))
        return started[-1]

    yield start
    for program in started:
        program.end()


@pytest.fixture(scope="session")
def program() -> Iterator[softgrasp.ServerProgram]:
    """One server for all tests that do it no harm."""
    started = softgrasp.ServerProgram(PROGRAM, ["--threads", "2"])
    yield started
    started.end()


Without = Callable[[str], None]


@pytest.fixture
def without(server: softgrasp.Server, monkeypatch: pytest.MonkeyPatch) -> Without:
    """Makes the session take its server for an older one that lacks a capability."""

    def forget(capability: str) -> None:
        known = server.capabilities
        assert capability in known
        told = {**server.welcome.__dict__, "capabilities": known - {capability}}
        monkeypatch.setattr(server, "_welcome", server.welcome.__class__(**told))

    return forget


@pytest.fixture
def server(program: softgrasp.ServerProgram) -> Iterator[softgrasp.Server]:
    """A session with that server."""
    with softgrasp.Server(program.address, timeout=60.0) as session:
        yield session


class Bar:
    """A bar of 40 mm × 20 mm × 20 mm that is pulled along x by 1 mm and free to become thinner."""

    LENGTHS = (0.04, 0.02, 0.02)
    YOUNG, POISSON = 20_000.0, 0.3
    PULL = 0.001

    def __init__(self) -> None:
        self.mesh = softgrasp.Mesh.block(self.LENGTHS, (4, 2, 2))
        self.model = softgrasp.Model(
            self.mesh, softgrasp.Material(self.YOUNG, self.POISSON), element="t4"
        )
        self.left = self.mesh.nodes_at(x=0.0)
        self.right = self.mesh.nodes_at(x=self.LENGTHS[0])
        origin = self.mesh.nearest_node((0.0, 0.0, 0.0))
        beside = self.mesh.nearest_node((0.0, self.LENGTHS[1], 0.0))
        self.held = (
            softgrasp.LoadCase()
            .prescribe(self.left, (0.0, None, None))
            .prescribe(origin, (0.0, 0.0, 0.0))
            .prescribe(beside, (None, None, 0.0))
        )
        self.case = self.held.prescribe(self.right, (self.PULL, None, None))

    @property
    def strain(self) -> float:
        return self.PULL / self.LENGTHS[0]

    @property
    def exact(self) -> np.ndarray:
        """The displacements of a uniform strain, which linear elements represent."""
        across = -self.POISSON * self.strain
        return self.mesh.points * np.array([self.strain, across, across])

    @property
    def force(self) -> float:
        """Force that the pull takes, N."""
        return self.YOUNG * self.strain * self.LENGTHS[1] * self.LENGTHS[2]


@pytest.fixture(scope="session")
def bar() -> Bar:
    return Bar()
