"""Softgrasp against codes that others wrote, in one run, in turn, on the same problems.

Writes `peers.md` and `peers.csv`. What to install first is in the README beside this file.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import page
import sides
from direct_solvers import dense, sparse
from time_steps import time_steps

INTRODUCTION = """
Every side is a process of its own with two threads; one computes while the others wait. Each round
runs every competitor once, each round another one begins, and before each turn there is a pause of
a quarter of a second, in which the threads of the one before fall asleep. A first round does not
count. Times are the median (smallest..largest) over the rounds; a ratio is the median of the ratios
round by round.
"""


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--meshes", type=Path, metavar="DIR",
        help="folder with hammer.v41.msh and bunny.wrong-extension.vtk; without it, cubes only",
    )
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=Path, default=sides.ROOT / "reports", metavar="DIR")
    parser.add_argument("--note", default="", help="a remark for the head of the report")
    parser.add_argument(
        "--quick", action="store_true", help="small sizes, few rounds: to see that it works"
    )
    return parser.parse_args()


def command(options):
    quick = " --quick" if options.quick else ""
    meshes = " --meshes DIR" if options.meshes else ""
    return f"benches/peers/.venv/bin/python benches/peers/peers.py{meshes}{quick}"


def main():
    options = arguments()
    sides.build()
    head = {"command": command(options), **page.machine(), "threads": str(options.threads)}
    names = ("ours", "pardiso", "cholmod", "dense", "rapier", "mujoco")
    all_sides = {name: sides.start(name, options.threads) for name in names}
    about = [all_sides[name].ask("about") for name in names[1:]]
    head["peers"] = ", ".join(version for one in about for version in one["versions"])
    rates = {name: rate for one in about for name, rate in one.get("dgemm", {}).items()}
    text = ", ".join(f"{name} {rate:.0f}" for name, rate in rates.items())
    head["dgemm of 1500, GFlop/s"] = text
    if options.quick:
        head["form"] = "quick: small sizes, few rounds; not to be quoted"
    if options.note:
        head["note"] = options.note
    with tempfile.TemporaryDirectory() as folder:
        sections = [INTRODUCTION]
        for part in (sparse, dense, time_steps):
            sections += part(all_sides, Path(folder), options)
    for side in all_sides.values():
        side.end()
    head["load after"] = page.load()
    options.out.mkdir(parents=True, exist_ok=True)
    page.write(options.out, "peers", "Peers: codes that others wrote", head, sections)
    print(f"wrote {options.out / 'peers.md'}")


if __name__ == "__main__":
    try:
        main()
    except sides.SideError as error:
        sys.exit(f"peers: {error}")
