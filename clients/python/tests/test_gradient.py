"""Gradients against central differences, and against a bar that is pulled."""

import asyncio
from dataclasses import replace

import numpy as np
import pytest

import softgrasp
from softgrasp import (
    AsyncServer,
    LargeDeformation,
    LoadCase,
    Material,
    Mesh,
    Model,
    Pressure,
    Quantity,
    Server,
    Uncertain,
)

RANDOM = np.random.default_rng(20261125)


class Pressed:
    """A block of two materials, held below, pushed at the top and pulled at a side."""

    def __init__(self) -> None:
        block = Mesh.block((0.03, 0.02, 0.02), (3, 2, 2))
        middle = block.points[block.tets].mean(axis=1)[:, 0]
        wobbled = block.points + 0.001 * RANDOM.uniform(-1.0, 1.0, block.points.shape)
        self.mesh = Mesh(wobbled, block.tets, (middle > 0.015).astype(np.uint32))
        self.bottom = block.nodes_at(z=0.0)
        self.top = block.nodes_at(z=0.02)
        self.side = np.setdiff1d(block.nodes_at(x=0.03), np.concatenate([self.bottom, self.top]))
        self.materials = {0: Material(2e4, 0.3), 1: Material(6e4, 0.4)}
        case = LoadCase().prescribe(self.bottom, (0.0, 0.0, 0.0))
        case = case.prescribe(self.top, (0.0005, None, -0.001))
        case = case.weight({0: 1000.0, 1: 3000.0}, (3.0, 1.0, -9.81))
        # The corners in another order than seen from outside.
        front = self.mesh.boundary_of(block.nodes_at(y=0.0))[:, ::-1]
        case = case.pressure(front, 300.0).pressure(self.mesh.boundary_of(self.bottom), 50.0)
        self.case = case.force(self.side, (0.1, 0.02, -0.05))
        self.linear = RANDOM.standard_normal((self.mesh.node_count, 3))
        self.of_reactions = 1e-3 * RANDOM.standard_normal(len(case.known_dofs))

    def model(self, mesh: Mesh | None = None, **materials: Material) -> Model:
        own = {**self.materials, **{int(k[1:]): m for k, m in materials.items()}}
        return Model(self.mesh if mesh is None else mesh, own, "t4")

    def quantity(self, server: Server, model: Model, case: LoadCase) -> float:
        """A J that is linear and quadratic in displacements, and linear in reactions."""
        answer = server.solve(model, case)
        u = answer.displacements
        place = np.searchsorted(answer.reactions.dofs, case.known_dofs)
        held = answer.reactions.forces[place]
        linear, quadratic = (self.linear * u).sum(), 0.5e3 * (u**2).sum()
        return float(linear + quadratic + self.of_reactions @ held)

    def gradient(self, server: Server) -> softgrasp.Gradient:
        kept = server.keep(self.model())
        answer = kept.frame(self.case)
        slope = self.linear + 1e3 * answer.displacements
        return kept.gradient(
            self.case, by_displacements=slope, by_reactions=self.of_reactions, answer=answer
        )


def differs(found: float, up: float, down: float, step: float) -> float:
    """How far a derivative is from the central difference, of the latter's size."""
    difference = (up - down) / (2.0 * step)
    return abs(found - difference) / max(abs(difference), 1e-12)


def test_gradient_by_known_displacements_and_forces_is_that_of_central_differences(
    server: Server,
) -> None:
    pressed = Pressed()
    found, model, case = pressed.gradient(server), pressed.model(), pressed.case
    for k in range(0, len(case.known_dofs), 9):
        step = np.zeros(len(case.known_dofs))
        step[k] = 1e-4
        up, down = (
            pressed.quantity(server, model, case.with_displacements(case.known_displacements + s))
            for s in (step, -step)
        )
        assert differs(found.known_displacements[k], up, down, 1e-4) < 1e-6
    for node in pressed.side:
        for axis in range(3):
            step = np.zeros(3)
            step[axis] = 1e-2
            up, down = (
                pressed.quantity(server, model, case.force([node], s)) for s in (step, -step)
            )
            assert differs(found.forces[node, axis], up, down, 1e-2) < 1e-6
    assert not found.forces[pressed.bottom].any()


def test_gradient_by_places_of_nodes_is_that_of_central_differences(server: Server) -> None:
    pressed = Pressed()
    found = pressed.gradient(server)
    assert found.points is not None
    scale = np.abs(found.points).max()
    for node in range(0, pressed.mesh.node_count, 5):
        for axis in range(3):
            up, down = (_quantity_moved(pressed, server, node, axis, s) for s in (1e-7, -1e-7))
            assert abs(found.points[node, axis] - (up - down) / 2e-7) < 1e-6 * scale


def _quantity_moved(pressed: Pressed, server: Server, node: int, axis: int, by: float) -> float:
    points = np.array(pressed.mesh.points)
    points[node, axis] += by
    mesh = Mesh(points, pressed.mesh.tets, pressed.mesh.regions)
    return pressed.quantity(server, pressed.model(mesh), pressed.case)


def test_gradient_by_materials_of_regions_is_that_of_central_differences(server: Server) -> None:
    pressed = Pressed()
    found = pressed.gradient(server)
    assert found.young is not None and found.poisson is not None
    for label, material in pressed.materials.items():
        for name, own, step in (
            ("young", found.young[label], 1e-4 * material.young),
            ("poisson", found.poisson[label], 1e-5),
        ):
            up, down = (
                pressed.quantity(
                    server,
                    pressed.model(
                        **{f"r{label}": replace(material, **{name: getattr(material, name) + s})}
                    ),
                    pressed.case,
                )
                for s in (step, -step)
            )
            assert differs(own, up, down, step) < 1e-6, (label, name)


def test_gradient_by_weight_and_pressures_is_that_of_central_differences(server: Server) -> None:
    pressed = Pressed()
    found, model, case = pressed.gradient(server), pressed.model(), pressed.case
    assert found.acceleration is not None and found.pressures is not None
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1.0
        up, down = (
            pressed.quantity(server, model, replace(case, acceleration=case.acceleration + s))
            for s in (step, -step)
        )
        assert differs(found.acceleration[axis], up, down, 1.0) < 1e-6
    for k, pressure in enumerate(case.pressures):
        others = [p for p in case.pressures if p is not pressure]
        up, down = (
            pressed.quantity(
                server,
                model,
                replace(case, pressures=(*others, Pressure(pressure.triangles, value))),
            )
            for value in (pressure.pressure + 10.0, pressure.pressure - 10.0)
        )
        assert differs(found.pressures[k], up, down, 10.0) < 1e-6


def test_awaited_gradient_is_the_same(server: Server) -> None:
    pressed = Pressed()
    kept = server.keep(pressed.model())
    slope = np.ones((pressed.mesh.node_count, 3))
    expected = kept.gradient(pressed.case, by_displacements=slope)

    async def ask() -> softgrasp.Gradient:
        async with await AsyncServer.connect(server.address, timeout=60.0) as other:
            awaited = await other.keep(pressed.model())
            answer = await awaited.frame(pressed.case)
            again = await awaited.gradient(pressed.case, by_displacements=slope, answer=answer)
            found = await awaited.gradient(pressed.case, by_displacements=slope)
            assert np.array_equal(again.forces, found.forces)
            return found

    found = asyncio.run(ask())
    assert np.array_equal(found.known_displacements, expected.known_displacements)
    assert found.points is not None and np.array_equal(found.points, expected.points)
    assert found.young == expected.young and found.poisson == expected.poisson


def test_force_of_a_pulled_bar_grows_with_young_s_modulus_as_the_closed_form(
    server: Server,
) -> None:
    length, side, pull, young = 0.04, 0.01, 0.001, 2e4
    mesh = Mesh.block((length, side, side), (4, 1, 1))
    left, right = mesh.nodes_at(x=0.0), mesh.nodes_at(x=length)
    case = LoadCase().prescribe(left, (0.0, 0.0, 0.0)).prescribe(right, (pull, 0.0, 0.0))
    kept = server.keep(Model(mesh, Material(young, 0.0), "t4"))
    along_at_right = np.isin(case.known_dofs, 3 * right).astype(float)
    found = kept.gradient(case, by_reactions=along_at_right)
    # F = E A δ / L.
    area = side * side
    assert found.young is not None
    assert found.young[0] == pytest.approx(area * pull / length, rel=1e-10)
    stiffness = (along_at_right * found.known_displacements).sum()
    assert stiffness == pytest.approx(young * area / length, rel=1e-10)


def test_what_has_no_gradient_is_said(server: Server) -> None:
    mesh = Mesh.block((0.03, 0.02, 0.02), (3, 2, 2))
    bottom, top = mesh.nodes_at(z=0.0), mesh.nodes_at(z=0.02)
    case = LoadCase().prescribe(bottom, (0.0, 0.0, 0.0))
    kept = server.keep(Model(mesh, Material(2e4, 0.48), "t4-anp"))
    found = kept.gradient(case, by_displacements=np.ones((mesh.node_count, 3)))
    assert found.points is None and found.young is None and found.poisson is None
    assert found.forces[top].any()
    with pytest.raises(ValueError, match="masks"):
        kept.gradient(case.mask(top, (0.0, 0.0, -0.001)))
    with pytest.raises(ValueError, match="by_displacements"):
        kept.gradient(case, by_displacements=np.ones(3))


def quantity_of(pressed: Pressed) -> Quantity:
    """What `Pressed.quantity` works out, as the server is told it."""
    curved = np.full(pressed.linear.shape, 1e3)
    return Quantity(pressed.linear, curved, pressed.of_reactions, points=True)


def test_gradient_of_the_server_is_that_of_this_package(server: Server) -> None:
    pressed = Pressed()
    expected = pressed.gradient(server)
    once = server.solve(pressed.model(), pressed.case, quantity=quantity_of(pressed)).gradient
    frame = server.keep(pressed.model()).frame(pressed.case, quantity=quantity_of(pressed))
    for found in (once, frame.gradient):
        assert found is not None and found.value is not None
        quantity = pressed.quantity(server, pressed.model(), pressed.case)
        assert found.value == pytest.approx(quantity, rel=1e-9)
        for name in ("known_displacements", "forces", "points", "acceleration", "pressures"):
            ours, own = getattr(expected, name), getattr(found, name)
            assert np.abs(ours - own).max() < 1e-9 * np.abs(ours).max(), name
        assert expected.young is not None and expected.poisson is not None
        assert found.young == pytest.approx(expected.young, rel=1e-9)
        assert found.poisson == pytest.approx(expected.poisson, rel=1e-9)
    assert server.solve(pressed.model(), pressed.case).gradient is None


@pytest.mark.parametrize("element", ["t4", "t4-anp", "t10"])
def test_gradient_at_large_deformation_is_that_of_central_differences(
    server: Server, element: str
) -> None:
    pressed = Pressed()
    case, quantity = pressed.case, quantity_of(pressed)
    large = LargeDeformation(law="neo-hookean-log", path="from-rest")

    def solved(case: LoadCase, young: float = 6e4) -> softgrasp.Gradient:
        materials = {0: Material(2e4, 0.3), 1: Material(young, 0.4)}
        model = Model(pressed.mesh, materials, element)  # type: ignore[arg-type]
        found = server.solve_large(model, case, large, quantity=quantity).gradient
        assert found is not None
        return found

    def value(case: LoadCase, young: float = 6e4) -> float:
        found = solved(case, young).value
        assert found is not None
        return found

    found = solved(case)
    for k in range(0, len(case.known_dofs), 11):
        step = np.zeros(len(case.known_dofs))
        step[k] = 1e-6
        up, down = (
            value(case.with_displacements(case.known_displacements + s)) for s in (step, -step)
        )
        assert differs(found.known_displacements[k], up, down, 1e-6) < 1e-6
    node = pressed.side[0]
    push = np.array([2e-4, 0.0, 0.0])
    up, down = (value(case.force([node], s)) for s in (push, -push))
    assert differs(found.forces[node, 0], up, down, 2e-4) < 1e-6
    assert found.young is not None and found.points is not None
    assert differs(found.young[1], value(case, 60010.0), value(case, 59990.0), 10.0) < 1e-6
    assert np.abs(found.points.sum(axis=0)).max() < 1e-8 * np.abs(found.points).max()
    # A path of a kept model that has come to rest has the same derivatives.
    kept = server.keep(Model(pressed.mesh, pressed.materials, element))  # type: ignore[arg-type]
    on_path = kept.large_frame(case, large, quantity=quantity).gradient
    assert on_path is not None
    assert np.abs(on_path.forces - found.forces).max() < 1e-6 * np.abs(found.forces).max()


def test_what_has_no_derivatives_is_refused_by_name(server: Server) -> None:
    pressed = Pressed()
    model, quantity = pressed.model(), quantity_of(pressed)
    with pytest.raises(ValueError, match="one case"):
        rows = [pressed.case.known_displacements] * 2
        server.solve_several(model, pressed.case, rows, quantity=quantity)
    with pytest.raises(ValueError, match="neither"):
        Quantity()
    with pytest.raises(ValueError, match="slopes"):
        Quantity(slopes=[1.0, 2.0])
    with pytest.raises(ValueError, match="reactions"):
        server.solve(model, pressed.case, quantity=Quantity(of_reactions=np.ones(999)))
    with pytest.raises(softgrasp.BadRequest, match="factor"):
        masked = pressed.case.mask(pressed.side, (0.0, 0.0, 0.0))
        server.solve(model, masked, quantity=quantity)
    with pytest.raises(softgrasp.BadRequest, match="node 9999"):
        far = np.zeros((10001, 3))
        far[9999] = 1.0
        server.solve(model, pressed.case, quantity=Quantity(far))
    with pytest.raises(softgrasp.BadRequest, match="yield stress"):
        flowing = LargeDeformation(yield_stress=1e3)
        server.solve_large(model, pressed.case, flowing, quantity=quantity)
    with pytest.raises(Uncertain, match="not converged"):
        server.solve_large(model, pressed.case, max_error=0.1, quantity=quantity)
