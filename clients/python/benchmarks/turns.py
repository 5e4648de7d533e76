"""Frames of one question, in blocks, in turns with the client that says when.

    python turns.py HOST:PORT FOLDER

FOLDER has model, question and exact answer as little-endian numbers, as `softgrasp-bench service`
writes them. Each line of standard input is the number of the first frame of a block and how many
there are; each is answered by a line with the time (ms) and the relative error of every frame.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np

import softgrasp


def main() -> None:
    address, folder = sys.argv[1], Path(sys.argv[2])

    def floats(name: str) -> np.ndarray:
        return np.fromfile(folder / f"{name}.f64", dtype="<f8")

    def numbers(name: str) -> np.ndarray:
        return np.fromfile(folder / f"{name}.u32", dtype="<u4")

    mesh = softgrasp.Mesh(floats("points").reshape(-1, 3), numbers("tets").reshape(-1, 4))
    material = softgrasp.Material(*floats("material").tolist())
    case = softgrasp.LoadCase(numbers("dofs"), floats("displacements"))
    nodes, right = numbers("nodes"), floats("right").reshape(-1, 3)
    pushed, largest = case.known_displacements, np.abs(right).max()
    with softgrasp.Server(address) as server:
        kept = server.keep(softgrasp.Model(mesh, material, "t4"))
        for line in sys.stdin:
            first, count = map(int, line.split())
            said = []
            for frame in range(first, first + count):
                scale = 1.0 + 0.25 * math.sin(frame)
                start = time.perf_counter()
                moved = case.with_displacements(scale * pushed)
                answer = kept.frame(moved, method="condensed", nodes=nodes, reactions=False)
                took = time.perf_counter() - start
                off = np.abs(answer.displacements - scale * right).max() / (scale * largest)
                said.append(f"{1e3 * took:.6f} {off:e}")
            print(*said, flush=True)


if __name__ == "__main__":
    main()
