"""The bridges to other programs: OpenIGTLink by a client of its own, the ROS 2 node without ROS."""

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from conftest import ROOT
from test_grasps import free_port

import softgrasp

BRIDGES = ROOT / "clients/python/examples/bridges"
CUBE = ROOT / "fuzz/seeds/mesh/cube-msh"


def module(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, BRIDGES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    sys.modules[name] = loaded
    spec.loader.exec_module(loaded)
    return loaded


def test_field_of_an_openigtlink_client_is_that_of_the_answer(tmp_path: Path) -> None:
    pyigtl = pytest.importorskip("pyigtl")
    port = free_port()
    command = [sys.executable, str(BRIDGES / "openigtlink.py"), str(CUBE), "--port", str(port)]
    sender = subprocess.Popen([*command, "--cells", "8", "--rate", "100", "--frames", "200"])
    try:
        client = pyigtl.OpenIGTLinkClient("127.0.0.1", port)
        message = client.wait_for_message("DisplacementField", timeout=30)
        assert message is not None, "no field comes"
        client.stop()
        children = Path(f"/proc/{sender.pid}/task/{sender.pid}/children")
        servers = children.read_text().split() if children.exists() else []
    finally:
        sender.terminate()
        sender.wait(30)
    assert not [pid for pid in servers if Path(f"/proc/{pid}").exists()], "its server is left over"
    mesh = softgrasp.Mesh.read(CUBE)
    low, high = mesh.bounds
    field = np.asarray(message.image)
    assert field.shape == (9, 9, 9, 3)
    # What is held stays, what is pressed goes down by the same, and between it goes by less.
    down = -field[..., 2]
    assert abs(field[0]).max() == 0.0
    pressed = down[-1]
    assert pressed.min() > 0.0 and np.ptp(pressed) < 1e-4 * pressed.max()
    assert (np.diff(down.mean(axis=(1, 2))) >= 0.0).all()
    spacing = 1e3 * float(max(high - low)) / 8
    assert np.allclose(np.diag(message.ijk_to_world_matrix)[:3], spacing, rtol=1e-5)


def test_soft_object_of_the_ros_node_pushes_the_finger_that_presses_it_back(
    server: softgrasp.Server,
) -> None:
    ros2_node = module("ros2_node")
    mesh = softgrasp.Mesh.block((0.04, 0.04, 0.02), (4, 4, 2))
    soft = ros2_node.SoftObject(server, mesh, softgrasp.Material(20_000.0, 0.4))
    felt = None
    for step in range(40):
        depth = min(0.0001 * step, 0.002)
        felt = soft.step(np.array([[0.02, 0.02, 0.028 - depth]]), 0.008, 1.0 / 60.0)
    assert felt is not None
    assert felt.triangles.shape == (len(mesh.boundary), 3, 3)
    # The finger comes from above: it is pushed up, and the surface gives way under it.
    assert felt.forces.shape == (1, 3) and felt.forces[0, 2] > 0.05
    assert abs(felt.forces[0, :2]).max() < 0.1 * felt.forces[0, 2]
    under = np.linalg.norm(felt.triangles - np.array([0.02, 0.02, 0.018]), axis=2).min()
    assert under < 1.5e-3
