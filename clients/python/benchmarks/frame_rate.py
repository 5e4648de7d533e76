"""Round trips of warm frames: how many a second this package gets from a server.

    python frame_rate.py                            a cube of 10 648 nodes, 2000 frames
    python frame_rate.py --rust-ms 0.13             beside the Rust client's median, in ms

Five single nodes are displaced, otherwise in each frame, and all surface nodes come back in double
precision: what `softgrasp-bench frame` measures for the Rust client, contact `vertex`, `asleep`
(`cargo run --release --bin softgrasp-bench -- frame`, reports/frame.csv). Only figures of the same
machine, the same hour and a server of the same build may stand side by side.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
from datetime import datetime, timezone

import numpy as np

import softgrasp

EDGE = 0.1
PUSH = 0.002


def processor() -> str:
    """What the system calls the processor."""
    try:
        with open("/proc/cpuinfo") as file:
            names = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
        return names[0] if names else platform.machine()
    except OSError:
        return platform.processor() or platform.machine()


def touched_nodes(mesh: softgrasp.Mesh) -> np.ndarray:
    """A node in the middle of each of five faces."""
    half = EDGE / 2
    places = [(half, half, EDGE), (0, half, half), (EDGE, half, half), (half, 0, half)]
    places.append((half, EDGE, half))
    return np.array([mesh.nearest_node(place) for place in places])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", help="the server program (default: fea-server on the PATH)")
    parser.add_argument("--cells", type=int, default=21, help="cells along an edge of the cube")
    parser.add_argument("--frames", type=int, default=2000, help="frames that are timed")
    parser.add_argument("--precision", choices=("f64", "f32"), default="f64")
    parser.add_argument("--rust-ms", type=float, help="median of the Rust client, for comparison")
    given = parser.parse_args()

    mesh = softgrasp.Mesh.block((EDGE,) * 3, (given.cells,) * 3)
    model = softgrasp.Model(mesh, softgrasp.Material(20_000.0, 0.3), "t4")
    touched, surface = touched_nodes(mesh), mesh.boundary_nodes
    push = np.zeros((len(touched), 3))
    push[:, 2] = -PUSH * np.linspace(0.5, 1.0, len(touched))
    case = softgrasp.LoadCase().prescribe(touched, push)
    factors = 1.0 + 0.5 * np.sin(np.arange(given.frames))
    round_trips, at_server = np.empty(given.frames), np.empty(given.frames)
    with softgrasp.Server.spawn(given.program) as server:
        kept = server.keep(model)
        first = kept.frame(case, nodes=surface, reactions=False)
        for _ in range(50):
            kept.frame(case, nodes=surface, reactions=False, precision=given.precision)
        for k, factor in enumerate(factors):
            start = time.perf_counter()
            moved = case.with_displacements(factor * case.known_displacements)
            answer = kept.frame(moved, nodes=surface, reactions=False, precision=given.precision)
            round_trips[k] = 1e3 * (time.perf_counter() - start)
            stages = answer.report.stage_ms
            at_server[k] = stages.decode + stages.factor + stages.solve + stages.encode
        error = np.abs(answer.displacements - factors[-1] * first.displacements).max()
        error /= np.abs(first.displacements).max()
        threads = server.welcome.threads
    median, late = np.quantile(round_trips, (0.5, 0.99))
    day = datetime.now(timezone.utc).date()
    print(f"{day}, {processor()}, {os.cpu_count()} processors, {threads} threads of the server")
    print(f"Python {platform.python_version()}, numpy {np.__version__}, {given.precision}")
    print(f"{mesh.node_count} nodes, {len(surface)} answered, by {answer.report.method}")
    print(f"round trip: median {median:.3f} ms, 99 % within {late:.3f} ms")
    print(f"frames a second: {1e3 / round_trips.mean():.0f}")
    print(f"of the median the server's own stages: {np.median(at_server):.3f} ms")
    print(f"error against the first frame: {error:.1e}")
    if given.rust_ms is not None:
        print(f"rate over that of the Rust client: {given.rust_ms / median:.0%}")
    assert error < 1e-6


if __name__ == "__main__":
    main()
