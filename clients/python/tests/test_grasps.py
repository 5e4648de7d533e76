"""The example of many grasps over several servers: one is killed and comes back, nothing is lost."""

import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

from conftest import ROOT, Spawn

import softgrasp
from softgrasp.program import find_program

EXAMPLE = ROOT / "clients/python/examples/grasps.py"
GRASPS = 150


def sweep(out: Path, *arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, str(EXAMPLE), "--grasps", str(GRASPS), "--out", str(out)]
    return subprocess.Popen([*command, *arguments], stdout=subprocess.PIPE, text=True)


def results(out: Path) -> dict[int, dict[str, object]]:
    found = {}
    for line in out.read_text().splitlines():
        if line:
            result = json.loads(line)
            assert result["grasp"] not in found, "no grasp is asked twice"
            found[result["grasp"]] = result
    return found


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


def start_at(port: int) -> subprocess.Popen[bytes]:
    command = [find_program(os.environ.get("SOFTGRASP_SERVER")), "--listen", f"127.0.0.1:{port}"]
    started = subprocess.Popen([*command, "--threads", "1"], stderr=subprocess.DEVNULL)
    ends = time.monotonic() + 30
    while time.monotonic() < ends:
        try:
            softgrasp.Server(f"127.0.0.1:{port}").close()
            return started
        except OSError:
            time.sleep(0.02)
    raise AssertionError("the server does not start")


def test_server_that_is_killed_and_comes_back_costs_no_grasp_and_no_bit(
    spawn: Spawn, tmp_path: Path
) -> None:
    undisturbed = tmp_path / "undisturbed.jsonl"
    assert sweep(undisturbed, "--server", spawn().address).wait(timeout=120) == 0
    expected = results(undisturbed)
    assert sorted(expected) == list(range(GRASPS))

    out, port, other = tmp_path / "disturbed.jsonl", free_port(), spawn()
    mortal = start_at(port)
    sweeping = sweep(out, "--server", f"127.0.0.1:{port}", "--server", other.address)
    ends = time.monotonic() + 60
    while not out.exists() or len(results_so_far(out)) < 20:
        assert time.monotonic() < ends and sweeping.poll() is None, "it is killed in the middle"
        time.sleep(0.005)
    mortal.kill()
    mortal.wait()
    assert len(results_so_far(out)) < GRASPS, "it is killed in the middle"
    again = start_at(port)
    try:
        assert sweeping.wait(timeout=120) == 0
    finally:
        again.kill()
        again.wait()
    assert results(out) == expected, "150 of 150, bit by bit"


def results_so_far(out: Path) -> list[str]:
    return [line for line in out.read_text().splitlines() if line]


def test_sweep_that_was_cut_goes_on_where_it_was_and_shards_are_the_whole(
    spawn: Spawn, tmp_path: Path
) -> None:
    address = spawn().address
    whole = tmp_path / "whole.jsonl"
    assert sweep(whole, "--server", address).wait(timeout=120) == 0
    expected = results(whole)
    # Its last line was not written to the end.
    lines = whole.read_text().splitlines(keepends=True)
    cut = tmp_path / "cut.jsonl"
    cut.write_text("".join(lines[:60]) + lines[60][:30])
    goes_on = sweep(cut, "--server", address)
    assert goes_on.wait(timeout=120) == 0
    assert (
        goes_on.stdout is not None and "90 grasps answered, 60 were there" in goes_on.stdout.read()
    )
    kept = [json.loads(line) for line in cut.read_text().splitlines() if line.endswith("}")]
    assert {result["grasp"]: result for result in kept} == expected
    parts = {}
    for part in range(3):
        out = tmp_path / f"part-{part}.jsonl"
        assert sweep(out, "--server", address, "--shard", f"{part}/3").wait(timeout=120) == 0
        parts.update(results(out))
    assert parts == expected
