"""Direct solvers on the same K11: sparse ones on all problems, dense ones on the smallest."""

import sys
from dataclasses import dataclass

from page import Spread, Table, processor_maker, ratio
from problem import COLUMNS, error_rel
from sides import take_turns

# Largest error with which a time is reported, relative to the largest displacement.
ERROR_ALLOWED = 1e-8
# The same for what is single precision to the end.
ERROR_ALLOWED_SINGLE = 1e-2
TIMES = ("order_ms", "factor_ms", "solve_ms", "solve_wide_ms")

SPARSE = (
    ("front", "ours", "front"),
    ("front-mixed", "ours", "front-mixed"),
    ("front, factor alone", "ours", "bare-front"),
    ("front, over the wire", "wire", "front"),
    ("front-mixed, over the wire", "wire", "front-mixed"),
    ("sparse-cholesky", "ours", "sparse-cholesky"),
    ("MKL Pardiso", "pardiso", "llt"),
    ("MKL Pardiso, single, refined in double", "pardiso", "llt-single-refined"),
    ("MKL Pardiso, single, own refinement", "pardiso", "llt-single"),
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
peers run with their default parameters, in double precision where nothing else is said: Pardiso with
matrix type 2, CHOLMOD supernodal with METIS on degrees of freedom. `front`, `front-mixed` and
`sparse-cholesky` (which runs on one thread) answer through `Factored::solve`: their solves hold the
right-hand side, residual, refinement and reactions; their {COLUMNS} are `Factored::solve_several`, all
together with the two over fronts, one after another with `sparse-cholesky`. `front,
factor alone` is substitution with the factor and nothing else. `over the wire` is a frame to a server
on a model and a factor that it keeps, refinement and transport included, {COLUMNS} of them one after
another; order and factor are those that the first frame reports. Pardiso in single precision
(iparm(28) = 1) is measured twice: refined by the program that calls it, with residuals in double, as
`front-mixed` is, until corrections are below 1e-13 or eight steps are made; and with its own
refinement in extended accumulation (iparm(8) = -2), which ends at single precision's digits.

`error rel` is the worst over rounds and right-hand sides of the largest difference to a solution
refined with residuals in twice the working precision, over the largest displacement; a time with an
error above {ERROR_ALLOWED:g} is not reported ({ERROR_ALLOWED_SINGLE:g} for what is single precision to the end). The ratios are peer over `front`: above 1, `front` is
faster; `all over front` is order, factor and one solve together. On a machine with other work
(see the load in the head) threads that wait for each other by turning lose more than threads that
sleep or take other tasks, so such a run is unfair to Pardiso and to everything on OpenBLAS.
"""

# Pairs that are compared like with like: ours, theirs, and what is compared.
CLAIMS = (
    ("front", "MKL Pardiso", "one"),
    ("front-mixed", "MKL Pardiso, single, refined in double", "one"),
    ("front", "MKL Pardiso", "21"),
    ("front-mixed", "MKL Pardiso, single, refined in double", "21"),
    ("front, over the wire", "MKL Pardiso", "21 frames"),
    ("front-mixed, over the wire", "MKL Pardiso, single, refined in double", "21 frames"),
)

# Measured on a machine that this report does not run on today.
ELSEWHERE = """
### The same on a processor by AMD, quoted

The run of this report on an AMD EPYC, two cores, 24 GiB, 2026-11-23, with the order of METIS that
`front` had then. All its pairs are in [peers-amd.csv](peers-amd.csv).

| problem | what | ours | ms | theirs | ms | ours over theirs |
| :-- | :-- | :-- | --: | :-- | --: | --: |
| cube 10648 | one | front | 294 | MKL Pardiso | 519 | 0.546 |
| cube 10648 | one | front-mixed | 197 | MKL Pardiso, single, refined in double | 435 | 0.449 |
| cube 10648 | 21 | front | 69.7 | MKL Pardiso | 192 | 0.361 |
| cube 10648 | 21 | front-mixed | 213 | MKL Pardiso, single, refined in double | 1385 | 0.159 |
| cube 21952 | one | front | 1121 | MKL Pardiso | 2378 | 0.482 |
| cube 21952 | one | front-mixed | 718 | MKL Pardiso, single, refined in double | 1687 | 0.424 |
| cube 21952 | 21 | front | 167 | MKL Pardiso | 536 | 0.301 |
| cube 21952 | 21 | front-mixed | 611 | MKL Pardiso, single, refined in double | 3472 | 0.175 |
"""


def claims_text():
    maker = processor_maker()
    return f"""
### Like with like, on a processor by {maker}

Ours over theirs: below 1 ours is faster. `one` is order, analysis, factor and one solve, refinement
included on our side (Pardiso's default refines only where it perturbed a pivot). `21` is {COLUMNS}
right-hand sides on a factor that is there, in one call on both sides, refined on ours. `21 frames` is
the same for ours by {COLUMNS} requests to a server over a loopback socket, one after another, with
refinement, all displacements sent back, against the one call of Pardiso. The library is by Intel, the processor of this run by {maker}.
"""


def push_claims(table, problem, outcomes):
    """One row for each pair whose answers are right."""
    maker = processor_maker()
    for ours, theirs, what in CLAIMS:
        pair = outcomes[ours], outcomes[theirs]
        if not all(outcome.is_right() for outcome in pair):
            continue
        values = [o.all_ms() if what == "one" else o.times["solve_wide_ms"] for o in pair]
        times = [Spread(v) for v in values]
        errors = [outcome.error for outcome in pair]
        table.push(maker, problem, what, ours, theirs, *times, ratio(*values), *errors)


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
    allowed: float = ERROR_ALLOWED

    def is_right(self):
        return self.error is not None and self.error <= self.allowed

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
    claims = Table("Ours over theirs", [
        "processor", "problem", "what", "ours", "theirs", "ours_ms", "theirs_ms", "ours_over_theirs",
        "error_ours_rel", "error_theirs_rel",
    ])
    for name, request in problems:
        head, outcomes = measure(sides, folder / name, request, SPARSE, options)
        for label, outcome in outcomes.items():
            push(table, label, name, head, outcome, outcomes["front"])
        push_claims(claims, name, outcomes)
    like_with_like = [claims_text(), claims] if claims.rows else []
    return [SPARSE_TEXT, table, *like_with_like, ELSEWHERE]


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


def ask_to_run(sides, side, method):
    """The same program answers in process and over the wire."""
    if side == "wire":
        return sides["ours"].ask("over-wire", method=method)
    return sides[side].ask("run", method=method)


def measure(sides, folder, request, competitors, options):
    """Makes a problem, lets everybody read it, and lets them take turns."""
    print(f"peers: {folder.name}", file=sys.stderr)
    ask = request["ask"]
    about = {key: value for key, value in request.items() if key != "ask"}
    head = sides["ours"].ask(ask, folder=str(folder), **about)
    if head["reference_settled_rel"] > 1e-15:
        sys.exit(f"peers: the right answer of {folder.name} did not settle: "
                 f"{head['reference_settled_rel']:g}")
    for side in {side for _, side, _ in competitors} - {"ours", "wire"}:
        sides[side].ask("load", folder=str(folder))

    def competitor(side, method):
        def run():
            times = ask_to_run(sides, side, method)
            return times, error_rel(folder)
        return run

    runs = [competitor(side, method) for _, side, method in competitors]
    rounds, budget_s = (2, 10) if options.quick else (9, 75)
    outcomes = {}
    for (label, _, _), results in zip(competitors, take_turns(rounds, budget_s, runs)):
        times = {name: [one[name] for one, _ in results] for name in TIMES}
        errors = [error for _, error in results]
        allowed = ERROR_ALLOWED_SINGLE if "own refinement" in label else ERROR_ALLOWED
        outcomes[label] = Outcome(times, None if None in errors else max(errors), allowed)
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
