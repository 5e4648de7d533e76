"""A server that is killed, stopped, silent or forgetful: an error at once, and a way on."""

import asyncio
import os
import pathlib
import signal
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import PROGRAM, Bar, Spawn
from recorded import exactly, stand_in, welcome_payload

import softgrasp
from softgrasp import AsyncServer, Mesh, Model, Server, calls
from softgrasp.framing import Kind, encode_frame
from softgrasp.program import find_program

AT_ONCE = 1.0
"""Seconds within which a lost server is noticed."""


def test_killed_server_is_noticed_before_the_next_request(spawn: Spawn, bar: Bar) -> None:
    program = spawn()
    with Server(program.address) as server:
        kept = server.keep(bar.model)
        kept.frame(bar.case)
        program.kill()
        start = time.monotonic()
        with pytest.raises(softgrasp.ConnectionLost):
            kept.frame(bar.case)
        assert time.monotonic() - start < AT_ONCE
        assert not server.is_open
        with pytest.raises(softgrasp.ConnectionLost):
            server.reconnect()


def test_server_killed_while_it_works_is_noticed_at_once(spawn: Spawn) -> None:
    program = spawn()
    mesh = Mesh.block((0.1, 0.1, 0.1), (9, 9, 9))
    model = Model(mesh, softgrasp.Material(1e4, 0.3), "t4")
    case = softgrasp.LoadCase().prescribe(mesh.nodes_at(x=0.0), (0.0, 0.0, 0.0))
    case = case.prescribe(mesh.nodes_at(x=0.1), (0.001, 0.0, 0.0))
    killed: list[float] = []

    def kill() -> None:
        program.kill()
        killed.append(time.monotonic())

    with Server(program.address) as server:
        # The loop of 1998 takes seconds for a thousand nodes, on any machine.
        timer = threading.Timer(0.5, kill)
        timer.start()
        with pytest.raises(softgrasp.ConnectionLost):
            server.solve(model, case, method="gauss-jordan-plain")
        noticed = time.monotonic()
        timer.join()
        assert noticed - killed[0] < AT_ONCE


def stop(pid: int) -> None:
    """Stops a process and waits until all its threads stand, which takes its time."""
    os.kill(pid, signal.SIGSTOP)
    given_up = time.monotonic() + 10.0
    while any(
        stat.read_text().rpartition(")")[2].split()[0] not in "Tt"
        for stat in pathlib.Path(f"/proc/{pid}/task").glob("*/stat")
    ):
        assert time.monotonic() < given_up
        time.sleep(0.01)


def test_stopped_server_is_given_up_in_time(spawn: Spawn, bar: Bar) -> None:
    program = spawn()
    with Server(program.address, timeout=0.5) as server:
        stop(program.pid)
        try:
            start = time.monotonic()
            with pytest.raises(softgrasp.NoAnswerInTime) as caught:
                server.solve(bar.model, bar.case)
            assert time.monotonic() - start < 0.5 + AT_ONCE
            assert isinstance(caught.value, TimeoutError)
        finally:
            os.kill(program.pid, signal.SIGCONT)
        server.reconnect()
        assert np.abs(server.solve(bar.model, bar.case).displacements - bar.exact).max() < 1e-12


def test_server_that_is_asked_to_end_says_so_or_closes(spawn: Spawn) -> None:
    program = spawn()
    with Server(program.address) as server:
        program.end()
        with pytest.raises((softgrasp.ShuttingDown, softgrasp.ConnectionLost)):
            server.ping()


def test_trickle_of_bytes_does_not_outlast_the_timeout() -> None:
    def trickle(stream, header) -> None:
        for byte in encode_frame(Kind.PONG, header.request_id, bytes(16)):
            stream.sendall(bytes([byte]))
            time.sleep(0.1)

    with stand_in(trickle) as address, Server(address, timeout=0.5) as server:
        start = time.monotonic()
        with pytest.raises(softgrasp.NoAnswerInTime):
            server.ping()
        assert time.monotonic() - start < 0.5 + AT_ONCE


def test_request_that_is_not_taken_does_not_outlast_the_timeout() -> None:
    # More than lies in buffers on the way.
    large = calls.Call(Kind.PING, bytes(64_000_000), Kind.PONG, lambda reader: None)
    greeting = encode_frame(Kind.WELCOME, 1, welcome_payload())

    async def ask(address: str) -> None:
        async with await AsyncServer.connect(address, timeout=0.5) as server:
            with pytest.raises(softgrasp.NoAnswerInTime, match="take the request"):
                await server._ask(large)
            assert not server.is_open

    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = f"127.0.0.1:{listener.getsockname()[1]}"
        for connect in (lambda: Server(address, timeout=0.5), lambda: asyncio.run(ask(address))):
            with ThreadPoolExecutor(1) as pool:
                connected = pool.submit(connect)
                stream, _ = listener.accept()
                with stream:
                    exactly(stream, 32)
                    stream.sendall(greeting)
                    server = connected.result(timeout=20.0)
                    if server is None:
                        continue
                    with server, pytest.raises(softgrasp.NoAnswerInTime, match="take the request"):
                        server._ask(large)
                    assert not server.is_open


def test_nobody_listens() -> None:
    start = time.monotonic()
    with pytest.raises(softgrasp.ConnectionLost, match="cannot be reached"):
        Server("127.0.0.1:1")
    assert time.monotonic() - start < AT_ONCE


def test_forgotten_model_is_uploaded_again(spawn: Spawn, bar: Bar) -> None:
    program = spawn()
    with Server(program.address, timeout=30.0) as server:
        kept = server.keep(bar.model)
        first = kept.frame(bar.case)
        kept.drop()
        again = kept.frame(bar.case)
        assert np.abs(again.displacements - first.displacements).max() < 1e-12
        kept.drop()
        assert kept.upload().reused is False
        assert server.keep(bar.model).upload().reused is True


def test_waiting_session_can_be_closed_from_another_thread() -> None:
    with stand_in(lambda stream, header: None) as address:
        server = Server(address)
        threading.Timer(0.2, server.close).start()
        start = time.monotonic()
        with pytest.raises(softgrasp.ConnectionLost):
            server.ping()
        assert time.monotonic() - start < 0.2 + AT_ONCE


def test_spawned_server_ends_with_its_session(bar: Bar) -> None:
    with Server.spawn(PROGRAM, threads=1) as server:
        program = server.program
        assert program is not None and program.is_running
        assert server.welcome.threads == 1
        server.solve(bar.model, bar.case)
    assert not program.is_running
    server.close()


def test_program_that_is_not_there_or_no_server(tmp_path) -> None:
    with pytest.raises(softgrasp.ServerNotStarted, match="no program"):
        Server.spawn(tmp_path / "fea-server")
    with pytest.raises(softgrasp.ServerNotStarted, match="does not listen"):
        Server.spawn("/bin/true")
    with pytest.raises(softgrasp.ServerNotStarted, match="does not listen"):
        Server.spawn(PROGRAM, arguments=["--no-such-option"])


def test_program_is_looked_for_on_the_path(monkeypatch, tmp_path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(softgrasp.ServerNotStarted, match="on the PATH"):
        Server.spawn()


def test_program_is_found_beside_the_scripts_of_this_python(monkeypatch, tmp_path) -> None:
    laid = tmp_path / "scripts" / "fea-server"
    laid.parent.mkdir()
    laid.symlink_to(find_program(PROGRAM))
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("sysconfig.get_path", lambda name: str(tmp_path / name))
    assert find_program(None) == str(laid)


def test_server_ends_with_a_python_that_is_killed() -> None:
    text = (
        "import sys, time, softgrasp\n"
        "program = softgrasp.ServerProgram(sys.argv[1])\n"
        "print(program.pid, flush=True)\n"
        "time.sleep(60)\n"
    )
    command = [sys.executable, "-c", text, find_program(PROGRAM)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as python:
        assert python.stdout is not None
        server = int(python.stdout.readline())
        os.kill(server, 0)
        python.kill()
    deadline = time.monotonic() + 10.0
    while is_there(server):
        assert time.monotonic() < deadline, "the server goes on without anybody"
        time.sleep(0.05)


def is_there(pid: int) -> bool:
    """Whether a process lives; one that has ended and is not waited for does not."""
    try:
        state = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"

