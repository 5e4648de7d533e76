"""MKL Pardiso on K11: matrix type 2, symmetric positive definite, called without a wrapper."""

import ctypes
import sys
from pathlib import Path

import numpy as np

from lines import dgemm_gflops, serve, timed_ms
from problem import Problem

ANALYSE, FACTOR, SOLVE, RELEASE = 11, 22, 33, -1
POSITIVE_DEFINITE = 2

library = ctypes.CDLL(str(next(Path(sys.prefix, "lib").glob("libmkl_rt.so*"))))


def address(array):
    return array.ctypes.data_as(ctypes.c_void_p)


def integer(value):
    return ctypes.byref(ctypes.c_int32(value))


class Pardiso:
    """Upper triangle by rows, counted from 0; all parameters but that one are MKL's defaults."""

    def __init__(self, problem):
        self.problem = problem
        self.handle = np.zeros(64, dtype=np.int64)
        self.parameters = np.zeros(64, dtype=np.int32)
        library.pardisoinit(
            address(self.handle), integer(POSITIVE_DEFINITE), address(self.parameters)
        )
        self.parameters[34] = 1

    def call(self, phase, b=None, x=None):
        problem, nothing = self.problem, np.zeros(1)
        columns = 1 if b is None or b.ndim == 1 else b.shape[1]
        error = ctypes.c_int32(0)
        library.pardiso(
            address(self.handle), integer(1), integer(1), integer(POSITIVE_DEFINITE),
            integer(phase), integer(problem.n), address(problem.value),
            address(problem.row_start), address(problem.column), address(nothing),
            integer(columns), address(self.parameters), integer(0),
            address(nothing if b is None else b), address(nothing if x is None else x),
            ctypes.byref(error),
        )
        if error.value != 0:
            raise RuntimeError(f"Pardiso, phase {phase}: error {error.value}")


def load(folder):
    global problem
    problem = Problem(folder)
    return {}


def run(method):
    pardiso = Pardiso(problem)
    single, wide = np.empty(problem.n), np.empty_like(problem.b)
    b = problem.b[:, 0].copy()
    order_ms, _ = timed_ms(pardiso.call, ANALYSE)
    factor_ms, _ = timed_ms(pardiso.call, FACTOR)
    solve_ms, _ = timed_ms(pardiso.call, SOLVE, b, single)
    solve_wide_ms, _ = timed_ms(pardiso.call, SOLVE, problem.b, wide)
    pardiso.call(RELEASE)
    problem.write_answers(single, wide)
    return {
        "order_ms": order_ms,
        "factor_ms": factor_ms,
        "solve_ms": solve_ms,
        "solve_wide_ms": solve_wide_ms,
    }


def dgemm(size):
    a, c, n, one = np.ones((size, size)), np.zeros((size, size)), integer(size), ctypes.c_double(1)
    library.dgemm(
        b"N", b"N", n, n, n, ctypes.byref(one), address(a), n, address(a), n, ctypes.byref(one),
        address(c), n,
    )


def about():
    text = ctypes.create_string_buffer(200)
    library.mkl_get_version_string(text, 200)
    version = text.value.decode().replace("Intel(R) ", "").strip().split(" for ")[0]
    return {"versions": [version], "dgemm": {"MKL": dgemm_gflops(dgemm)}}


problem = None
serve({"load": load, "run": run, "about": about})
