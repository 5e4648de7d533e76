"""Answers of the real server against closed forms and against each other."""

import time

import numpy as np
import pytest
from conftest import Bar

import softgrasp
from softgrasp import LargeDeformation, LoadCase, Material, Mesh, Model, Server, WarningCode, calls
from softgrasp.session import NamedModel


def test_uniform_strain_of_a_pulled_bar_is_exact(server: Server, bar: Bar) -> None:
    answer = server.solve(bar.model, bar.case)
    assert answer.nodes is None
    assert answer.displacements.shape == (bar.mesh.node_count, 3)
    assert np.abs(answer.displacements - bar.exact).max() < 1e-12
    assert answer.reactions.total(bar.right)[0] == pytest.approx(bar.force, rel=1e-9)
    assert np.abs(answer.reactions.total()).max() < 1e-9
    assert answer.residual_rel < 1e-12
    assert answer.error_bound_rel is None and answer.error_bound_why
    assert answer.report.method == "front" and answer.report.element == "t4"


@pytest.mark.parametrize(
    "method", ["front", "front-mixed", "pcg", "multigrid", "sparse-cholesky", "gauss-jordan"]
)
def test_methods_agree(server: Server, bar: Bar, method: str) -> None:
    answer = server.solve(bar.model, bar.case, method=method)
    assert answer.report.method == method
    assert np.abs(answer.displacements - bar.exact).max() < 1e-9


@pytest.mark.parametrize("element", ["t4", "t4-anp", "auto", None])
def test_elements_represent_a_uniform_strain(server: Server, bar: Bar, element) -> None:
    model = Model(bar.mesh, bar.model.material, element)
    answer = server.solve(model, bar.case)
    assert np.abs(answer.displacements - bar.exact).max() < 1e-9


def test_quadratic_elements_are_held_at_their_corners_only(server: Server, bar: Bar) -> None:
    answer = server.solve(Model(bar.mesh, bar.model.material, "t10"), bar.case)
    assert answer.report.element == "t10"
    assert 0.5 * bar.force < answer.reactions.total(bar.right)[0] < bar.force


def test_linear_elements_that_do_not_lock_are_taken_where_none_is_named(
    server: Server, bar: Bar
) -> None:
    for ratio, element in ((0.44, "t4"), (0.45, "t4-anp")):
        model = Model(bar.mesh, Material(bar.YOUNG, ratio))
        assert server.solve(model, bar.case).report.element == element
        assert server.keep(model).frame(bar.case).report.element == element


def test_arrays_are_views_that_cannot_be_written_to(server: Server, bar: Bar) -> None:
    answer = server.solve(bar.model, bar.case)
    assert not answer.displacements.flags.owndata
    with pytest.raises(ValueError, match="read-only"):
        answer.displacements[0, 0] = 1.0


def test_frame_agrees_with_solve(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model)
    once, frame = server.solve(bar.model, bar.case), kept.frame(bar.case)
    assert np.abs(frame.displacements - once.displacements).max() < 1e-12
    assert np.array_equal(frame.reactions.dofs, once.reactions.dofs)
    assert np.abs(frame.reactions.forces - once.reactions.forces).max() < 1e-9
    assert frame.report.method == "condensed"


def test_fixed_nodes_need_not_be_named(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model, fixed=bar.left)
    pulled = LoadCase().prescribe(bar.right, (bar.PULL, 0.0, 0.0))
    named = pulled.prescribe(bar.left, (0.0, 0.0, 0.0))
    frame, once = kept.frame(pulled), server.solve(bar.model, named)
    assert np.abs(frame.displacements - once.displacements).max() < 1e-12
    assert frame.reactions.total(bar.left)[0] == pytest.approx(-frame.reactions.total(bar.right)[0])


def test_bound_is_proven_in_the_background_and_holds(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model, fixed=bar.left)
    pulled = LoadCase().prescribe(bar.right, (bar.PULL, 0.0, 0.0))
    exact = server.solve(bar.model, pulled.prescribe(bar.left, (0.0, 0.0, 0.0))).displacements
    until = time.monotonic() + 30.0
    answer = kept.frame(pulled)
    while answer.error_bound_rel is None and time.monotonic() < until:
        assert answer.error_bound_why
        answer = kept.frame(pulled)
    assert answer.error_bound_rel is not None and answer.error_bound_why == ""
    error = np.linalg.norm(answer.displacements - exact) / np.linalg.norm(exact)
    assert error <= answer.error_bound_rel + 1e-13


def test_listed_nodes_come_in_the_order_of_the_question(server: Server, bar: Bar) -> None:
    wanted = [int(bar.right[0]), 0, int(bar.right[0])]
    answer = server.keep(bar.model).frame(bar.case, nodes=wanted, reactions=False)
    assert answer.nodes is not None and answer.nodes.tolist() == wanted
    assert np.abs(answer.displacements - bar.exact[wanted]).max() < 1e-12
    assert len(answer.reactions.dofs) == 0
    assert answer.on_mesh(bar.mesh.node_count)[bar.right[0], 0] == pytest.approx(bar.PULL)


def test_single_precision_is_off_by_its_promise(server: Server, bar: Bar) -> None:
    answer = server.keep(bar.model).frame(bar.case, precision="f32")
    largest = np.abs(bar.exact).max()
    error = np.abs(answer.displacements - bar.exact).max()
    assert 0.0 < error <= largest * 2.0**-24 * 1.001


def test_forces_and_prescribed_displacements_are_two_sides_of_one_answer(
    server: Server, bar: Bar
) -> None:
    pulled = server.solve(bar.model, bar.case)
    forces = pulled.reactions.at(bar.right)
    answer = server.solve(bar.model, bar.held.force(bar.right, forces))
    assert np.abs(answer.displacements - pulled.displacements).max() < 1e-12


def test_several_cases_are_those_solved_one_by_one(server: Server, bar: Bar) -> None:
    factors = (1.0, -2.0, 0.5)
    sets = [factor * bar.case.known_displacements for factor in factors]
    several = server.solve_several(bar.model, bar.case, sets)
    assert len(several.cases) == 3
    for factor, case in zip(factors, several.cases, strict=True):
        assert np.abs(case.displacements - factor * bar.exact).max() < 1e-12
        assert case.reactions.total(bar.right)[0] == pytest.approx(factor * bar.force)
    fast = server.solve_several(bar.model, bar.case, sets[:1], estimate=False)
    assert np.isnan(fast.report.max_strain) and len(fast.cases) == 1


def test_several_cases_of_a_kept_model_are_its_frames(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model)
    factors = (1.0, -2.0, 0.5)
    sets = [factor * bar.case.known_displacements for factor in factors]
    several = kept.solve_several(bar.case, sets)
    for factor, case in zip(factors, several.cases, strict=True):
        frame = kept.frame(bar.case.scaled(factor))
        assert np.array_equal(case.displacements, frame.displacements)
        assert np.array_equal(case.reactions.forces, frame.reactions.forces)
    wanted = kept.solve_several(bar.case, sets, nodes=bar.right, reactions=False, precision="f32")
    assert wanted.nodes is not None and wanted.cases[2].displacements.shape == (len(bar.right), 3)
    with pytest.raises(ValueError, match="no set"):
        kept.solve_several(bar.case, np.zeros((0, len(bar.case.known_dofs))))


def test_report_tells_as_much_as_was_asked_for(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model)
    bent = bar.held.prescribe(bar.right, (None, 0.01, None))
    full = kept.frame(bent)
    short, none = kept.frame(bent, report="short"), kept.frame(bent, report="none")
    for answer in (short, none):
        assert np.array_equal(answer.displacements, full.displacements)
        assert (answer.report.method, answer.report.warnings) == ("", ())
    assert short.report.is_told and short.residual_rel == full.residual_rel
    assert short.report.unknown_dofs == full.report.unknown_dofs
    assert not none.report.is_told and np.isnan(none.residual_rel)
    law = LargeDeformation()
    assert kept.large_frame(bar.case, law, report="none").large.settled


def test_regions_have_their_materials(server: Server, bar: Bar) -> None:
    middle = bar.mesh.points[bar.mesh.tets].mean(axis=1)[:, 0]
    labels = np.where(middle < 0.02, 7, 3)
    mesh = Mesh(bar.mesh.points, bar.mesh.tets, labels)
    # Without sideways contraction the two halves are springs in a row.
    materials = {7: Material(20_000.0, 0.0), 3: Material(60_000.0, 0.0)}
    model = Model(mesh, materials, "t4")
    answer = server.solve(model, bar.case)
    area = bar.LENGTHS[1] * bar.LENGTHS[2]
    force = bar.PULL * area / (0.02 / 20_000.0 + 0.02 / 60_000.0)
    assert answer.reactions.total(bar.right)[0] == pytest.approx(force, rel=1e-9)
    kept = server.keep(model).frame(bar.case)
    assert np.abs(kept.displacements - answer.displacements).max() < 1e-12


def test_masks_hold_the_mean_of_their_nodes(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model, fixed=bar.left)
    weights = np.linspace(1.0, 2.0, len(bar.right))
    case = LoadCase().mask(bar.right, (bar.PULL, 0.0, -0.0005), weights)
    kept.prefetch(masks=case.masks)
    answer = kept.frame(case)
    mean = weights @ answer.displacements[bar.right] / weights.sum()
    assert np.abs(mean - [bar.PULL, 0.0, -0.0005]).max() < 1e-12
    assert answer.mask_forces.shape == (1, 3)
    # What the mask does to the body, the fixed end takes.
    assert np.abs(answer.reactions.total(bar.left) + answer.mask_forces[0]).max() < 1e-9
    spread = weights[:, None] / weights.sum() * answer.mask_forces[0]
    forced = LoadCase().prescribe(bar.left, (0.0, 0.0, 0.0)).force(bar.right, spread)
    once = server.solve(bar.model, forced)
    assert np.abs(once.displacements - answer.displacements).max() < 1e-11


def test_large_deformation_of_a_bar_is_that_of_the_law(server: Server, bar: Bar) -> None:
    # Stretched by a half: with ν = 0 nothing becomes thinner, and the closed form is short.
    model = Model(bar.mesh, Material(bar.YOUNG, 0.0), "t4")
    stretch = 1.5
    pulled = bar.held.prescribe(bar.right, ((stretch - 1.0) * bar.LENGTHS[0], None, None))
    law = LargeDeformation(law="neo-hookean-log")
    answer = server.solve_large(model, pulled, law)
    assert answer.large.deformation == "large" and answer.large.settled
    # μ = E/2, λ = 0: W = μ/2 (tr FᵀF − 3) − μ ln J, so the nominal stress is μ (s − 1/s).
    force = bar.YOUNG / 2.0 * (stretch - 1.0 / stretch) * bar.LENGTHS[1] * bar.LENGTHS[2]
    assert answer.reactions.total(bar.right)[0] == pytest.approx(force, rel=1e-7)
    assert answer.large.max_stretch == pytest.approx(stretch, rel=1e-7)
    assert answer.error_bound_rel is None and answer.error_bound_why


def test_large_frames_go_on_to_the_same_shape_as_one_request(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model)
    pulled = bar.held.prescribe(bar.right, (0.012, None, None))
    for part in (0.3, 0.6, 1.0):
        frame = kept.large_frame(pulled.scaled(part))
    once = server.solve_large(bar.model, pulled)
    assert np.abs(frame.displacements - once.displacements).max() < 1e-8
    anew = kept.large_frame(pulled, LargeDeformation(path="from-rest"))
    assert np.abs(anew.displacements - once.displacements).max() < 1e-8
    small = kept.large_frame(
        pulled.scaled(1e-5), LargeDeformation("auto", path="from-rest"), max_error=1e-3
    )
    assert small.large.deformation == "linear"


def test_yield_stays(server: Server, bar: Bar) -> None:
    kept = server.keep(bar.model)
    law = LargeDeformation(yield_stress=500.0)
    case = bar.held.prescribe(bar.right, (0.008, None, None))
    assert kept.large_frame(case, law).large.plastic_strain > 0.05
    kept.drop()
    server.ping()


def test_wishes_that_are_missed_are_warned_of(server: Server, bar: Bar) -> None:
    answer = server.solve(bar.model, bar.case, deadline_ms=1e-6)
    late = [each for each in answer.report.warnings if each.code == WarningCode.LATE]
    assert len(late) == 1 and "ms" in late[0]


def test_welcome_tells_the_limits(server: Server) -> None:
    assert server.welcome.server == "fea-server"
    assert server.welcome.threads == 2
    assert server.welcome.limits == softgrasp.Limits()
    assert server.welcome.wire == 4 and server.welcome.idle is None
    assert server.capabilities >= {"large", "cases", "contact", "cancel", "newest-wins"}


def test_drop_leaves_the_models_of_others(program: softgrasp.ServerProgram, bar: Bar) -> None:
    model = Model(bar.mesh, Material(12_345.0, 0.3), "t4")
    with Server(program.address, timeout=60.0) as holder:
        kept = holder.keep(model)
        with Server(program.address, timeout=60.0) as other:
            other._tell(calls.drop(kept.hash))
            other.ping()
        assert holder._ask(calls.have_model(kept.hash))


def test_question_of_the_frame_before_is_asked_again_only_where_every_option_is_the_same() -> None:
    """Options in another order are told apart by name."""
    mesh = Mesh.block((0.02,) * 3, (1, 1, 1))
    kept = NamedModel(Model(mesh, Material(20_000.0, 0.3)), ())
    one, other = 1e-3, 2.0
    first = kept._question({"max_error": one, "deadline_ms": other})
    assert kept._question({"deadline_ms": other, "max_error": one}) is first
    swapped = kept._question({"deadline_ms": one, "max_error": other})
    assert (swapped.deadline_ms, swapped.max_error) == (one, other)
    assert kept._question({"max_error": other}).deadline_ms is None
    nodes = np.array([1, 2], dtype=np.int64)
    assert kept._question({"nodes": nodes}) is not kept._question({"nodes": nodes})
