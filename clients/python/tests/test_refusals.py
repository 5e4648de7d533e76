"""Refusals are exceptions that are told apart by their number; the session lives on."""

import pickle

import numpy as np
import pytest
from conftest import Bar, Spawn
from recorded import rejected_payload, stand_in

import softgrasp
from softgrasp import LoadCase, Material, Mesh, Model, Server, calls
from softgrasp.framing import Kind, encode_frame


def test_every_number_has_its_exception() -> None:
    assert sorted(softgrasp.REFUSALS) == list(range(1, 18))
    for code, kind in softgrasp.REFUSALS.items():

        def refuse(stream, header, code=code) -> None:
            payload = rejected_payload(code, f"reason {code}", "more", 1500)
            stream.sendall(encode_frame(Kind.REJECTED, header.request_id, payload))

        with stand_in(refuse) as address, Server(address, timeout=10.0) as server:
            with pytest.raises(kind) as caught:
                server.ping()
            error = caught.value
            assert type(error) is kind
            assert (error.code, error.text, error.detail) == (code, f"reason {code}", "more")
            assert error.retry_after == 1.5
            assert server.is_open
            again = pickle.loads(pickle.dumps(error))
            assert type(again) is kind and str(again) == str(error)
            assert again.retry_after == 1.5


def test_a_number_that_is_not_known_is_a_refusal_too() -> None:
    def refuse(stream, header) -> None:
        payload = rejected_payload(99, "of a later version")
        stream.sendall(encode_frame(Kind.REJECTED, header.request_id, payload))

    with stand_in(refuse) as address, Server(address, timeout=10.0) as server:
        with pytest.raises(softgrasp.Refused, match="99") as caught:
            server.ping()
        assert (caught.value.code, caught.value.retry_after) == (99, None)


def test_refusal_without_having_been_asked_ends_the_session() -> None:
    def refuse(stream, header) -> None:
        stream.sendall(encode_frame(Kind.REJECTED, 0, rejected_payload(11, "the server stops")))

    with stand_in(refuse) as address, Server(address, timeout=10.0) as server:
        with pytest.raises(softgrasp.ShuttingDown):
            server.ping()
        assert not server.is_open
        with pytest.raises(softgrasp.ConnectionLost, match=r"closed.*the server stops"):
            server.ping()


def test_real_refusals_name_their_cause(server: Server, bar: Bar) -> None:
    loose = LoadCase().prescribe([0], (0.0, 0.0, 0.0))
    with pytest.raises(softgrasp.RigidMotionFree, match="turn"):
        server.solve(bar.model, loose)
    with pytest.raises(softgrasp.UnknownMethod, match="there are"):
        server.solve(bar.model, bar.case, method="nobody")
    with pytest.raises(softgrasp.BadRequest):
        server.solve(bar.model, bar.case.prescribe([10_000], (0.0, 0.0, 0.0)))
    with pytest.raises(softgrasp.BadRequest):
        twice = bar.case.prescribe(bar.right, (2.0 * bar.PULL, None, None))
        server.solve(bar.model, twice)
    with pytest.raises(softgrasp.UnknownModel):
        server._ask(calls.frame(bytes(32), bar.case, softgrasp.Question()))
    pressed = (
        LoadCase().prescribe(bar.left, (0.0, 0.0, 0.0)).prescribe(bar.right, (-0.045, 0.0, 0.0))
    )
    with pytest.raises(softgrasp.Uncertain):
        server.solve_large(bar.model, pressed)
    assert server.is_open
    assert np.abs(server.solve(bar.model, bar.case).displacements - bar.exact).max() < 1e-12


def test_flat_mesh_is_refused(server: Server) -> None:
    flat = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2, 3]])
    model = Model(flat, Material(1e4, 0.3), "t4")
    with pytest.raises(softgrasp.Refused):
        server.solve(model, LoadCase().prescribe([0, 1, 2], (0.0, 0.0, 0.0)))


def test_limits_of_a_server_are_its_refusals(spawn: Spawn, bar: Bar) -> None:
    small = spawn("--max-nodes", "20", "--max-sessions", "1")
    with Server(small.address, timeout=30.0) as server:
        assert server.welcome.limits.node_count_max == 20
        with pytest.raises(softgrasp.TooLarge):
            server.solve(bar.model, bar.case)
        with pytest.raises(softgrasp.Busy):
            Server(small.address, timeout=30.0)
        server.ping()


def test_memory_of_a_server_is_its_refusal(spawn: Spawn) -> None:
    poor = spawn("--memory-limit", "4MiB")
    mesh = Mesh.block((0.1, 0.1, 0.1), (12, 12, 12))
    model = Model(mesh, Material(1e4, 0.3), "t4")
    case = LoadCase().prescribe(mesh.nodes_at(x=0.0), (0.0, 0.0, 0.0))
    with Server(poor.address, timeout=60.0) as server:
        with pytest.raises(softgrasp.MemoryLimit):
            server.solve(model, case.force([mesh.node_count - 1], (1.0, 0.0, 0.0)))
        server.ping()


def test_request_over_the_payload_limit_is_not_sent(spawn: Spawn, bar: Bar) -> None:
    narrow = spawn("--max-frame", "2048")
    with Server(narrow.address, timeout=30.0) as server:
        with pytest.raises(softgrasp.TooLarge, match="takes 2048"):
            server.solve(bar.model, bar.case)
        assert server.is_open


def test_arguments_that_no_server_takes_are_value_errors(bar: Bar) -> None:
    with pytest.raises(ValueError, match="between −1 and"):
        Material(1e4, 0.5)
    with pytest.raises(ValueError, match="above 0"):
        Material(0.0, 0.3)
    with pytest.raises(ValueError, match="names node 9"):
        Mesh(np.zeros((4, 3)), [[0, 1, 2, 9]])
    with pytest.raises(ValueError, match="shape"):
        Mesh(np.zeros((4, 2)), [[0, 1, 2, 3]])
    with pytest.raises(ValueError, match="finite"):
        Mesh([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    with pytest.raises(ValueError, match="whole numbers"):
        Mesh(np.zeros((4, 3)), [[0.5, 1, 2, 3]])
    with pytest.raises(ValueError, match="no material"):
        mesh = Mesh(bar.mesh.points, bar.mesh.tets, np.arange(len(bar.mesh.tets)) % 2)
        Model(mesh, {0: Material(1e4, 0.3)})
    with pytest.raises(ValueError, match="element"):
        Model(bar.mesh, Material(1e4, 0.3), "t5")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="weights"):
        LoadCase().mask([1, 2], weights=[1.0, -1.0])
    with pytest.raises(ValueError, match="shape"):
        LoadCase().prescribe([1, 2], np.zeros((3, 3)))
    with pytest.raises(ValueError, match="deadline_ms"):
        softgrasp.Question(deadline_ms=0.0)
    with pytest.raises(ValueError, match="precision"):
        softgrasp.Question(precision="f16")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="report"):
        softgrasp.Question(report="long")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="newest_wins"):
        calls.solve(bar.model, bar.case, softgrasp.Question(newest_wins=True))
    with pytest.raises(ValueError, match="alive_every"):
        Server("127.0.0.1:1", alive_every=0.0)
    with pytest.raises(ValueError, match="law"):
        softgrasp.LargeDeformation(law="hooke")  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        softgrasp.Question(metod="front")  # type: ignore[call-arg]
