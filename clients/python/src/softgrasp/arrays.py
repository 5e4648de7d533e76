"""Arrays of numbers as they travel: their types, and checks of what a caller gives."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
"""Numbers in double precision."""
Numbers: TypeAlias = NDArray[np.uint32]
"""Numbers of nodes, degrees of freedom or regions; they count from 0."""

U32 = np.dtype("<u4")
F32 = np.dtype("<f4")
F64 = np.dtype("<f8")
NO_NUMBERS: Numbers = np.zeros(0, dtype=U32)
NO_FLOATS: Floats = np.zeros(0, dtype=F64)


def floats(values: ArrayLike, what: str, width: int | None = None) -> Floats:
    """`values` as double precision, one behind the other; with `width`, rows of so many.

    Raises `ValueError`, naming `what`, if the shape is another or a value is not finite.
    """
    try:
        array = np.ascontiguousarray(values, dtype=F64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} must be numbers: {error}") from error
    if width is not None:
        if array.size and (array.ndim != 2 or array.shape[1] != width):
            raise ValueError(f"{what} must have the shape (n, {width}), not {array.shape}")
        array = array.reshape(-1, width)
    elif array.ndim != 1:
        raise ValueError(f"{what} must have one dimension, not the shape {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{what} must be finite numbers")
    return array


def numbers(values: ArrayLike, what: str, width: int | None = None) -> Numbers:
    """`values` as whole numbers of 32 bits; with `width`, rows of so many.

    A mask of truth values stands for the positions at which it is true. Raises `ValueError`,
    naming `what`, if the shape is another or a value is negative, no whole number or too large.
    """
    array = np.asarray(values)
    if array.dtype == U32 and array.flags.c_contiguous:
        pass
    elif array.dtype == np.bool_ and array.ndim == 1:
        array = np.flatnonzero(array).astype(U32)
    elif array.size == 0:
        array = np.zeros(0, dtype=U32)
    else:
        if array.dtype.kind not in "iu":
            raise ValueError(f"{what} must be whole numbers, not {array.dtype}")
        if array.min() < 0 or array.max() > 0xFFFF_FFFF:
            raise ValueError(f"{what} must lie between 0 and 2³² − 1")
        array = np.ascontiguousarray(array, dtype=U32)
    if width is not None:
        if array.size and (array.ndim != 2 or array.shape[1] != width):
            raise ValueError(f"{what} must have the shape (n, {width}), not {array.shape}")
        return array.reshape(-1, width)
    if array.ndim == 0:
        return array.reshape(1)
    if array.ndim != 1:
        raise ValueError(f"{what} must have one dimension, not the shape {array.shape}")
    return array


def vector(values: ArrayLike, what: str) -> Floats:
    """Three finite numbers. Raises `ValueError`, naming `what`."""
    array = floats(values, what)
    if array.shape != (3,):
        raise ValueError(f"{what} must be three numbers, not {array.size}")
    return array


def positive(value: Any, what: str) -> float:
    """A finite number above 0. Raises `ValueError`, naming `what`."""
    number = float(value)
    if not (np.isfinite(number) and number > 0.0):
        raise ValueError(f"{what} must be a finite number above 0, not {value!r}")
    return number
