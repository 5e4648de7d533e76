"""The sides that are asked in turn, each a process of its own with as many threads as all others."""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# Thread pools of others (OpenMP waits up to 200 ms) go on turning after a call; nobody is timed
# until they sleep.
PAUSE_S = 0.25


class SideError(Exception):
    """A side that cannot be started, or that ended."""


class Side:
    """A process that answers a JSON line by a JSON line."""

    def __init__(self, name, command, threads):
        self.name = name
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env=environment(threads), cwd=tempfile.gettempdir(),
        )

    def ask(self, ask, **request):
        try:
            self.process.stdin.write(json.dumps({"ask": ask, **request}) + "\n")
            self.process.stdin.flush()
            answer = self.process.stdout.readline()
        except BrokenPipeError:
            answer = ""
        if not answer:
            raise SideError(f"{self.name} ended when it was asked {ask}: see its message above")
        return json.loads(answer)

    def end(self):
        self.process.stdin.close()
        self.process.wait(timeout=60)


def environment(threads):
    """This environment with its settings of thread numbers and processor kinds taken out."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("OPENBLAS_", "MKL_", "OMP_", "KMP_", "RAYON_", "GOTO_"))
    }
    names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS")
    return {**kept, **{name: str(threads) for name in names}}


def target():
    return Path(ROOT, os.environ.get("CARGO_TARGET_DIR", "target")).resolve()


def build():
    """Builds both Rust programs; nothing if they are up to date."""
    run = ["cargo", "build", "--release", "--quiet"]
    subprocess.run([*run, "-p", "softgrasp-bench", "--example", "peer"], cwd=ROOT, check=True)
    rapier = {**os.environ, "CARGO_TARGET_DIR": str(HERE / "rapier" / "target")}
    subprocess.run([*run, "--locked"], cwd=HERE / "rapier", env=rapier, check=True)


def start(name, threads):
    """Starts a side by its name."""
    commands = {
        "ours": [target() / "release" / "examples" / "peer", str(threads)],
        "rapier": [HERE / "rapier" / "target" / "release" / "softgrasp-peer-rapier"],
    }
    python = [sys.executable, HERE / f"side_{name}.py"]
    return Side(name, commands.get(name, python), threads)


def take_turns(rounds, budget_s, competitors):
    """Lets competitors take turns: one list of results for each.

    A first round does not count. Each round another begins, and no round begins after `budget_s`
    once there are five.
    """
    results = [[] for _ in competitors]
    began = time.monotonic()
    for number in range(rounds + 1):
        if number > 5 and time.monotonic() - began > budget_s:
            break
        for turn in range(len(competitors)):
            who = (number + turn) % len(competitors)
            time.sleep(PAUSE_S)
            result = competitors[who]()
            if number > 0:
                results[who].append(result)
    return results
