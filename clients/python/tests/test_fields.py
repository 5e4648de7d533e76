"""Fields: stress, strain and energy by closed forms, of nodes and elements, linear and large."""

import numpy as np
import pytest
from conftest import Bar

from softgrasp import (
    Body,
    ContactStep,
    LargeDeformation,
    Material,
    Mesh,
    Model,
    ObjectState,
    Plane,
    Question,
    Server,
    matrices,
)
from softgrasp.field_values import field_bits

STRAIN = Bar.PULL / Bar.LENGTHS[0]


def test_pulled_bar_has_the_stress_of_hookes_law(server: Server) -> None:
    bar = Bar()
    answer = server.solve(bar.model, bar.case, fields="all")
    fields = answer.fields
    assert fields is not None and len(fields.stress) == bar.mesh.node_count
    pull = Bar.YOUNG * STRAIN
    expected = np.array([pull, 0, 0, 0, 0, 0])
    assert fields.stress == pytest.approx(np.tile(expected, (len(fields.stress), 1)), abs=1e-6)
    assert fields.elements.stress is not None and len(fields.elements.stress) == len(bar.mesh.tets)
    assert fields.elements.von_mises == pytest.approx(np.full(len(bar.mesh.tets), pull))
    assert fields.strain[:, 0] == pytest.approx(np.full(len(fields.strain), STRAIN))
    assert fields.strain[:, 1] == pytest.approx(np.full(len(fields.strain), -0.3 * STRAIN))
    # Half the work of the forces that hold the ends.
    work = 0.5 * float(answer.reactions.forces @ _displacements(answer))
    assert fields.energy == pytest.approx(work, rel=1e-9)
    assert fields.elements.energy is not None
    assert fields.elements.energy.sum() == pytest.approx(fields.energy)
    assert fields.stress_error_rel is not None and fields.stress_error_rel < 1e-9
    turned = matrices(fields.stress)
    assert turned.shape == (bar.mesh.node_count, 3, 3) and turned[0, 0, 0] == fields.stress[0, 0]


def _displacements(answer) -> np.ndarray:
    return answer.displacements.reshape(-1)[answer.reactions.dofs]


def test_what_was_not_asked_for_is_not_there(server: Server) -> None:
    bar = Bar()
    assert server.solve(bar.model, bar.case).fields is None
    some = server.solve(bar.model, bar.case, fields=["nodes.stress", "elements.energy"]).fields
    assert some is not None and some.nodes.stress is not None and some.elements.energy is not None
    assert some.elements.stress is None and some.nodes.energy is None
    assert some.stress_error_rel is None
    with pytest.raises(ValueError, match="von_mises of nodes was not asked for"):
        _ = some.von_mises


def test_names_of_fields_are_checked() -> None:
    with pytest.raises(ValueError, match="no field 'stres'"):
        Question(fields="stres")
    with pytest.raises(ValueError, match="contact frames have pressure and force too"):
        Question(fields=["pressure"])
    with pytest.raises(ValueError, match=r"no field 'elements\.pressure'"):
        field_bits("elements.pressure", with_contact=True)
    assert field_bits("all") == (1 << 10) - 1
    assert field_bits("all", with_contact=True) == (1 << 12) - 1
    assert Question(fields="stress").fields == ("stress",)


def test_frames_have_the_fields_of_the_wanted_nodes(server: Server) -> None:
    bar = Bar()
    kept = server.keep(bar.model)
    nodes = [5, 2, 5]
    for _ in range(3):
        some = kept.frame(bar.case, nodes=nodes, fields="stress").fields
        assert some is not None and some.stress.shape == (3, 6)
    whole = kept.frame(bar.case, fields="stress").fields
    once = server.solve(bar.model, bar.case, fields="stress").fields
    assert whole is not None and once is not None
    assert some.stress.tolist() == whole.stress[nodes].tolist()
    assert whole.stress == pytest.approx(once.stress, rel=1e-8, abs=1e-6)


def test_several_cases_have_fields_each(server: Server) -> None:
    bar = Bar()
    sets = np.array([1.0, -2.0, 0.0])[:, None] * bar.case.known_displacements
    for subject in (server, server.keep(bar.model)):
        model = (bar.model,) if subject is server else ()
        several = subject.solve_several(*model, bar.case, sets, fields=["stress", "energy"])
        first, second, third = (case.fields for case in several.cases)
        assert first is not None and second is not None and third is not None
        assert second.stress == pytest.approx(-2.0 * first.stress, rel=1e-6, abs=1e-6)
        assert second.energy == pytest.approx(4.0 * first.energy)
        assert third.energy == pytest.approx(0.0, abs=1e-12 * first.energy)


@pytest.mark.parametrize("element", ["t4", "t4-anp"])
def test_large_deformation_has_cauchys_stress(server: Server, element: str) -> None:
    bar = Bar()
    model = Model(bar.mesh, Material(Bar.YOUNG, Bar.POISSON), element)
    answer = server.solve_large(
        model, bar.case, LargeDeformation("large", "neo-hookean"), fields=["stress", "energy"]
    )
    fields = answer.fields
    assert fields is not None
    # One axis is pulled and the others are free: of the six numbers one is left, and it carries the
    # force over the area that is left of the end.
    thickness = 1.0 + answer.displacements[bar.mesh.nodes_at(x=0.04), 1].min() / 0.02
    area = (0.02 * thickness) ** 2
    force = answer.reactions.total(bar.mesh.nodes_at(x=0.04))[0]
    stress = fields.stress
    assert stress[:, 0] == pytest.approx(np.full(len(stress), force / area), rel=2e-4)
    assert np.abs(stress[:, 1:]).max() < 1e-5 * stress[:, 0].max()


def test_block_on_a_table_is_pressed_by_its_weight(server: Server) -> None:
    mesh = Mesh.block((0.04, 0.03, 0.02), (4, 3, 2))
    kept = server.keep(Model(mesh, Material(50_000.0, 0.3), "t4"))
    table, state = Body(Plane((0.0, 0.0, 1.0)), friction=0.6), ObjectState()
    for _ in range(25):
        answer = kept.contact_frame(state, [table], ContactStep(0.01, 1000.0), fields="all")
        state = answer.state
    fields, weight = answer.fields, 1000.0 * mesh.volume * 9.81
    assert fields is not None
    assert fields.force.sum(axis=0)[2] == pytest.approx(weight, rel=1e-6)
    pressed = np.flatnonzero(fields.pressure)
    assert set(pressed) <= set(mesh.nodes_at(z=0.0).tolist()) and len(pressed) > 3
    assert fields.pressure.min() >= 0.0
    # The mean over the bottom; single nodes at its rim have a share of the sides too.
    assert weight / (0.04 * 0.03) == pytest.approx(196.2, abs=0.1)
    assert 0.2 * 196.2 < fields.pressure[pressed].mean() < 1.5 * 196.2
    assert fields.elements.stress is not None
    assert fields.elements.stress[:, 2].mean() == pytest.approx(-0.5 * 196.2, rel=0.05)
