"""MKL Pardiso on K11: matrix type 2, symmetric positive definite, called without a wrapper."""

import ctypes
import sys
from pathlib import Path

import numpy as np

from lines import dgemm_gflops, serve, timed_ms
from problem import Problem
from scipy.sparse import csr_array

ANALYSE, FACTOR, SOLVE, RELEASE = 11, 22, 33, -1
POSITIVE_DEFINITE = 2

library = ctypes.CDLL(str(next(Path(sys.prefix, "lib").glob("libmkl_rt.so*"))))


def address(array):
    return array.ctypes.data_as(ctypes.c_void_p)


def integer(value):
    return ctypes.byref(ctypes.c_int32(value))


# Refinement ends when a correction is this small, or after so many steps.
CORRECTION_GOOD, STEPS_MAX = 1e-13, 8


class Pardiso:
    """Upper triangle by rows, counted from 0; all parameters but that one are MKL's defaults.

    In single precision matrix, right-hand sides and answers are of four bytes (iparm(28) = 1), and
    refinement is Pardiso's own, two steps with extended accumulation (iparm(8) = -2).
    """

    def __init__(self, problem, is_single=False):
        self.problem = problem
        self.kind = np.float32 if is_single else np.float64
        self.value = problem.value.astype(self.kind)
        self.handle = np.zeros(64, dtype=np.int64)
        self.parameters = np.zeros(64, dtype=np.int32)
        library.pardisoinit(
            address(self.handle), integer(POSITIVE_DEFINITE), address(self.parameters)
        )
        self.parameters[34] = 1
        if is_single:
            self.parameters[27] = 1
            self.parameters[7] = -2

    def call(self, phase, b=None, x=None):
        problem, nothing = self.problem, np.zeros(1, dtype=self.kind)
        columns = 1 if b is None or b.ndim == 1 else b.shape[1]
        error = ctypes.c_int32(0)
        library.pardiso(
            address(self.handle), integer(1), integer(1), integer(POSITIVE_DEFINITE),
            integer(phase), integer(problem.n), address(self.value),
            address(problem.row_start), address(problem.column), address(nothing),
            integer(columns), address(self.parameters), integer(0),
            address(nothing if b is None else b), address(nothing if x is None else x),
            ctypes.byref(error),
        )
        if error.value != 0:
            raise RuntimeError(f"Pardiso, phase {phase}: error {error.value}")

    def solve(self, b):
        """Columns of answers to columns of right-hand sides."""
        b = np.asfortranarray(b, dtype=self.kind)
        x = np.empty_like(b)
        self.call(SOLVE, b, x)
        return x

    def solve_refined(self, matrix, b):
        """The same with residuals in double precision, scaled to stay in single precision's range."""
        x = np.zeros(b.shape, order="F")
        residual = b
        for _ in range(STEPS_MAX + 1):
            scale = np.maximum(np.abs(residual).max(axis=0), np.finfo(np.float64).tiny)
            correction = self.solve(residual / scale) * scale
            x += correction
            if np.abs(correction).max() <= CORRECTION_GOOD * np.abs(x).max():
                break
            residual = b - matrix @ x
        return x


def load(folder):
    global problem
    problem = Problem(folder)
    return {}


def whole_matrix(problem):
    """Both triangles, for products."""
    upper = csr_array((problem.value, problem.column, problem.row_start), (problem.n,) * 2)
    lower = upper.T.tocsr()
    lower.setdiag(0.0)
    return (upper + lower).tocsr()


def run(method):
    pardiso = Pardiso(problem, is_single=method.startswith("llt-single"))
    is_refined = method.endswith("-refined")
    matrix = whole_matrix(problem) if is_refined else None

    def solve(b):
        return pardiso.solve_refined(matrix, b) if is_refined else pardiso.solve(b)

    order_ms, _ = timed_ms(pardiso.call, ANALYSE)
    factor_ms, _ = timed_ms(pardiso.call, FACTOR)
    solve_ms, single = timed_ms(solve, problem.b[:, 0])
    solve_wide_ms, wide = timed_ms(solve, problem.b)
    single, wide = single.astype(np.float64), wide.astype(np.float64)
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
