"""Every message is encoded as its recorded bytes, and decoded from them."""

import math

import numpy as np
import pytest
from golden import golden, golden_reader, header_of

import softgrasp.contact
from softgrasp import (
    Body,
    Box,
    Capsule,
    ClosedSurface,
    ContactStep,
    LargeDeformation,
    Limits,
    LoadCase,
    Mask,
    Material,
    Mesh,
    Model,
    ObjectState,
    Plane,
    Pose,
    Quantity,
    Question,
    RigidMotionFree,
    Sphere,
    WarningCode,
    calls,
)
from softgrasp.answer import Asked, read_answer, read_large_answer, read_several_answers
from softgrasp.contact import read_contact_answer
from softgrasp.conversation import Conversation
from softgrasp.framing import HEADER_LEN, Kind, encode_frame

REQUESTS = ["Hello", "Ask", "Ask-model", "Ask-large", "Ask-cases", "HaveModel", "UploadModel"]
REQUESTS += [
    "Ask-gradient",
    "UploadModel-mid-edge",
    "Ask-fields",
    "Ask-loads",
    "Cancel",
    "Prefetch",
    "Drop",
    "Ping",
    "ContactFrame",
    "ContactFrame-rounded",
]
NAME = bytes(0xA0 ^ k for k in range(32))
POINTS = [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01], [0, 0, 0]]
MATERIAL = Material(20_000.0, 0.45)
HELD = LoadCase([9, 2], [0.0, -0.001], [4], [0.5])
MASKED = HELD.mask([0, 2], (0, -0.001, 0), [0.25, 0.75]).mask([1], (0.0005, 0, 0))
LARGE = LargeDeformation("auto", "neo-hookean-log", 1500.0, "from-rest", "timely")


def loaded() -> LoadCase:
    case = MASKED.weight(1000.0, (0.0, -9.81, 0.5)).pressure([[0, 1, 2], [3, 1, 0]], 250.0)
    return case.pressure([[2, 3, 1]], -40.0)


def labelled() -> Model:
    return Model(Mesh(POINTS, [[0, 1, 2, 3]], [7]), {7: MATERIAL}, "t4")


def curved() -> Model:
    points = [[node, 0.5 * node * node, -1.0] for node in range(14)]
    mid_edge = [[5, 6, 7, 8, 9, 10], [6, 10, 9, 11, 12, 13]]
    mesh = Mesh(points, [[0, 1, 2, 3], [1, 2, 3, 4]], [7, 2], mid_edge)
    return Model(mesh, {7: MATERIAL, 2: MATERIAL}, "t10")


def contact_frame(of_mesh: float = 0.0, of_box: float = 0.0) -> calls.Call:
    surface = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2]]
    closed = ClosedSurface(surface[0], [*surface[1], [1, 2, 3]], of_mesh)
    shapes = [Plane((0, 0, 1)), Capsule(0.008, 0.03), closed, Sphere(0.5)]
    shapes.append(Box((0.5, 0.25, 0.125), of_box))
    bodies = [Body(shape, friction=0.5) for shape in shapes]
    state = ObjectState(
        Pose((0.5, 0.25, -0.125)),
        np.array([0, 0, -0.5]),
        np.array([0.25, 0, 0]),
        np.array([2], np.uint32),
        np.array([[0, 0.5, 1.0]]),
        np.array([[1, 0, 2, 3]], np.uint32),
        np.array([[0.5, 0.25, 0.25, 0, 0, 1.5]]),
    )
    step = ContactStep(
        0.01,
        1000.0,
        viscosity=0.005,
        penetration_rel=1e-6,
        rounds_max=16,
        newton_max=400,
        deformation="auto",
        law="neo-hookean-log",
        yield_stress=750.0,
        from_rest=True,
    )
    mesh = Mesh(POINTS, [[0, 1, 2, 3]])
    return calls.contact_frame(NAME, Model(mesh, MATERIAL), state, bodies, step, [0, 3], "f64")


def requests() -> dict[str, calls.Call]:
    once = Question(method="gauss-jordan", reactions=False, deadline_ms=16.5)
    frame = Question(nodes=[0, 2, 3], precision="f32", max_error=0.01)
    newest = Question(
        nodes=[0, 2, 3], precision="f32", max_error=0.01, report="short", newest_wins=True
    )
    with_fields = Question(
        nodes=[0, 2, 3],
        precision="f32",
        max_error=0.01,
        fields=["elements.stress", "nodes.von_mises", "elements.energy"],
    )
    slopes, curvatures = np.zeros((4, 3)), np.zeros((4, 3))
    slopes[1, 1], slopes[3, 1], curvatures[3, 1] = 1.5, -2.0, 300.0
    of_reactions, bent = [0.0, 0.25], [0.0, -1.0]
    quantity = Quantity(slopes, curvatures, of_reactions, bent, points=True)
    of_quantity = Question(nodes=[0, 2, 3], precision="f32", max_error=0.01, quantity=quantity)
    plain = Model(Mesh(POINTS, [[0, 1, 2, 3]]), MATERIAL, "t10")
    cases = [[0.0, -0.001], [0.0, -0.002], [-0.0, 0.001]]
    return {
        "Hello": calls.hello("sample 1", "secret", 2.0, ["haptics"]),
        "Ask": calls.solve(labelled(), HELD, once),
        "Ask-model": calls.frame(NAME, MASKED, newest),
        "Ask-large": calls.large_frame(NAME, HELD, LARGE, frame),
        "Ask-fields": calls.frame(NAME, MASKED, with_fields),
        "Ask-loads": calls.frame(NAME, loaded(), frame),
        "Ask-gradient": calls.frame(NAME, MASKED, of_quantity),
        "Ask-cases": calls.solve_several(labelled(), HELD, cases, False, once),
        "HaveModel": calls.have_model(NAME),
        "UploadModel": calls.upload_model(plain, plain.fixed_dofs([3])),
        "UploadModel-mid-edge": calls.upload_model(curved(), np.array([15], np.uint32)),
        "Cancel": calls.cancel(2),
        "Prefetch": calls.prefetch(NAME, [1, 3], [Mask([3, 1], [1.0, 2.0])]),
        "Drop": calls.drop(NAME),
        "Ping": calls.ping(0x0123456789ABCDEF),
        "ContactFrame": contact_frame(),
        "ContactFrame-rounded": contact_frame(0.25, 0.0625),
    }


@pytest.mark.parametrize("name", REQUESTS)
def test_requests_have_their_recorded_bytes(name: str, monkeypatch) -> None:
    near = np.array([[0, 2, 3], [1, 2, 0]], np.uint32), np.array([1, 0], np.uint32)
    monkeypatch.setattr(softgrasp.contact, "candidate_triangles", lambda *_: near)
    expected, call = golden(name), requests()[name]
    assert encode_frame(call.kind, header_of(expected).request_id, call.payload) == expected


def test_derivatives_are_read_in_the_order_of_their_load_case() -> None:
    case = LoadCase([9, 2], [0.0, -0.001])
    gradient = read_answer(golden_reader("Answer-gradient"), Asked(case, (3, 7))).gradient
    assert gradient is not None and gradient.value == 0.125
    assert gradient.known_displacements.tolist() == [-0.5, 8.0]
    assert gradient.forces[:, 0].tolist() == [0.5, 1.0, 1.5, 0.0]
    assert gradient.forces[:, 2].tolist() == [0.0, -0.5, -0.5, -0.5]
    assert gradient.young == {3: 1e-5, 7: -2e-6} and gradient.poisson == {3: 0.75, 7: 0.0}
    assert gradient.acceleration is not None and gradient.acceleration.tolist() == [0, 0.25, -1]
    assert gradient.pressures is not None and gradient.pressures.tolist() == [4e-4]
    assert gradient.points is not None and gradient.points[3].tolist() == [-12.0, 0.0, 3.0]


def test_answer_is_read() -> None:
    answer = read_answer(golden_reader("Answer"))
    assert answer.nodes is not None and answer.nodes.tolist() == [0, 2, 3]
    expected = [[0, -0.001, 0.0005], [0, 0, 0], [0.00025, 0, 0]]
    assert answer.displacements.tolist() == expected
    assert answer.reactions.dofs.tolist() == [2] and answer.reactions.forces.tolist() == [-1.25]
    assert answer.mask_forces.tolist() == [[0, -0.75, 0.125], [0.5, 0, 0]]
    report = answer.report
    assert report.is_told and (report.method, report.element) == ("sparse", "t4")
    assert report.warnings == ("large rotation", "")
    assert [warning.code for warning in report.warnings] == [WarningCode.ROTATION, 0]
    assert (report.warning_level, answer.error_bound_rel) == ("caution", 1e-12)
    assert (answer.error_bound_why, report.stage_ms.factor) == ("", 2.25)
    assert report.chosen_because == "smallest predicted time"
    assert answer.reactions.at([0, 5]).tolist() == [[0, 0, -1.25], [0, 0, 0]]


def test_answer_at_large_deformation_is_read() -> None:
    answer = read_large_answer(golden_reader("Answer-large"))
    assert answer.nodes is not None and answer.nodes.tolist() == [1]
    assert answer.displacements.tolist() == [[0, -0.005, 0.0005]]
    assert answer.error_bound_rel is None and answer.error_bound_why == "large deformation"
    large = answer.large
    assert (large.deformation, large.newton_steps, large.factor_age) == ("large", 2, 7)
    assert (large.min_jacobian, large.energy_error_rel, large.settled) == (0.75, 0.001, True)
    assert (large.max_stretch, large.plastic_strain) == (1.5, 0.125)
    with pytest.raises(softgrasp.BadStream, match="large deformation"):
        read_large_answer(golden_reader("Answer"))


def test_answers_of_several_cases_are_read() -> None:
    several = read_several_answers(golden_reader("Answer-cases"))
    first, further = several.cases
    assert first.displacements.tolist() == [[0.5, 0, 0]] * 3
    assert further.displacements.tolist() == [[1, -2, 0.25]] * 3
    assert further.reactions.dofs.tolist() == [2] and further.reactions.forces.tolist() == [4.5]


def test_fields_of_each_case_are_read() -> None:
    several = read_several_answers(golden_reader("Answer-fields"))
    first, further = (case.fields for case in several.cases)
    assert first is not None and further is not None
    assert (first.energy, further.energy, first.stress_error_rel) == (0.5, 2.0, None)
    assert first.elements.stress is not None and first.elements.stress.shape == (2, 6)
    assert first.elements.stress[1].tolist() == [1.75, 2.0, 2.25, 2.5, 2.75, 3.0]
    assert further.von_mises.tolist() == [-0.5, -1.0, -1.5]
    assert further.elements.energy is not None
    assert further.elements.energy.tolist() == [-0.5, -1.0]
    assert first.nodes.stress is None and first.elements.von_mises is None


def test_report_that_nobody_wanted_tells_nothing() -> None:
    answer = read_answer(golden_reader("Answer-untold"))
    assert not answer.report.is_told and math.isnan(answer.residual_rel)
    assert answer.error_bound_rel is None and answer.report.warnings == ()
    assert answer.displacements[0].tolist() == [0, -0.001, 0.0005]


def test_answer_of_a_contact_frame_is_read() -> None:
    answer = read_contact_answer(golden_reader("ContactAnswer"), 4)
    assert answer.contact.is_converged and answer.contact.columns_computed == 2
    assert answer.state.velocity.tolist() == [0, 0, -0.5]
    assert answer.state.contact_names.tolist() == [[1, 0, 2, 3]]
    assert answer.points.slips.tolist() == [True] and answer.points.forces[0, 2] == 1.0
    assert answer.loads.contacts.tolist() == [0, 1] and answer.loads.normal_forces[1] == 1.0
    assert answer.report.method == "newton" and answer.report.element == "t4-anp"


def test_greeting_is_read() -> None:
    welcome = calls.hello("a test", None).read(golden_reader("Welcome"))
    assert (welcome.server, welcome.version, welcome.threads) == ("sample server", "0.1.0", 4)
    assert (welcome.limits, welcome.wire, welcome.idle) == (Limits(), 4, 600.0)
    assert welcome.capabilities == {"cancel", "contact"}


def test_small_replies_are_read() -> None:
    assert calls.have_model(NAME).read(golden_reader("ModelState")) is True
    call = calls.upload_model(labelled(), np.zeros(0, np.uint32))
    ready = call.read(golden_reader("ModelReady"))
    assert (ready.model, ready.unknown_dofs, ready.fixed_dofs) == (NAME, 9, 3)
    assert ready.reused is False
    nonce = 0x0123456789ABCDEF
    assert calls.ping(nonce).read(golden_reader("Pong")) == nonce


def test_refusal_is_read_with_when_to_ask_again() -> None:
    frame = golden("Rejected")
    payload = np.frombuffer(frame[HEADER_LEN:], dtype=np.uint8)
    with pytest.raises(RigidMotionFree, match="about the z axis") as caught:
        Conversation(Limits()).reply(calls.ping(), header_of(frame), payload)
    assert (caught.value.code, caught.value.detail, caught.value.retry_after) == (3, "", 0.25)


def test_word_that_the_server_is_there_answers_nothing() -> None:
    conversation = Conversation(Limits())
    number, _ = conversation.begin(calls.ping())
    header = conversation.header(golden("Alive")[:HEADER_LEN])
    assert (header.kind, header.request_id) == (Kind.ALIVE, 0)
    assert not conversation.answered(header) and conversation.under_way == (number,)
