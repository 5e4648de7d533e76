"""A sweep: the stiffness of a pressed block against Poisson's ratio and slenderness.

    python sweep.py --out stiffness.csv
    python sweep.py --dask                 by the scheduler of Dask (pip install dask)

Several sessions ask one server at once; any pool of threads or processes will do, as long as each
worker opens a session of its own.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import softgrasp

YOUNG = 20_000.0
RATIOS = (0.0, 0.2, 0.4, 0.45, 0.49)
HEIGHTS = (0.01, 0.02, 0.04)
SIDE = 0.02
CELLS = 4
WORKERS = 4


class Worker(threading.local):
    """A session for each thread."""

    def __init__(self, address: str) -> None:
        self.server = softgrasp.Server(address)


def stiffness(server: softgrasp.Server, ratio: float, height: float) -> tuple[float, str, float]:
    """Stiffness (N/m) of a block that is glued between two plates, element, and residual."""
    mesh = softgrasp.Mesh.block((SIDE, SIDE, height), (CELLS, CELLS, round(CELLS * height / SIDE)))
    top = mesh.nodes_at(z=height)
    case = softgrasp.LoadCase().prescribe(mesh.nodes_at(z=0.0), (0.0, 0.0, 0.0))
    case = case.prescribe(top, (0.0, 0.0, -0.01 * height))
    model = softgrasp.Model(mesh, softgrasp.Material(YOUNG, ratio))
    answer = server.solve(model, case)
    force = -answer.reactions.total(top)[2]
    return force / (0.01 * height), answer.report.element, answer.residual_rel


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, help="table of the results")
    parser.add_argument("--dask", action="store_true", help="let Dask call the workers")
    given = parser.parse_args()
    cases = list(itertools.product(RATIOS, HEIGHTS))
    with softgrasp.Server.spawn() as server:
        worker = Worker(server.address)

        def ask(case: tuple[float, float]) -> tuple[float, str, float]:
            return stiffness(worker.server, *case)

        if given.dask:
            import dask

            tasks = [dask.delayed(ask)(case) for case in cases]
            found = dask.compute(*tasks, scheduler="threads", num_workers=WORKERS)
        else:
            with ThreadPoolExecutor(WORKERS) as pool:
                found = list(pool.map(ask, cases))
    print("Poisson's ratio   height mm   stiffness N/m   of a free bar   element")
    rows = []
    for (ratio, height), (value, element, residual) in zip(cases, found, strict=True):
        bar = YOUNG * SIDE * SIDE / height
        print(f"{ratio:15.2f}{1e3 * height:12.0f}{value:16.4g}{bar:16.4g}   {element}")
        rows.append((ratio, height, value, bar, element, residual))
    if given.out is not None:
        with given.out.open("w", newline="") as file:
            table = csv.writer(file)
            table.writerow(("poisson", "height_m", "stiffness", "bar", "element", "residual_rel"))
            table.writerows(rows)


if __name__ == "__main__":
    main()
