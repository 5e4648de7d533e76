"""Tokens and TLS: who may ask, and who listens."""

import asyncio
import ssl
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import PROGRAM, Bar, Spawn

import softgrasp
from softgrasp import AsyncServer, Server
from softgrasp.address import split_address, tls_context
from softgrasp.program import find_program

TOKEN = "4kUxgCRBJ2w6Kk0wq3H2Tn8m"


@pytest.fixture
def token_file(tmp_path: Path) -> str:
    path = tmp_path / "token"
    path.touch(mode=0o600)
    path.write_text(TOKEN + "\n")
    return str(path)


def certificate(folder: Path, name: str = "localhost") -> tuple[str, str]:
    """A certificate for a name and the loopback, and its key, made by the server program."""
    pem, key = str(folder / "lab.pem"), str(folder / "lab-key.pem")
    make = [find_program(PROGRAM), "--make-certificate", f"{name},127.0.0.1"]
    subprocess.run([*make, "--tls-cert", pem, "--tls-key", key], check=True, capture_output=True)
    return pem, key


def test_token_is_wanted(spawn: Spawn, token_file: str, bar: Bar) -> None:
    guarded = spawn("--token-file", token_file)
    with Server(guarded.address, token=TOKEN, timeout=30.0) as server:
        answer = server.solve(bar.model, bar.case)
        assert np.abs(answer.displacements - bar.exact).max() < 1e-12
    for wrong in (None, "", "something else", TOKEN + "x"):
        with pytest.raises(softgrasp.NotAuthorised):
            Server(guarded.address, token=wrong, timeout=30.0)


def test_token_is_in_no_text_of_an_error_or_an_object(spawn: Spawn, token_file: str) -> None:
    guarded = spawn("--token-file", token_file)
    with pytest.raises(softgrasp.NotAuthorised) as caught:
        Server(guarded.address, token="a wrong secret", timeout=30.0)
    assert "secret" not in f"{caught.value!r} {caught.value.detail}"
    with Server(guarded.address, token=TOKEN, timeout=30.0) as server:
        assert TOKEN not in repr(server)


def test_encrypted_way_with_a_certificate_of_the_server(
    spawn: Spawn, token_file: str, tmp_path: Path, bar: Bar
) -> None:
    pem, key = certificate(tmp_path)
    options = ("--tls-cert", pem, "--tls-key", key, "--token-file", token_file)
    address = spawn(*options).address
    by_name = address.replace("127.0.0.1", "localhost")
    for where in (address, by_name):
        with Server(where, token=TOKEN, tls=pem, timeout=30.0) as server:
            answer = server.solve(bar.model, bar.case)
            assert np.abs(answer.displacements - bar.exact).max() < 1e-12
            kept = server.keep(bar.model)
            assert np.abs(kept.frame(bar.case).displacements - bar.exact).max() < 1e-12
            stream = server._connection._stream._socket
            assert isinstance(stream, ssl.SSLSocket) and stream.version() == "TLSv1.3"
    with Server(address, token=TOKEN, tls=tls_context(pem), timeout=30.0) as server:
        server.ping()
    with pytest.raises(softgrasp.NotAuthorised):
        Server(address, token="wrong", tls=pem, timeout=30.0)


def test_certificate_of_somebody_else_is_not_trusted(spawn: Spawn, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "other").mkdir()
    pem, key = certificate(tmp_path / "mine")
    other, _ = certificate(tmp_path / "other")
    address = spawn("--tls-cert", pem, "--tls-key", key).address
    for tls in (other, True):
        with pytest.raises(ssl.SSLCertVerificationError):
            Server(address, tls=tls, timeout=30.0)
        with pytest.raises(ssl.SSLCertVerificationError):
            asyncio.run(AsyncServer.connect(address, tls=tls, timeout=30.0))


def test_certificate_for_another_name_is_not_trusted(spawn: Spawn, tmp_path: Path) -> None:
    pem, key = str(tmp_path / "lab.pem"), str(tmp_path / "lab-key.pem")
    make = [find_program(PROGRAM), "--make-certificate", "lab.example"]
    subprocess.run([*make, "--tls-cert", pem, "--tls-key", key], check=True, capture_output=True)
    address = spawn("--tls-cert", pem, "--tls-key", key).address
    with pytest.raises(ssl.SSLCertVerificationError):
        Server(address, tls=pem, timeout=30.0)


def test_plain_client_and_encrypted_server_do_not_wait_for_each_other(
    spawn: Spawn, tmp_path: Path, program: softgrasp.ServerProgram
) -> None:
    pem, key = certificate(tmp_path)
    address = spawn("--tls-cert", pem, "--tls-key", key).address
    with pytest.raises((softgrasp.ConnectionLost, softgrasp.BadStream)):
        Server(address, timeout=30.0)
    with pytest.raises((softgrasp.ConnectionLost, ssl.SSLError)):
        Server(program.address, tls=pem, timeout=30.0)


def test_encrypted_way_for_asyncio(spawn: Spawn, tmp_path: Path, bar: Bar) -> None:
    pem, key = certificate(tmp_path)
    address = spawn("--tls-cert", pem, "--tls-key", key).address

    async def solve() -> softgrasp.Answer:
        async with await AsyncServer.connect(address, tls=pem, timeout=30.0) as server:
            return await server.solve(bar.model, bar.case)

    assert np.abs(asyncio.run(solve()).displacements - bar.exact).max() < 1e-12


def test_addresses() -> None:
    assert split_address("host:80") == ("host", 80)
    assert split_address("host") == ("host", 7878)
    assert split_address("[::1]:80") == ("::1", 80)
    assert split_address("::1") == ("::1", 7878)
    for wrong in ("host:x", ":80", "host:0", "host:70000"):
        with pytest.raises(ValueError, match="address"):
            split_address(wrong)
    with pytest.raises(OSError):
        Server("127.0.0.1:1", tls="no/such/file.pem")
