"""What tests/cluster/run.sh asks: known displacements for a mesh, whether two answers agree, and what a
report says. Python and nothing else."""

import csv
import json
import sys


def places(path):
    """Places of the nodes of a Gmsh 4.1 text file, in the order of their tags."""
    with open(path) as file:
        lines = file.read().split("\n")
    at = lines.index("$Nodes") + 1
    blocks = int(lines[at].split()[0])
    at += 1
    found = {}
    for _ in range(blocks):
        count = int(lines[at].split()[3])
        tags = [int(tag) for tag in lines[at + 1 : at + 1 + count]]
        rows = lines[at + 1 + count : at + 1 + 2 * count]
        found.update((tag, [float(value) for value in row.split()]) for tag, row in zip(tags, rows))
        at += 1 + 2 * count
    return [found[tag] for tag in sorted(found)]


def known(path):
    """The lowest twentieth held, the ten highest nodes pressed down by a hundredth of the height."""
    nodes = places(path)
    order = sorted(range(len(nodes)), key=lambda node: (nodes[node][2], node))
    height = nodes[order[-1]][2] - nodes[order[0]][2]
    print("node,ux,uy,uz")
    for node in sorted(order[: max(3, len(nodes) // 20)]):
        print(f"{node},0,0,0")
    for node in sorted(order[-10:]):
        print(f"{node},{0.002 * height!r},0,{-0.01 * height!r}")


def displacements(path):
    with open(path) as file:
        return [[float(value) for value in row[1:]] for row in list(csv.reader(file))[1:]]


def agree(first, second, most):
    a, b = displacements(first), displacements(second)
    largest = max(abs(value) for row in a for value in row)
    differences = [abs(x - y) for r, s in zip(a, b, strict=True) for x, y in zip(r, s)]
    # What is no number is no agreement.
    if not all(difference <= float(most) * largest for difference in differences):
        sys.exit(f"largest difference {max(differences) / largest:.1e}, at most {most}")


def report(path, checks):
    with open(path) as file:
        told = json.load(file)
    while checks:
        check = checks.pop(0)
        if check.startswith("method="):
            holds = told["method"] == check[len("method=") :]
        elif check == "residual":
            holds = told["residual_rel"] <= float(checks.pop(0))
        elif check == "estimated":
            holds = 0 < told["error_estimate_rel"] <= float(checks.pop(0))
        elif check == "unproven":
            holds = told["error_bound_rel"] is None and "several processes" in told["why"]
        elif check == "because":
            holds = checks.pop(0) in told["chosen_because"]
        else:
            sys.exit(f"{check} is no check")
        if not holds:
            sys.exit(f"{check}: {json.dumps(told)}")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["known", path]:
            known(path)
        case ["agree", first, second, most]:
            agree(first, second, most)
        case ["report", path, *checks]:
            report(path, checks)
        case _:
            sys.exit(__doc__)
