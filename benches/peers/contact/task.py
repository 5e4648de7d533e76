"""The task that every side is given: a ball on a table, two fingertips, a lift and a hold."""

import math
from dataclasses import dataclass, field

import numpy as np

# The ball: radius, m; Young's modulus, Pa; Poisson's ratio; kg. Its mass is that of the round ball,
# whatever volume a mesh of it has.
RADIUS = 0.035
YOUNG = 5.0e4
POISSON = 0.4
DENSITY = 1000.0
MASS = DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
GRAVITY = 9.81
WEIGHT = MASS * GRAVITY
# Time in which the shape forgets a force (Kelvin and Voigt), s, where a side has such a number.
VISCOSITY = 0.02
FRICTION = 0.8
# A fingertip: radius, m; a spring of so many N/m in every direction holds it where it should be.
TIP = 0.008
SPRING = 1000.0
# Of a side whose fingertips have mass, kg, and the damping of their springs, N s/m (critical).
TIP_MASS = 0.01
TIP_DAMPING = 2.0 * math.sqrt(SPRING * TIP_MASS)
# Frames: the ball settles, the fingers close, wait, lift, hold.
RATE_HZ = 60
SETTLE, CLOSE, WAIT, RAISE, HOLD = 30, 60, 30, 60, 600
READY = SETTLE + CLOSE + WAIT
LIFT = 0.04
# Distance of a fingertip from the ball before it closes, m.
BEGIN = 0.003
# How far off a force may be after the last depth that is tried, relative.
ROUGH = 0.5
# Frames of the hold that pass before creep is measured: the swing of the lift dies away.
REST = 120


def smooth(share):
    """From 0 to 1, slowly at both ends."""
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


@dataclass
class Scene:
    """Where the springs of the fingertips hold them, and what lasts how long."""

    depth: float
    friction: float = FRICTION
    raise_frames: int = RAISE
    hold_frames: int = HOLD
    # Frames after which the scene ends, if it does not go on to its end.
    stop: int | None = None

    @property
    def frames(self):
        return self.stop or READY + self.raise_frames + self.hold_frames

    def tips(self, frame):
        """Where the springs hold the fingertips when a frame begins; shape (2, 3)."""
        closed = smooth((frame - SETTLE) / CLOSE)
        away = RADIUS + TIP + BEGIN - closed * (BEGIN + self.depth)
        raised = 0.0
        if self.raise_frames:
            raised = LIFT * smooth((frame - READY) / self.raise_frames)
        return np.array([[-away, 0.0, RADIUS + raised], [away, 0.0, RADIUS + raised]])


@dataclass
class Frame:
    """What a side tells about one frame."""

    ms: float
    # Height of the centre of mass; places of the tips and their forces on the ball; N of the table.
    height: float
    tips: np.ndarray
    forces: np.ndarray
    table: float
    # Depth of the deepest point, m, as the side tells it.
    penetration: float
    more: dict = field(default_factory=dict)


@dataclass
class Outcome:
    """What came of a scene."""

    frames: list
    scene: Scene

    @property
    def is_finite(self):
        return all(math.isfinite(f.height) and abs(f.height) < 10.0 for f in self.frames)

    def times(self, first, last):
        return [frame.ms for frame in self.frames[first:last]]

    @property
    def hold(self):
        """Frames of the hold after its rest."""
        return self.frames[-(self.scene.hold_frames - REST):]

    def squeeze(self):
        """Mean normal force of the fingertips when they have closed and waited, N."""
        return normal(self.frames[READY - 1])

    def sink(self):
        """How fast the ball sinks while it is held, m/s."""
        heights = [frame.height for frame in self.hold]
        return (heights[0] - heights[-1]) * RATE_HZ / (len(heights) - 1)

    def slip(self):
        """How far the ball goes down along the fingertips during the same time, m."""
        along = [frame.height - frame.tips[:, 2].mean() for frame in self.hold]
        return along[0] - along[-1]

    def rise(self):
        """How much higher the ball is at the end than before the lift, m."""
        return self.frames[-1].height - self.frames[READY - 1].height

    def penetration(self):
        """Of all frames since the fingers touch."""
        return max(frame.penetration for frame in self.frames[SETTLE:])

    def indentation(self):
        """How much nearer the tips are to the centre than they would be without a dent, m."""
        frame = self.hold[-1]
        return RADIUS + TIP - (frame.tips[1, 0] - frame.tips[0, 0]) / 2.0

    def balance(self):
        """Largest difference between forces and weight while the ball is held, relative."""
        def off(frame):
            total = frame.forces.sum(axis=0) + [0.0, 0.0, frame.table - WEIGHT]
            return float(np.linalg.norm(total)) / WEIGHT
        return max(off(frame) for frame in self.hold)


def normal(frame):
    """Mean of the fingertips' forces along the line that joins them, N."""
    return float((frame.forces[0, 0] - frame.forces[1, 0]) / 2.0)


def hertz(force):
    """Depth of a dent by Hertz under a force between ball and rigid tip, m."""
    modulus = YOUNG / (1.0 - POISSON**2)
    round_radius = 1.0 / (1.0 / RADIUS + 1.0 / TIP)
    return (0.75 * force / (modulus * math.sqrt(round_radius))) ** (2.0 / 3.0)


def depth_for(side, force, tolerance, tries, depth=None):
    """How far the tips must close for a normal force; None where that leads to no force.

    The rule of the secant, within what is known to be too little and too much.
    """
    low, high = (0.0, 0.0), None
    depth = depth or force / SPRING + (0.0 if side.mesh is None else 0.7 * hertz(force))
    best = None
    for _ in range(tries):
        outcome = side.play(Scene(depth, raise_frames=0, hold_frames=0))
        if not outcome.is_finite:
            return None
        found = (depth, outcome.squeeze())
        if best is None or abs(found[1] - force) < abs(best[1] - force):
            best = found
        if abs(found[1] - force) < tolerance * force:
            break
        low, high = (found, high) if found[1] < force else (low, found)
        if high is None:
            depth += max((force - found[1]) / SPRING, 0.1 * depth)
        elif high[1] <= low[1]:
            depth = (low[0] + high[0]) / 2.0
        else:
            share = (force - low[1]) / (high[1] - low[1])
            depth = low[0] + min(max(share, 0.05), 0.95) * (high[0] - low[0])
    return best[0] if abs(best[1] - force) < ROUGH * force else None
