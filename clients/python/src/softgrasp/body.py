"""Rigid bodies that an object touches: shapes, motions in a step, and how near a point is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import F64, U32, Floats, Numbers, floats, numbers, positive, vector
from .pose import Pose


@dataclass(frozen=True)
class Sphere:
    """A ball around the origin."""

    radius: float
    """Its radius, m, above 0."""

    def distance(self, points: Floats) -> Floats:
        """Distance of points of the body's frame, m; negative inside."""
        away: Floats = np.linalg.norm(points, axis=1) - self.radius
        return away


@dataclass(frozen=True)
class Capsule:
    """All within a radius of a segment along z that is centred at the origin."""

    radius: float
    """The radius, m, above 0."""
    length: float
    """Length of the segment, m."""

    def distance(self, points: Floats) -> Floats:
        """Distance of points of the body's frame, m; negative inside."""
        half = self.length / 2.0
        axis = np.zeros_like(points)
        axis[:, 2] = np.clip(points[:, 2], -half, half)
        away: Floats = np.linalg.norm(points - axis, axis=1) - self.radius
        return away


@dataclass(frozen=True)
class Plane:
    """The half space behind a plane through the origin."""

    normal: ArrayLike = (0.0, 0.0, 1.0)
    """Out of the half space that is solid."""

    def distance(self, points: Floats) -> Floats:
        """Distance of points of the body's frame, m; negative inside."""
        normal = vector(self.normal, "the normal of a plane")
        return points @ (normal / np.linalg.norm(normal))


@dataclass(frozen=True)
class Box:
    """A box around the origin."""

    half: ArrayLike
    """Half its edges, m: x, y, z."""
    radius: float = 0.0
    """Radius of its edges and corners, which are rounded within its sizes, m; 0 leaves them sharp.
    Contact with rounded ones converges better. Above 0 it needs the capability `rounded-bodies`."""

    def distance(self, points: Floats) -> Floats:
        """Distance of points of the body's frame, m; 0 or below inside."""
        inner = vector(self.half, "half the edges of a box") - self.radius
        outside = np.maximum(np.abs(points) - inner, 0.0)
        away: Floats = np.linalg.norm(outside, axis=1) - self.radius
        return away


@dataclass(frozen=True, eq=False)
class ClosedSurface:
    """The inside of a closed surface of triangles, counter-clockwise seen from outside."""

    points: Floats
    """Corners, m; shape (corners, 3)."""
    triangles: Numbers
    """Corners of each triangle; shape (triangles, 3)."""
    radius: float
    """All points within this radius of the inside belong to it, m: its edges are rounded; 0 leaves them
    sharp. Contact with rounded ones converges better. Above 0 it needs the capability `rounded-bodies`."""

    def __init__(self, points: ArrayLike, triangles: ArrayLike, radius: float = 0.0) -> None:
        object.__setattr__(self, "radius", radius)
        object.__setattr__(self, "points", floats(points, "corners", 3))
        object.__setattr__(self, "triangles", numbers(triangles, "triangles", 3))
        if not len(self.triangles) or int(self.triangles.max()) >= len(self.points):
            raise ValueError("a surface has triangles, and each names corners that are there")

    def distance(self, points: Floats) -> Floats:
        """Distance of points of the body's frame from the box around the surface, m."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        outside = np.maximum(np.maximum(low - points, points - high), 0.0)
        away: Floats = np.linalg.norm(outside, axis=1) - self.radius
        return away


Shape: TypeAlias = Sphere | Capsule | Plane | Box | ClosedSurface
"""The shape of a rigid body, in a frame of its own."""


@dataclass(frozen=True)
class Body:
    """A rigid body and its motion in one step."""

    shape: Shape
    """Its shape."""
    start: Pose = field(default_factory=Pose)
    """Pose in the world when the step begins."""
    end: Pose | None = None
    """Pose when it ends; None for a body that rests."""
    friction: float = 0.5
    """Coefficient of Coulomb's friction with the object."""
    compliance: float = 0.0
    """How far the body gives way to a force, m/N; 0 for one that keeps to its poses."""

    @property
    def at_end(self) -> Pose:
        """Pose when the step ends."""
        return self.start if self.end is None else self.end

    @property
    def way(self) -> float:
        """How far a point of the body moves in the step at most, m; of a plane its origin."""
        moved = float(np.linalg.norm(self.at_end.place - self.start.place))
        half = min(1.0, abs(float(self.start.turn @ self.at_end.turn)))
        return moved + 2.0 * float(np.arccos(half)) * _reach(self.shape)


def body_arrays(bodies: Sequence[Body]) -> tuple[NDArray[Any], ...]:
    """Kinds, numbers, radii of rounded bodies, and sizes, corners and triangles of the surfaces, as they
    travel."""
    kinds: list[int] = []
    rows: list[Floats] = []
    radii: list[float] = []
    surfaces: list[ClosedSurface] = []
    for body in bodies:
        kind, sizes = _kind_and_sizes(body.shape)
        if _is_rounded(body.shape):
            radii.append(body.shape.radius)
        if isinstance(body.shape, ClosedSurface):
            surfaces.append(body.shape)
        poses = (body.start.numbers, body.at_end.numbers)
        rows.append(np.concatenate([sizes, *poses, [body.friction, body.compliance]]))
        kinds.append(kind)
    counts = [[len(surface.points), len(surface.triangles)] for surface in surfaces]
    return (
        np.array(kinds, dtype=U32),
        np.array(rows, dtype=F64).reshape(-1, 19),
        np.array(radii, dtype=F64),
        np.array(counts, dtype=U32),
        np.concatenate([np.zeros((0, 3)), *(surface.points for surface in surfaces)]),
        np.concatenate([np.zeros((0, 3), U32), *(surface.triangles for surface in surfaces)]),
    )


def body_needs(bodies: Sequence[Body]) -> frozenset[str]:
    """Capabilities of a server that the shapes of bodies need."""
    return frozenset({"rounded-bodies"} if any(_is_rounded(body.shape) for body in bodies) else ())


def _is_rounded(shape: Shape) -> TypeGuard[Box | ClosedSurface]:
    return isinstance(shape, Box | ClosedSurface) and shape.radius != 0.0


def _reach(shape: Shape) -> float:
    """Largest distance of a point of a shape from its origin, m; 0 for a plane."""
    if isinstance(shape, Sphere):
        return shape.radius
    if isinstance(shape, Capsule):
        return shape.radius + shape.length / 2.0
    if isinstance(shape, Box):
        return float(np.linalg.norm(vector(shape.half, "half the edges of a box")))
    if isinstance(shape, ClosedSurface):
        return float(np.linalg.norm(shape.points, axis=1).max()) + shape.radius
    return 0.0


def _kind_and_sizes(shape: Shape) -> tuple[int, Floats]:
    if isinstance(shape, Sphere):
        return 0, np.array([positive(shape.radius, "a radius"), 0.0, 0.0])
    if isinstance(shape, Capsule):
        return 1, np.array([positive(shape.radius, "a radius"), shape.length, 0.0])
    if isinstance(shape, Plane):
        return 2, vector(shape.normal, "the normal of a plane")
    if isinstance(shape, Box):
        return 5 if _is_rounded(shape) else 3, vector(shape.half, "half the edges of a box")
    return 6 if _is_rounded(shape) else 4, np.zeros(3)
