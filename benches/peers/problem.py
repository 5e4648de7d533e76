"""A problem as the Rust side wrote it: little-endian arrays, one file each."""

from pathlib import Path

import numpy as np

COLUMNS = 21


class Problem:
    """Upper triangle of K11 by rows (which is the lower one by columns), right-hand sides, mesh."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.row_start = self.array("row_start.u32").astype(np.int32)
        self.column = self.array("column.u32").astype(np.int32)
        self.value = self.array("value.f64")
        self.n = len(self.row_start) - 1
        self.b = self.array("b.f64").reshape((COLUMNS, self.n)).T

    def array(self, name):
        kind = {"f64": "<f8", "u32": "<u4"}[name.rsplit(".", 1)[1]]
        return np.fromfile(self.folder / name, dtype=kind)

    def write_answers(self, single, wide):
        """The answer to the first column alone, then those to all."""
        columns = np.concatenate([np.reshape(single, (1, self.n)), np.asarray(wide).T])
        np.ascontiguousarray(columns).tofile(self.folder / "answer.f64")


def error_rel(folder):
    """Largest difference to the right answers over the largest right value, worst column.

    None if an answer is not finite or incomplete. The file is gone afterwards, so that no side can
    be judged by the answers of another.
    """
    right = np.fromfile(folder / "right.f64").reshape((COLUMNS, -1))
    answer = np.fromfile(folder / "answer.f64")
    (folder / "answer.f64").unlink()
    if answer.size != right.size + right.shape[1] or not np.isfinite(answer).all():
        return None
    answer = answer.reshape((COLUMNS + 1, -1))
    right = np.concatenate([right[:1], right])
    return float((abs(answer - right).max(axis=1) / abs(right).max(axis=1)).max())
