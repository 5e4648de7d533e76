"""The clamped block of report `accuracy` by CalculiX: ten-node tetrahedra (C3D10), fine meshes.

A block of 1 x 1 x 2 m, E = 1e5 Pa, is clamped below; every node of its upper face is given the same
displacement along x and is free along y and z. Printed is that displacement over its force, for
meshes that get finer, and their limit. The values in `benches/src/accuracy/clamped_block.rs` come
from here:

    python3 benches/peers/clamped_block.py            (Debian: apt-get install calculix-ccx)

By symmetry a quarter is modelled: at y = 1/2 nothing moves along y, and at x = 1/2, about which the
displacements along y and z are odd, nothing moves along y and z. Nodes crowd towards the edges where
stresses are singular.
"""

import argparse
import itertools
import re
import subprocess
import tempfile
from pathlib import Path

YOUNG = 1.0e5
# Paths of the six tetrahedra of a box, from one end of its diagonal to the other.
PATHS = list(itertools.permutations(range(3)))
# Pairs of corners with a node between them, in CalculiX's order.
EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))


def toward_zero(count, length):
    """Places 0 to `length`, closer together near 0."""
    return [length * (i / count) ** 2 for i in range(count + 1)]


def toward_both(count, length):
    """Places 0 to `length`, closer together near both ends; `count` even."""
    half = toward_zero(count // 2, 0.5 * length)
    return half + [length - z for z in reversed(half[:-1])]


def corner_mesh(cells):
    """Nodes and tetrahedra of the quarter, `cells` boxes over half the width."""
    axes = [toward_zero(cells, 0.5), toward_zero(cells, 0.5), toward_both(4 * cells, 2.0)]
    counts = [len(axis) for axis in axes]
    number = lambda at: at[0] + counts[0] * (at[1] + counts[1] * at[2])
    nodes = [(x, y, z) for z in axes[2] for y in axes[1] for x in axes[0]]
    tets = []
    for box in itertools.product(*(range(count - 1) for count in counts)):
        for path in PATHS:
            at = list(box)
            tet = [number(at)]
            for axis in path:
                at[axis] += 1
                tet.append(number(at))
            # Corners of an odd path turn the other way.
            if sum(path[i] > path[j] for i in range(3) for j in range(i + 1, 3)) % 2:
                tet[2], tet[3] = tet[3], tet[2]
            tets.append(tet)
    return nodes, tets


def with_middles(nodes, tets):
    """The same with a node in the middle of every edge."""
    nodes, middles, all_ten = list(nodes), {}, []
    for tet in tets:
        ten = list(tet)
        for a, b in EDGES:
            edge = (min(tet[a], tet[b]), max(tet[a], tet[b]))
            if edge not in middles:
                middles[edge] = len(nodes)
                nodes.append(tuple(0.5 * (p + q) for p, q in zip(nodes[edge[0]], nodes[edge[1]])))
            ten.append(middles[edge])
        all_ten.append(ten)
    return nodes, all_ten


def deck(nodes, tets, poisson):
    """The input of CalculiX, which reads twenty characters of a number; all count from 1."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n}, {x:.12e}, {y:.12e}, {z:.12e}" for n, (x, y, z) in enumerate(nodes, 1)]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=BLOCK")
    lines += [f"{e}, " + ", ".join(str(n + 1) for n in ten) for e, ten in enumerate(tets, 1)]
    sets = {
        "BELOW": lambda p: p[2] < 1e-9,
        "ABOVE": lambda p: p[2] > 2.0 - 1e-9,
        "MIDX": lambda p: p[0] > 0.5 - 1e-9,
        "MIDY": lambda p: p[1] > 0.5 - 1e-9,
    }
    for name, is_in in sets.items():
        lines.append(f"*NSET, NSET={name}")
        lines += [f"{n}," for n, p in enumerate(nodes, 1) if is_in(p)]
    lines += ["*MATERIAL, NAME=RUBBER", "*ELASTIC", f"{YOUNG}, {poisson}"]
    lines += ["*SOLID SECTION, ELSET=BLOCK, MATERIAL=RUBBER", "*STEP", "*STATIC", "*BOUNDARY"]
    lines += ["BELOW, 1, 3", "MIDX, 2, 3", "MIDY, 2, 2", "ABOVE, 1, 1, 1.0"]
    lines += ["*NODE PRINT, NSET=ABOVE, TOTALS=ONLY", "RF", "*END STEP", ""]
    return "\n".join(lines)


def compliance(cells, poisson):
    """Displacement over force, m/N, and the number of nodes."""
    nodes, tets = with_middles(*corner_mesh(cells))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "block.inp").write_text(deck(nodes, tets, poisson))
        done = subprocess.run(["ccx", "block"], cwd=folder, capture_output=True, text=True)
        result = Path(folder) / "block.dat"
        text = result.read_text() if result.exists() else ""
    found = re.search(r"total force.*?\n\s*\n\s*(\S+)", text)
    if not found:
        raise SystemExit(f"ccx gave no force:\n{done.stdout[-2000:]}")
    # A quarter of the force.
    return 1.0 / (4.0 * float(found.group(1))), len(nodes)


def limit(coarse, middle, fine):
    """Aitken's limit of three values on meshes refined by the same factor."""
    return fine - (fine - middle) ** 2 / ((fine - middle) - (middle - coarse))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", type=int, nargs=3, default=[2, 4, 8], metavar="N")
    parser.add_argument("--poisson", type=float, nargs="+", default=[0.3, 0.49, 0.4999])
    options = parser.parse_args()
    for poisson in options.poisson:
        values = []
        for cells in options.cells:
            value, nodes = compliance(cells, poisson)
            values.append(value)
            print(f"poisson {poisson}: {cells} boxes over half the width, {nodes} nodes: {value:.6e} m/N")
        print(f"poisson {poisson}: limit {limit(*values):.6e} m/N", flush=True)


if __name__ == "__main__":
    main()
