"""Thousands of grasps over many servers: results keyed by content, resumed, whatever server dies.

    python grasps.py --grasps 10000 --out grasps.jsonl --server 10.0.0.1:7878 --server 10.0.0.2:7878
    python grasps.py --grasps 10000 --out part-3.jsonl --shard 3/32     a task of an array of jobs

Without --server it starts one of its own. Each line of the result is one grasp: its key, a hash of
all displacements, the largest displacement and the force of the grasp. What stands in the file is
not asked again.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import json
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import softgrasp

SIDE, CELLS = 0.06, 6
PATIENCE_S = 60.0
"""So long a grasp looks for a server that answers."""


def grasped(number: int) -> tuple[softgrasp.Model, softgrasp.LoadCase]:
    """The object and the grasp of a number: two places are pressed towards each other."""
    mesh = softgrasp.Mesh.block((SIDE, SIDE, SIDE), (CELLS, CELLS, CELLS))
    model = softgrasp.Model(mesh, softgrasp.Material(young=20e3, poisson=0.4))
    chance = np.random.default_rng(number)
    height, depth = chance.uniform(0.3, 0.7, 2) * SIDE
    press = chance.uniform(0.02, 0.08) * SIDE
    case = softgrasp.LoadCase().prescribe(mesh.nodes_at(z=0.0), (0.0, 0.0, 0.0))
    for x, way in ((0.0, press), (SIDE, -press)):
        touched = mesh.nearest_node((x, depth, height))
        case = case.prescribe([touched], (way, None, None))
    return model, case


def key_of(version: str, model_hash: bytes, case: softgrasp.LoadCase) -> str:
    """What decides a result: the version of the server, the model and the question."""
    digest = hashlib.blake2b(version.encode() + model_hash, digest_size=16)
    for values in (case.known_dofs, case.known_displacements):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


class Session(threading.local):
    """A session for each thread, with the first server that answers."""

    def __init__(self, addresses: list[str]) -> None:
        self.addresses = itertools.cycle(addresses)
        self.server: softgrasp.Server | None = None

    def ask(self, number: int) -> dict[str, object]:
        """Result of a grasp. A server that is lost, full or about to end costs the time only."""
        model, case = grasped(number)
        ends = time.monotonic() + PATIENCE_S
        while True:
            try:
                if self.server is None:
                    self.server = softgrasp.Server(next(self.addresses), timeout=PATIENCE_S)
                kept = self.server.keep(model)
                answer = kept.frame(case, reactions=True)
            except (OSError, softgrasp.ConnectionLost, softgrasp.Busy, softgrasp.ShuttingDown) as e:
                self.server = None
                if time.monotonic() > ends:
                    raise
                time.sleep(min(getattr(e, "retry_after", None) or 0.1, 1.0))
                continue
            moved = np.ascontiguousarray(answer.displacements)
            return {
                "grasp": number,
                "key": key_of(self.server.welcome.version, kept.hash, case),
                "displacements": hashlib.blake2b(moved.tobytes(), digest_size=16).hexdigest(),
                "largest_m": float(np.abs(moved).max()),
                "force_n": float(np.abs(answer.reactions.forces).max()),
                "residual_rel": answer.residual_rel,
            }


def shard(text: str) -> tuple[int, int]:
    """K/N: the part K, from 0, of N."""
    part, parts = map(int, text.split("/"))
    if not 0 <= part < parts:
        raise ValueError(text)
    return part, parts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--grasps", type=int, default=60, help="how many grasps there are in all")
    parser.add_argument("--out", type=Path, required=True, help="lines of JSON, added to")
    parser.add_argument("--server", action="append", default=[], help="HOST:PORT; may be repeated")
    parser.add_argument("--sessions", type=int, default=4, help="requests at the same time")
    parser.add_argument(
        "--shard", type=shard, default=(0, 1), help="K/N: every Nth grasp from K on"
    )
    given = parser.parse_args()
    done = set()
    if given.out.exists():
        # A line that was cut when the last run was killed is asked again.
        for line in given.out.read_text().splitlines():
            try:
                done.add(json.loads(line)["grasp"])
            except (ValueError, KeyError):
                print("a line of the file is cut; its grasp is asked again")
    part, parts = given.shard
    open_ones = [number for number in range(part, given.grasps, parts) if number not in done]
    spawned = None if given.server else softgrasp.Server.spawn()
    addresses = given.server or [spawned.address]
    session = Session(addresses)
    with ThreadPoolExecutor(given.sessions) as pool, given.out.open("a") as out:
        out.write("" if not done else "\n")
        for result in pool.map(session.ask, open_ones):
            out.write(json.dumps(result) + "\n")
            out.flush()
    if spawned is not None:
        spawned.close()
    print(f"{len(open_ones)} grasps answered, {len(done)} were there")


if __name__ == "__main__":
    main()
