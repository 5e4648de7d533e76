"""Weight, pressure and forces: against closed forms, in frames, and at an older server."""

import asyncio

import numpy as np
import pytest
from conftest import Bar, Without

import softgrasp
from softgrasp import AsyncServer, LoadCase, Material, Mesh, Model, NotCapable, Server

YOUNG, DENSITY, GRAVITY = 2e4, 1000.0, 9.81


def column() -> tuple[Mesh, Model, LoadCase]:
    """A column that stands on a smooth floor and has no Poisson's ratio: everything is along z."""
    mesh = Mesh.block((0.02, 0.02, 0.06), (2, 2, 12))
    floor = mesh.nodes_at(z=0.0)
    corner, beside = mesh.nearest_node((0, 0, 0)), mesh.nearest_node((0, 0.02, 0))
    held = LoadCase().prescribe(floor, (None, None, 0.0)).prescribe(corner, (0.0, 0.0, 0.0))
    return mesh, Model(mesh, Material(YOUNG, 0.0), "t4"), held.prescribe(beside, (0.0, None, None))


@pytest.mark.parametrize("element", ["t4", "t4-anp"])
def test_column_under_pressure_is_shortened_as_the_closed_form(server: Server, element) -> None:
    mesh, model, held = column()
    model = Model(mesh, Material(YOUNG, 0.3), element)
    lid = mesh.boundary_of(mesh.nodes_at(z=0.06))
    assert len(lid) == 8
    pressed = server.solve(model, held.pressure(lid, 300.0))
    # Uniform stress, which every element has exactly.
    expected = mesh.points * np.array([0.3, 0.3, -1.0]) * 300.0 / YOUNG
    assert np.abs(pressed.displacements - expected).max() < 1e-9
    assert pressed.reactions.total()[2] == pytest.approx(300.0 * 0.02**2)


def test_quadratic_elements_carry_loads_at_the_middles_of_edges(server: Server) -> None:
    mesh, model, held = column()
    lid = mesh.boundary_of(mesh.nodes_at(z=0.06))
    quadratic = Model(mesh, model.material, "t10")
    answer = server.solve(quadratic, held.weight(DENSITY).pressure(lid, 300.0))
    carried = DENSITY * GRAVITY * mesh.volume + 300.0 * 0.02**2
    assert answer.report.element == "t10"
    assert answer.reactions.total()[2] == pytest.approx(carried)


def test_column_sinks_under_its_weight_as_the_closed_form(server: Server) -> None:
    mesh, model, held = column()
    answer = server.solve(model, held.weight(DENSITY))
    z = mesh.points[:, 2]
    # u = −ρ g (L z − z²/2) / E; the mean over each height is exact in one dimension.
    exact = -DENSITY * GRAVITY * (0.06 * z - 0.5 * z**2) / YOUNG
    means = [answer.displacements[mesh.nodes_at(z=height), 2].mean() for height in np.unique(z)]
    assert np.abs(np.array(means) - np.unique(exact)[::-1]).max() < 0.02 * np.abs(exact).max()
    assert answer.reactions.total()[2] == pytest.approx(DENSITY * GRAVITY * mesh.volume)


def test_frames_with_loads_agree_with_solve_within_their_bound(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model, fixed=bar.left)
    top = bar.mesh.boundary_of(bar.mesh.nodes_at(z=0.02))
    fixed = LoadCase().prescribe(bar.left, (0.0, 0.0, 0.0))
    for turn in (0.0, 0.7, 1.9):
        direction = (0.0, 9.81 * np.sin(turn), -9.81 * np.cos(turn))
        loads = LoadCase().weight(DENSITY, direction).pressure(top, 50.0 * turn)
        loads = loads.force(bar.right[:2], (0.01 * turn, 0.0, 0.002))
        frame = kept.frame(loads)
        assert frame.report.method == "condensed"
        named = softgrasp.LoadCase(
            fixed.known_dofs,
            fixed.known_displacements,
            loads.force_dofs,
            loads.forces,
            (),
            loads.densities,
            loads.acceleration,
            loads.pressures,
        )
        once = server.solve(bar.model, named)
        apart = np.linalg.norm(frame.displacements - once.displacements)
        size = np.linalg.norm(once.displacements)
        assert apart < 1e-10 * size
        if frame.error_bound_rel is not None:
            assert apart <= frame.error_bound_rel * size
        else:
            assert frame.error_bound_why
        assert np.abs(frame.reactions.forces - once.reactions.forces).max() < 1e-9


def test_large_frames_take_loads(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model, fixed=bar.left)
    heavy = LoadCase().weight(5 * DENSITY)
    large, linear = kept.large_frame(heavy), kept.frame(heavy)
    assert large.large.deformation == "large"
    assert large.reactions.total()[2] == pytest.approx(5 * DENSITY * GRAVITY * bar.mesh.volume)
    bent, straight = large.displacements[bar.right], linear.displacements[bar.right]
    # The end of a bent bar comes nearer, which linear elasticity does not see.
    assert bent[:, 0].mean() < straight[:, 0].mean() and bent[:, 2].mean() < -1e-3


def test_regions_have_densities_of_their_own(server: Server, bar: Bar) -> None:
    middle = bar.mesh.points[bar.mesh.tets].mean(axis=1)[:, 0]
    mesh = Mesh(bar.mesh.points, bar.mesh.tets, np.where(middle > 0.02, 9, 4).astype(np.uint32))
    model = Model(mesh, {4: Material(YOUNG, 0.3), 9: Material(2 * YOUNG, 0.3)}, "t4")
    case = LoadCase().prescribe(bar.left, (0.0, 0.0, 0.0))
    answer = server.solve(model, case.weight({9: 3000.0, 4: 1000.0}))
    mass = 0.5 * mesh.volume * (1000.0 + 3000.0)
    assert answer.reactions.total()[2] == pytest.approx(GRAVITY * mass)
    with pytest.raises(softgrasp.BadRequest, match="3 densities"):
        server.solve(model, case.weight({1: 1.0, 2: 1.0, 3: 1.0}))
    inner = mesh.tets[0][:3]
    if sorted(inner) not in np.sort(mesh.boundary, axis=1).tolist():
        with pytest.raises(softgrasp.BadRequest, match="boundary"):
            server.solve(model, case.pressure([inner], 1.0))


def test_arguments_that_no_server_could_take_are_named(bar: Bar) -> None:
    with pytest.raises(ValueError, match="densities"):
        LoadCase().weight(-1.0)
    with pytest.raises(ValueError, match="densities"):
        LoadCase().weight(float("nan"))
    with pytest.raises(ValueError, match="acceleration"):
        LoadCase().weight(1.0, (0.0, 1.0))
    with pytest.raises(ValueError, match="triangles"):
        LoadCase().pressure([[0, 1]], 1.0)
    with pytest.raises(ValueError, match="pressure"):
        LoadCase().pressure(bar.mesh.boundary, float("inf"))
    twice = LoadCase().weight(2.0).pressure([[0, 1, 2]], 3.0).scaled(2.0)
    assert twice.acceleration[2] == pytest.approx(-2 * GRAVITY)
    assert twice.pressures[0].pressure == 6.0 and twice.densities.tolist() == [2.0]


def test_an_older_server_is_not_asked_for_loads(server: Server, bar: Bar, without: Without) -> None:
    without("loads")
    with pytest.raises(NotCapable, match="loads"):
        server.solve(bar.model, bar.case.weight(DENSITY))
    assert server.solve(bar.model, bar.case).displacements.any()


def test_awaited_frames_take_loads(server: Server, bar: Bar) -> None:
    async def ask() -> None:
        async with await AsyncServer.connect(server.address, timeout=60.0) as other:
            kept = await other.keep(bar.model, fixed=bar.left)
            heavy = LoadCase().weight(DENSITY)
            answer = await kept.frame(heavy)
            same = server.keep(bar.model, fixed=bar.left).frame(heavy)
            assert np.array_equal(answer.displacements, same.displacements)

    asyncio.run(ask())
