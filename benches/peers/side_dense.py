"""LAPACK on K11 as a dense matrix: potrf with potrs, and potrf with potri (the inverse)."""

import numpy as np
import scipy
import threadpoolctl
from scipy.linalg import blas, lapack

from lines import dgemm_gflops, serve, timed_ms
from problem import Problem


def load(folder):
    global problem
    problem = Problem(folder)
    return {}


def fill():
    """Lower triangle of K11, by columns."""
    k11 = np.zeros((problem.n, problem.n), order="F")
    columns = np.repeat(np.arange(problem.n), np.diff(problem.row_start))
    k11[problem.column, columns] = problem.value
    return k11


def done(outcome):
    matrix, info = outcome
    if info != 0:
        raise RuntimeError(f"LAPACK: info {info}")
    return matrix


def factor(k11):
    return done(lapack.dpotrf(k11, lower=1, clean=0, overwrite_a=1))


def invert(k11):
    return done(lapack.dpotri(factor(k11), lower=1, overwrite_c=1))


def run(method):
    # As in our methods, the numbers are put into the dense matrix within the time of the factor.
    b = problem.b[:, 0].copy()
    if method == "potrf":
        factor_ms, matrix = timed_ms(lambda: factor(fill()))
        solve_ms, single = timed_ms(lambda: done(lapack.dpotrs(matrix, b, lower=1)))
        solve_wide_ms, wide = timed_ms(lambda: done(lapack.dpotrs(matrix, problem.b, lower=1)))
    else:
        factor_ms, matrix = timed_ms(lambda: invert(fill()))
        solve_ms, single = timed_ms(blas.dsymv, 1.0, matrix, b, lower=1)
        solve_wide_ms, wide = timed_ms(blas.dsymm, 1.0, matrix, problem.b, lower=1)
    problem.write_answers(single, wide)
    return {
        "order_ms": 0.0,
        "factor_ms": factor_ms,
        "solve_ms": solve_ms,
        "solve_wide_ms": solve_wide_ms,
    }


def dgemm(size):
    blas.dgemm(1.0, np.ones((size, size), order="F"), np.ones((size, size), order="F"))


def about():
    for library in threadpoolctl.threadpool_info():
        if library["internal_api"] == "openblas" and "scipy.libs" in library["filepath"]:
            name = f"OpenBLAS {library['version']} ({library['architecture']} kernels)"
            return {
                "versions": [f"SciPy {scipy.__version__}", f"{name} for LAPACK"],
                "dgemm": {"OpenBLAS for LAPACK": dgemm_gflops(dgemm)},
            }
    raise RuntimeError("SciPy is not built with OpenBLAS: install it from the package index")


problem = None
serve({"load": load, "run": run, "about": about})
