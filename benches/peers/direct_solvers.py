"""Direct solvers on the same K11: sparse ones on all problems, dense ones on the smallest."""

import sys
from dataclasses import dataclass

from page import Spread, Table, ratio
from problem import COLUMNS, error_rel
from sides import take_turns

# Largest error with which a time is reported, relative to the largest displacement.
ERROR_ALLOWED = 1e-8
TIMES = ("order_ms", "factor_ms", "solve_ms", "solve_wide_ms")

SPARSE = (
    ("front", "ours", "front"),
    ("front-mixed", "ours", "front-mixed"),
    ("sparse-cholesky", "ours", "sparse-cholesky"),
    ("MKL Pardiso", "pardiso", "llt"),
    ("CHOLMOD", "cholmod", "llt"),
)
DENSE = (
    ("dense-inverse", "ours", "dense-inverse"),
    ("OpenBLAS potrf + potri", "dense", "potri"),
    ("dense-cholesky", "ours", "dense-cholesky"),
    ("OpenBLAS potrf", "dense", "potrf"),
)

SPARSE_TEXT = f"""
## Sparse factors

`K11` of the cube lattice and of two mesh files, five nodes known; `order` is order and symbolic
analysis, `factor` the numerical factor, `solve 21` the solution of {COLUMNS} right-hand sides. All
peers run with their default parameters and in double precision: Pardiso with matrix type 2, CHOLMOD
supernodal with METIS on degrees of freedom. `front` is the factor alone, in double precision;
`front-mixed` is a factor in single precision with the refinement in double in its solve times;
`sparse-cholesky` runs on one thread. The solves of the latter two hold the right-hand side, residual
and reactions of `Factored::solve`, and their {COLUMNS} are one after another.

`error rel` is the worst over rounds and right-hand sides of the largest difference to a solution
refined with residuals in twice the working precision, over the largest displacement; a time with an
error above {ERROR_ALLOWED:g} is not reported. The ratios are peer over `front`: above 1, `front` is
faster; `all over front` is order, factor and one solve together. On a machine with other work
(see the load in the head) threads that wait for each other by turning lose more than threads that
sleep or take other tasks, so such a run is unfair to Pardiso and to everything on OpenBLAS.
"""

DENSE_TEXT = """
## Dense factors and inverses

The same problem as a dense matrix. `factor` holds the filling of the matrix, on both sides. The
ratios are OpenBLAS over our method of the row above.
"""


@dataclass
class Outcome:
    """All counted rounds of one competitor on one problem."""

    times: dict
    error: float | None

    def is_right(self):
        return self.error is not None and self.error <= ERROR_ALLOWED

    def all_ms(self):
        rows = zip(self.times["order_ms"], self.times["factor_ms"], self.times["solve_ms"])
        return [sum(row) for row in rows]


def sparse(sides, folder, options):
    cubes = (216, 1000) if options.quick else (1000, 3375, 10648, 21952)
    problems = [(f"cube {nodes}", {"ask": "cube", "nodes": nodes}) for nodes in cubes]
    if options.meshes:
        for name, file in (("hammer", "hammer.v41.msh"), ("bunny", "bunny.wrong-extension.vtk")):
            request = {"ask": "file", "mesh": str((options.meshes / file).resolve())}
            problems.append((name, request))
    columns = [
        "solver", "problem", "nodes", "unknown_dofs", "order_ms", "factor_ms", "solve_ms",
        "solve_21_ms", "error_rel", "all_over_front", "factor_over_front", "solve_over_front",
        "solve_21_over_front", "rounds",
    ]
    table = Table("Times and errors, sparse", columns)
    for name, request in problems:
        head, outcomes = measure(sides, folder / name, request, SPARSE, options)
        for label, outcome in outcomes.items():
            push(table, label, name, head, outcome, outcomes["front"])
    return [SPARSE_TEXT, table]


def dense(sides, folder, options):
    nodes = 216 if options.quick else 1000
    columns = [
        "solver", "problem", "nodes", "unknown_dofs", "order_ms", "factor_ms", "solve_ms",
        "solve_21_ms", "error_rel", "all_over_ours", "factor_over_ours", "solve_over_ours",
        "solve_21_over_ours", "rounds",
    ]
    table = Table("Times and errors, dense", columns)
    request = {"ask": "cube", "nodes": nodes}
    head, outcomes = measure(sides, folder / "dense", request, DENSE, options)
    for label, outcome in outcomes.items():
        inverse = label in ("dense-inverse", "OpenBLAS potrf + potri")
        ours = outcomes["dense-inverse" if inverse else "dense-cholesky"]
        push(table, label, f"cube {nodes}", head, outcome, ours)
    return [DENSE_TEXT, table]


def measure(sides, folder, request, competitors, options):
    """Makes a problem, lets everybody read it, and lets them take turns."""
    print(f"peers: {folder.name}", file=sys.stderr)
    ask = request["ask"]
    about = {key: value for key, value in request.items() if key != "ask"}
    head = sides["ours"].ask(ask, folder=str(folder), **about)
    if head["reference_settled_rel"] > 1e-15:
        sys.exit(f"peers: the right answer of {folder.name} did not settle: "
                 f"{head['reference_settled_rel']:g}")
    for side in {side for _, side, _ in competitors} - {"ours"}:
        sides[side].ask("load", folder=str(folder))

    def competitor(side, method):
        def run():
            times = sides[side].ask("run", method=method)
            return times, error_rel(folder)
        return run

    runs = [competitor(side, method) for _, side, method in competitors]
    rounds, budget_s = (2, 10) if options.quick else (9, 75)
    outcomes = {}
    for (label, _, _), results in zip(competitors, take_turns(rounds, budget_s, runs)):
        times = {name: [one[name] for one, _ in results] for name in TIMES}
        errors = [error for _, error in results]
        outcomes[label] = Outcome(times, None if None in errors else max(errors))
    return head, outcomes


def push(table, label, problem, head, outcome, ours):
    """One row; without times if the answer was wrong."""
    start = (label, problem, head["nodes"], head["unknown_dofs"])
    rounds = len(outcome.times["solve_ms"])
    if not outcome.is_right():
        table.push(*start, None, None, None, None, outcome.error, None, None, None, None, rounds)
        return
    ratios = [None] * 4
    if outcome is not ours and ours.is_right():
        pairs = [(outcome.times[name], ours.times[name]) for name in TIMES[1:]]
        ratios = [ratio(outcome.all_ms(), ours.all_ms()), *(ratio(*pair) for pair in pairs)]
    spreads = (Spread(outcome.times[name]) for name in TIMES)
    table.push(*start, *spreads, outcome.error, *ratios, rounds)
