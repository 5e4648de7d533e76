"""Ten-node tetrahedra with the mid-edge nodes of their mesh, by the real server."""

import numpy as np
import pytest
from conftest import Bar, Without

from softgrasp import (
    Body,
    ContactStep,
    LoadCase,
    Material,
    Mesh,
    Model,
    NotCapable,
    ObjectState,
    Plane,
    Pose,
    Server,
)

EDGES = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]
"""Corners of the six edges, in the order of the mid-edge nodes."""


def with_mid_edge(mesh: Mesh) -> Mesh:
    """The mesh with a node in the middle of every edge, behind its own."""
    ends = np.sort(mesh.tets[:, EDGES], axis=2).reshape(-1, 2)
    edges, of_edge = np.unique(ends, axis=0, return_inverse=True)
    points = np.concatenate([mesh.points, mesh.points[edges].mean(axis=1)])
    mid_edge = mesh.node_count + of_edge.reshape(-1, 6)
    return Mesh(points, mesh.tets, mesh.regions, mid_edge)


def pulled(bar: Bar) -> tuple[Model, LoadCase, np.ndarray]:
    """The bar with mid-edge nodes, all nodes of both ends held along x, and the exact displacements."""
    mesh = with_mid_edge(bar.mesh)
    left, right = (mesh.nodes_at(x=x) for x in (0.0, bar.LENGTHS[0]))
    case = bar.held.prescribe(left, (0.0, None, None)).prescribe(right, (bar.PULL, None, None))
    across = -bar.POISSON * bar.strain
    exact = mesh.points * np.array([bar.strain, across, across])
    return Model(mesh, bar.model.material, "t10"), case, exact


def test_mid_edge_nodes_are_prescribed_and_answered(server: Server, bar: Bar) -> None:
    model, case, exact = pulled(bar)
    answer = server.solve(model, case)
    assert answer.report.element == "t10"
    assert np.abs(answer.displacements - exact).max() < 1e-11
    right = model.mesh.nodes_at(x=bar.LENGTHS[0])
    assert answer.reactions.total(right)[0] == pytest.approx(bar.force, rel=1e-8)
    assert np.abs(server.keep(model).frame(case).displacements - exact).max() < 1e-11


def test_other_elements_leave_mid_edge_nodes_out(server: Server, bar: Bar) -> None:
    mesh = with_mid_edge(bar.mesh)
    answer = server.solve(Model(mesh, bar.model.material, "t4"), bar.case)
    corners = bar.mesh.node_count
    assert np.abs(answer.displacements[:corners] - bar.exact).max() < 1e-12
    assert not answer.displacements[corners:].any()


def test_an_older_server_is_not_sent_mid_edge_nodes(
    server: Server, bar: Bar, without: Without
) -> None:
    without("mid-edge")
    model, case, _ = pulled(bar)
    # Of a material that no server has seen: it is uploaded.
    other = Model(model.mesh, Material(31_000.0, 0.21), "t10")
    for asked in (lambda: server.solve(model, case), lambda: server.keep(other)):
        with pytest.raises(NotCapable, match="mid-edge"):
            asked()
    straight = Model(bar.mesh, bar.model.material, "t10")
    assert server.solve(straight, bar.case).report.element == "t10"


def areas(mesh: Mesh, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (mesh.points[triangles[:, corner].astype(int)] for corner in range(3))
    return 0.5 * np.cross(b - a, c - a)


def test_faces_with_mid_edge_nodes_are_four_triangles_that_cover_them(bar: Bar) -> None:
    mesh = with_mid_edge(bar.mesh)
    whole, parts = areas(mesh, mesh.boundary), areas(mesh, mesh.faces_between_nodes)
    assert np.allclose(parts.reshape(-1, 4, 3).sum(axis=1), whole, atol=1e-15)
    assert np.abs(areas(bar.mesh, bar.mesh.faces_between_nodes) - whole).max() < 1e-15
    corners = set(bar.mesh.boundary_nodes.tolist())
    assert set(mesh.faces_between_nodes.reshape(-1).tolist()) > corners


@pytest.mark.parametrize("element", ["t10", "t4"])
def test_object_with_mid_edge_nodes_lies_on_a_table(
    server: Server, bar: Bar, element: str
) -> None:
    mesh = with_mid_edge(bar.mesh)
    kept = server.keep(Model(mesh, bar.model.material, element))
    table, step = Body(Plane((0, 0, 1)), Pose()), ContactStep(0.01, density=1000.0)
    state, pressed = ObjectState(), set()
    for _ in range(150):
        answer = kept.contact_frame(state, [table], step)
        state = answer.state
        pressed |= set(np.asarray(state.force_nodes).tolist())
    weight = 1000.0 * 9.81 * bar.mesh.volume
    assert answer.loads.forces[0, 2] == pytest.approx(weight, rel=1e-6)
    assert answer.contact.is_converged
    # Between corners too, where there are nodes.
    assert (max(pressed) >= bar.mesh.node_count) == (element == "t10")
