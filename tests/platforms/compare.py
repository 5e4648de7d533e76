"""The questions of tests/platforms/run.sh, and whether two programs have answered them alike.

    python3 compare.py known MESH.msh KNOWN.csv     prescribed displacements for a mesh
    python3 compare.py answers HERE THERE           compares two folders of answers
"""

import csv
import json
import math
import sys
from pathlib import Path

# Largest difference over the largest value. Direct methods differ by rounding, the others end where a
# residual is small enough, and contact where the residual of its law is.
ALLOWED = {"pcg": 1e-7, "multigrid": 1e-7, "large": 1e-6, "auto": 1e-7}
ALLOWED_DIRECT = 1e-10
ALLOWED_PRESS = 1e-4


def nodes_of(mesh: Path) -> list[tuple[float, ...]]:
    """Places of the nodes of a file of Gmsh 4.1, in their order."""
    lines = iter(mesh.read_text().splitlines())
    next(line for line in lines if line == "$Nodes")
    blocks = int(next(lines).split()[0])
    places = []
    for _ in range(blocks):
        count = int(next(lines).split()[3])
        for _ in range(count):
            next(lines)
        places += [tuple(map(float, next(lines).split()[:3])) for _ in range(count)]
    return places


def write_known(mesh: Path, table: Path) -> None:
    """The lowest fifth is held, the highest tenth pushed down and aside."""
    places = nodes_of(mesh)
    low, high = min(z for *_, z in places), max(z for *_, z in places)
    with table.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["node", "ux", "uy", "uz"])
        for node, (*_, z) in enumerate(places):
            part = (z - low) / (high - low)
            if part <= 0.2:
                rows.writerow([node, 0, 0, 0])
            elif part >= 0.9:
                rows.writerow([node, 0.001, "", -0.004])


def displacements(table: Path) -> list[float]:
    with table.open(newline="") as file:
        rows = csv.reader(file)
        next(rows)
        return [float(cell) for row in rows for cell in row[1:]]


def off(right: list[float], found: list[float]) -> float:
    """Largest difference over the largest value; endless where numbers are missing or no numbers."""
    if len(right) != len(found) or not all(map(math.isfinite, right + found)):
        return float("inf")
    most = max(map(abs, right))
    return max(abs(a - b) for a, b in zip(right, found)) / most


def compared_solve(right: Path, found: Path) -> tuple[float, float]:
    name = right.stem.removeprefix("solve-")
    return off(displacements(right), displacements(found)), ALLOWED.get(name, ALLOWED_DIRECT)


def compared_press(right: Path, found: Path) -> tuple[float, float]:
    """Forces of all bodies on the object, over all steps."""

    def told(path: Path) -> list[float]:
        steps = json.loads(path.read_text())["steps"]
        assert all(step["converged"] for step in steps), f"{path}: not converged"
        bodies = [body for step in steps for body in step["bodies"].values()]
        return [value for body in bodies for value in body["force"]]

    return off(told(right), told(found)), ALLOWED_PRESS


def carried_ticks(path: Path) -> int:
    """Ticks of a run in which fingers hold the object above the table."""
    contacts = [frame.get("contact") for frame in json.loads(path.read_text())["frames"]]
    return sum(
        1
        for contact in contacts
        if contact and contact["table_force_n"] == 0.0 and max(contact["finger_force_n"]) > 0.01
    )


def compare(here: Path, there: Path) -> bool:
    fits = True
    for right in sorted(here.iterdir()):
        found = there / right.name
        if right.name.startswith("solve-"):
            worst, allowed = compared_solve(right, found)
        elif right.name.startswith("press"):
            worst, allowed = compared_press(right, found)
        elif right.name.startswith("run"):
            # Which tick lifts follows from contacts that come and go; that it is lifted does not.
            ticks = carried_ticks(found)
            print(f"{right.name}: carried for {ticks} ticks, {carried_ticks(right)} here")
            fits &= ticks > 50
            continue
        else:
            continue
        print(f"{right.name}: off by {worst:.1e}, {allowed:.0e} is allowed")
        fits &= worst <= allowed
    return fits


def main() -> int:
    what, first, second = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    if what == "known":
        write_known(first, second)
        return 0
    return 0 if compare(first, second) else 1


if __name__ == "__main__":
    sys.exit(main())
