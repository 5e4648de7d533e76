"""Answers are those of the command line client, where that is beside the server."""

import csv
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import PROGRAM

from softgrasp import LoadCase, Material, Mesh, Model, Server


@pytest.fixture
def command() -> str:
    beside = None if PROGRAM is None else Path(PROGRAM).with_name("glove-client")
    found = str(beside) if beside is not None and beside.exists() else shutil.which("glove-client")
    if found is None:
        pytest.skip("glove-client is not beside the server")
    return found


@pytest.mark.parametrize("shape", ["cube", "strawberry"])
def test_answers_are_those_of_the_command(
    server: Server, command: str, shape: str, tmp_path: Path
) -> None:
    file = tmp_path / "object.msh"
    make = [command, "mesh", shape, "--nodes", "300", "--out", str(file)]
    subprocess.run(make, check=True, capture_output=True)
    mesh = Mesh.read(file)
    low, high = mesh.bounds
    bottom = np.flatnonzero(mesh.points[:, 1] <= low[1] + 0.1 * (high[1] - low[1]))
    top = mesh.nearest_node((0.0, high[1], 0.0))
    push = -0.05 * (high[1] - low[1])
    with (tmp_path / "known.csv").open("w", newline="") as known:
        table = csv.writer(known)
        table.writerow(("node", "ux", "uy", "uz"))
        table.writerows((node, 0, 0, 0) for node in bottom)
        table.writerow((top, "", push, ""))
    options = ["--young", "20000", "--poisson", "0.4", "--element", "t4-anp", "--method", "front"]
    names = ["--mesh", str(file), "--known", str(tmp_path / "known.csv")]
    out = ["--out", str(tmp_path / "out.csv")]
    subprocess.run([command, "solve", *names, *out, *options], check=True, capture_output=True)
    with (tmp_path / "out.csv").open(newline="") as file_of_rows:
        rows = [[float(value) for value in row[1:]] for row in list(csv.reader(file_of_rows))[1:]]
    case = LoadCase().prescribe(bottom, (0.0, 0.0, 0.0)).prescribe([top], (None, push, None))
    model = Model(mesh, Material(20_000.0, 0.4), "t4-anp")
    answer = server.solve(model, case, method="front")
    assert np.abs(answer.displacements - np.array(rows)).max() < 1e-12
