"""CHOLMOD on K11: supernodal, ordered by METIS, its dense kernels from OpenBLAS."""

import ctypes
import re
import subprocess

import numpy as np
import scipy.sparse
import sksparse
import threadpoolctl
from sksparse import cholmod

from lines import dgemm_gflops, serve, timed_ms
from problem import Problem


def load(folder):
    global problem, k11
    problem = Problem(folder)
    # The upper triangle by rows is the lower one by columns, which is what CHOLMOD reads.
    arrays = (problem.value, problem.column, problem.row_start)
    k11 = scipy.sparse.csc_matrix(arrays, shape=(problem.n, problem.n))
    k11.has_sorted_indices = True
    return {}


def run(method):
    order_ms, factor = timed_ms(
        cholmod.analyze, k11, mode="supernodal", ordering_method="metis", use_long=False
    )
    factor_ms, _ = timed_ms(factor.cholesky_inplace, k11)
    b = problem.b[:, 0].copy()
    solve_ms, single = timed_ms(factor.solve_A, b)
    solve_wide_ms, wide = timed_ms(factor.solve_A, problem.b)
    problem.write_answers(single, wide)
    return {
        "order_ms": order_ms,
        "factor_ms": factor_ms,
        "solve_ms": solve_ms,
        "solve_wide_ms": solve_wide_ms,
    }


def system_openblas():
    """The OpenBLAS that CHOLMOD was linked with, not the one inside numpy."""
    for library in threadpoolctl.threadpool_info():
        if library["internal_api"] == "openblas" and "site-packages" not in library["filepath"]:
            return library
    raise RuntimeError("CHOLMOD is not linked with OpenBLAS: install libopenblas-dev")


def dgemm(size):
    library = ctypes.CDLL(system_openblas()["filepath"])
    n, one = ctypes.byref(ctypes.c_int(size)), ctypes.byref(ctypes.c_double(1))
    a, c = np.ones((size, size)), np.zeros((size, size))
    a_at, c_at = a.ctypes.data_as(ctypes.c_void_p), c.ctypes.data_as(ctypes.c_void_p)
    library.dgemm_(b"N", b"N", n, n, n, one, a_at, n, a_at, n, one, c_at, n)


def package_version(name):
    shown = subprocess.run(["dpkg-query", "-W", name], capture_output=True, text=True).stdout
    return re.split(r"\s+", shown.strip())[-1] or "of unknown version"


def about():
    blas = system_openblas()
    openblas = f"OpenBLAS {blas['version']} ({blas['architecture']} kernels)"
    return {
        "versions": [
            f"SuiteSparse {package_version('libsuitesparse-dev')} (CHOLMOD)",
            f"METIS {package_version('libmetis5')}",
            f"scikit-sparse {sksparse.__version__}",
            f"{openblas} for CHOLMOD",
        ],
        "dgemm": {"OpenBLAS for CHOLMOD": dgemm_gflops(dgemm)},
    }


problem = k11 = None
serve({"load": load, "run": run, "about": about})
