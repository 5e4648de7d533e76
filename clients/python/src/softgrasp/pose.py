"""Poses of rigid bodies: a place, and a turn as a unit quaternion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats, floats, vector


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a body is: turns coordinates of its own frame into those of the world.

    Raises `ValueError` for numbers that are not finite and a quaternion of length 0.
    """

    place: Floats
    """Where the origin of the body's frame is, m: x, y, z."""
    turn: Floats
    """Unit quaternion w, x, y, z."""

    def __init__(
        self, place: ArrayLike = (0.0, 0.0, 0.0), turn: ArrayLike = (1.0, 0.0, 0.0, 0.0)
    ) -> None:
        object.__setattr__(self, "place", vector(place, "the place of a pose"))
        given = floats(turn, "the turn of a pose")
        if given.shape != (4,):
            raise ValueError(f"the turn of a pose is a quaternion w, x, y, z, not {given}")
        length = math.hypot(*given)
        if not 0.0 < length < math.inf:
            raise ValueError("the turn of a pose is a quaternion of a length above 0")
        # A turn that a server gave is given back to the bit.
        is_unit = abs(length - 1.0) < 1e-14
        object.__setattr__(self, "turn", given if is_unit else given / length)

    @classmethod
    def about(cls, axis: ArrayLike, angle: float, place: ArrayLike = (0.0, 0.0, 0.0)) -> Pose:
        """A turn by an angle (rad) about an axis, and a place."""
        direction = vector(axis, "the axis of a turn")
        length = float(np.linalg.norm(direction))
        if length == 0.0:
            raise ValueError("the axis of a turn has a length above 0")
        half = np.sin(angle / 2.0) / length * direction
        return cls(place, (float(np.cos(angle / 2.0)), *half))

    @classmethod
    def from_numbers(cls, given: Floats) -> Pose:
        """The pose in seven numbers, place first."""
        return cls(given[:3], given[3:])

    @property
    def numbers(self) -> Floats:
        """Seven numbers: x, y, z, then w, x, y, z of the turn."""
        return np.concatenate([self.place, self.turn])

    @property
    def matrix(self) -> Floats:
        """The turn as a rotation matrix, (3, 3)."""
        w, x, y, z = self.turn
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def to_world(self, points: ArrayLike) -> Floats:
        """Points of the body's frame in the world, m; shape (points, 3)."""
        return np.asarray(points, dtype=float) @ self.matrix.T + self.place

    def to_body(self, points: ArrayLike) -> Floats:
        """Points of the world in the body's frame, m; shape (points, 3)."""
        moved: Floats = np.asarray(points, dtype=float) - self.place
        return moved @ self.matrix
