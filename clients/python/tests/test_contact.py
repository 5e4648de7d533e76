"""Contact frames: an object lies, is pressed, slides and falls by the laws of mechanics."""

import numpy as np
import pytest
from conftest import Bar, Spawn, Without

from softgrasp import (
    Body,
    Box,
    Capsule,
    ClosedSurface,
    ContactStep,
    KeptModel,
    Material,
    Mesh,
    Model,
    NotCapable,
    ObjectState,
    Plane,
    Pose,
    Refused,
    Server,
    Sphere,
    candidate_triangles,
)
from softgrasp.large import Deformation

DENSITY, G = 1000.0, 9.81


@pytest.fixture
def block(server: Server) -> KeptModel:
    mesh = Mesh.block((0.04, 0.03, 0.02), (4, 3, 2))
    return server.keep(Model(mesh, Material(50_000.0, 0.3), "t4"))


def table(mu: float = 0.6) -> Body:
    return Body(Plane((0.0, 0.0, 1.0)), friction=mu)


def test_object_on_a_plane_carries_its_weight(block: KeptModel) -> None:
    mesh, state = block.model.mesh, ObjectState()
    for _ in range(25):
        answer = block.contact_frame(state, [table()], ContactStep(0.01, DENSITY))
        state = answer.state
    weight = DENSITY * mesh.volume * G
    assert answer.contact.is_converged
    assert answer.loads.forces[0] == pytest.approx([0.0, 0.0, weight], rel=1e-6, abs=1e-6 * weight)
    assert answer.loads.normal_forces[0] == pytest.approx(weight, rel=1e-6)
    assert answer.loads.contacts[0] == len(answer.points.bodies) > 3
    assert answer.points.forces.sum(axis=0) == pytest.approx(answer.loads.forces[0])
    assert answer.contact.penetration_max < 1e-7 * 0.06
    assert np.linalg.norm(state.velocity) < 1e-6
    assert state.places(mesh)[:, 2].min() > -1e-7
    # It is pressed together under its own weight: the top comes down.
    assert state.places(mesh)[mesh.nodes_at(z=0.02), 2].mean() < 0.02


def test_free_fall_is_that_of_a_point(block: KeptModel) -> None:
    state = ObjectState(Pose((0.0, 0.0, 1.0)))
    for _ in range(5):
        answer = block.contact_frame(state, [table()], ContactStep(0.01, DENSITY))
        state = answer.state
    assert state.velocity == pytest.approx([0.0, 0.0, -G * 0.05], rel=1e-9)
    assert len(answer.points.bodies) == 0 and len(answer.loads.contacts) == 1
    assert np.abs(answer.displacements).max() < 1e-9


def test_finger_presses_and_the_table_takes_weight_and_finger(block: KeptModel) -> None:
    mesh, state = block.model.mesh, ObjectState()
    top, step = 0.02, 0.01
    for tick in range(20):
        heights = [top + 0.008 + 0.0005 - 0.0002 * (tick + k) for k in (0, 1)]
        start, end = (Pose((0.02, 0.015, height)) for height in heights)
        finger = Body(Sphere(0.008), start, end, friction=0.8)
        answer = block.contact_frame(
            state, [table(), finger], ContactStep(step, DENSITY), nodes=mesh.boundary_nodes
        )
        state = answer.state
    up, down = answer.loads.forces[:, 2]
    weight = DENSITY * mesh.volume * G
    assert down < -0.1
    assert up == pytest.approx(weight - down, rel=2e-2)
    assert answer.contact.penetration_max < 1e-5
    assert answer.nodes is not None and len(answer.nodes) == len(mesh.boundary_nodes)


def test_little_friction_lets_a_tilted_table_keep_nothing(block: KeptModel) -> None:
    # On a slope of 30° an object slides where μ < tan 30°, with g (sin − μ cos).
    angle, mu, steps, seconds = np.pi / 6, 0.2, 20, 0.005
    slope = Body(Plane((np.sin(angle), 0.0, np.cos(angle))), friction=mu)
    state = ObjectState(Pose.about((0.0, 1.0, 0.0), angle))
    for _ in range(steps):
        state = block.contact_frame(state, [slope], ContactStep(seconds, DENSITY)).state
    speed = G * (np.sin(angle) - mu * np.cos(angle)) * steps * seconds
    assert np.linalg.norm(state.velocity) == pytest.approx(speed, rel=0.05)
    rough = Body(Plane((np.sin(angle), 0.0, np.cos(angle))), friction=0.9)
    state = ObjectState(Pose.about((0.0, 1.0, 0.0), angle))
    for _ in range(steps):
        state = block.contact_frame(state, [rough], ContactStep(seconds, DENSITY)).state
    assert np.linalg.norm(state.velocity) < 0.05 * speed


@pytest.mark.parametrize("what", ["box", "rounded box", "capsule", "surface", "rounded surface"])
def test_all_shapes_carry(block: KeptModel, what: str) -> None:
    box = Mesh.block((0.2, 0.2, 0.02), (1, 1, 1))
    shapes = {
        "box": (Box((0.1, 0.1, 0.01)), Pose((0.02, 0.015, -0.01))),
        "rounded box": (Box((0.1, 0.1, 0.01), 0.01), Pose((0.02, 0.015, -0.01))),
        "capsule": (
            Capsule(1.0, 0.5),
            Pose.about((1.0, 0.0, 0.0), np.pi / 2, (0.02, 0.015, -1.0)),
        ),
        "surface": (ClosedSurface(box.points, box.boundary), Pose((-0.08, -0.085, -0.02))),
        "rounded surface": (
            ClosedSurface(box.points, box.boundary, 0.005),
            Pose((-0.08, -0.085, -0.025)),
        ),
    }
    shape, pose = shapes[what]
    state = ObjectState()
    for _ in range(20):
        answer = block.contact_frame(state, [Body(shape, pose)], ContactStep(0.01, DENSITY))
        state = answer.state
    weight = DENSITY * block.model.mesh.volume * G
    assert answer.loads.forces[0, 2] == pytest.approx(weight, rel=0.02)


def test_an_older_server_is_not_sent_rounded_bodies(block: KeptModel, without: Without) -> None:
    without("rounded-bodies")
    step, half = ContactStep(0.01, DENSITY), (0.1, 0.1, 0.01)
    block.contact_frame(ObjectState(), [Body(Box(half))], step)
    with pytest.raises(NotCapable, match="rounded-bodies"):
        block.contact_frame(ObjectState(), [Body(Box(half, 0.001))], step)


def test_a_step_ends_at_its_deadline_and_says_so(block: KeptModel, without: Without) -> None:
    start, end = (Pose((0.02, 0.015, height)) for height in (0.0285, 0.025))
    finger = Body(Sphere(0.008), start, end, friction=0.8)
    bodies = [table(), finger]
    whole = block.contact_frame(ObjectState(), bodies, ContactStep(0.01, DENSITY)).contact
    assert whole.is_converged and not whole.is_late
    step = ContactStep(0.01, DENSITY, deadline_ms=1e-6)
    late = block.contact_frame(ObjectState(), bodies, step).contact
    assert late.is_late and not late.is_converged and late.rounds < whole.rounds
    in_time = ContactStep(0.01, DENSITY, deadline_ms=1e6)
    assert not block.contact_frame(ObjectState(), bodies, in_time).contact.is_late
    without("contact-deadline")
    block.contact_frame(ObjectState(), bodies, ContactStep(0.01, DENSITY))
    with pytest.raises(NotCapable, match="contact-deadline"):
        block.contact_frame(ObjectState(), bodies, step)


def test_a_deadline_is_a_positive_time() -> None:
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="the deadline"):
            ContactStep(0.01, deadline_ms=wrong)


def test_candidates_are_near(bar: Bar) -> None:
    state, step = ObjectState(), ContactStep(0.001)
    far = Body(Sphere(0.001), Pose((1.0, 0.0, 0.0)))
    triangles, bodies = candidate_triangles(bar.mesh, state, [far, table()], step)
    assert set(bodies) == {1}
    bottom = set(bar.mesh.nodes_at(z=0.0).tolist())
    assert all(bottom & set(triangle) for triangle in triangles.tolist())
    under = [set(t) <= bottom for t in bar.mesh.boundary.tolist()]
    assert sum(under) == sum(set(t) <= bottom for t in triangles.tolist())


def test_another_server_goes_on_with_the_state_that_one_has_given(
    block: KeptModel, spawn: Spawn
) -> None:
    step, bodies = ContactStep(0.01, DENSITY), [table()]
    state = ObjectState(Pose.about((1.0, 2.0, 0.0), 0.3, (0.0, 0.0, 0.03)))
    for _ in range(8):
        state = block.contact_frame(state, bodies, step).state
    with Server(spawn().address, timeout=60.0) as other:
        elsewhere = other.keep(block.model)
        for _ in range(4):
            here = block.contact_frame(state, bodies, step)
            there = elsewhere.contact_frame(state, bodies, step)
            assert np.array_equal(here.displacements, there.displacements)
            assert np.array_equal(here.state.pose.numbers, there.state.pose.numbers)
            assert np.array_equal(here.loads.forces, there.loads.forces)
            state = here.state
    assert here.loads.contacts[0] > 0


def test_model_with_fixed_nodes_is_no_free_object(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model, fixed=bar.left)
    with pytest.raises(Refused):
        kept.contact_frame(ObjectState(), [table()], ContactStep(0.01))


def test_soft_block_at_large_deformation_carries_its_weight_and_is_pressed_more(
    server: Server,
) -> None:
    mesh = Mesh.block((0.04, 0.03, 0.02), (4, 3, 2))
    soft = server.keep(Model(mesh, Material(1_000.0, 0.3), "t4"))
    heights = {}
    deformations: tuple[Deformation | None, ...] = (None, "large", "auto")
    for deformation in deformations:
        state = ObjectState()
        step = ContactStep(0.01, DENSITY, viscosity=0.02, deformation=deformation)
        for _ in range(40):
            answer = soft.contact_frame(state, [table()], step)
            state = answer.state
        weight = DENSITY * mesh.volume * G
        assert answer.contact.is_converged
        assert answer.loads.normal_forces[0] == pytest.approx(weight, rel=1e-6)
        assert answer.contact.deformation == ("linear" if deformation is None else "large")
        heights[deformation] = state.places(mesh)[mesh.nodes_at(z=0.02), 2].mean()
    assert heights["large"] == pytest.approx(heights["auto"], abs=1e-5)
    assert heights["large"] != pytest.approx(heights[None], abs=3e-5)


def test_words_that_no_step_knows_are_refused() -> None:
    with pytest.raises(ValueError, match="deformation"):
        ContactStep(0.01, deformation="huge")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="law"):
        ContactStep(0.01, law="rubber")  # type: ignore[arg-type]
