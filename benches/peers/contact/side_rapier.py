"""Rapier's side of the lift: asks the program in the folder `rapier`."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np

import task
from depth import deepest
from task import Frame, Outcome

HERE = Path(__file__).resolve().parent
TARGET = HERE / "rapier" / "target"
SETTINGS = (
    "solver_iterations", "pgs_iterations", "stabilization_iterations", "length_unit",
    "contact_frequency", "contact_damping_ratio", "factored_dofs", "linear_iterations",
    "linear_tolerance",
)


def build():
    run = ["cargo", "build", "--release", "--quiet", "--locked"]
    environment = {**os.environ, "CARGO_TARGET_DIR": str(TARGET)}
    subprocess.run(run, cwd=HERE / "rapier", env=environment, check=True)


class Program:
    """The process that plays scenes."""

    def __init__(self):
        path = TARGET / "release" / "softgrasp-peer-rapier-lift"
        self.process = subprocess.Popen(
            [path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, ask, **request):
        self.process.stdin.write(json.dumps({"ask": ask, **request}) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise RuntimeError(f"Rapier ended when it was asked to {ask}")
        return json.loads(answer)

    def close(self):
        self.process.stdin.close()
        self.process.wait(timeout=60)


class Rapier:
    """A way to simulate the task; `mesh` is None for a rigid ball."""

    def __init__(self, program, mesh=None, solver="fem", damping_ratio=1.0, skin=2e-4, substeps=1,
                 **settings):
        self.program, self.mesh, self.skin = program, mesh, skin
        self.settings = {"substeps": substeps, **dict.fromkeys(SETTINGS), **settings}
        self.soft = None
        if mesh is not None:
            middle = np.array([0.0, 0.0, task.RADIUS])
            points = middle + (mesh.points - middle) * (1.0 - skin / task.RADIUS)
            self.soft = {
                "points": points.tolist(), "tets": mesh.tets.tolist(),
                "masses": masses(mesh).tolist(), "young": task.YOUNG, "poisson": task.POISSON,
                "solver": solver, "damping_ratio": damping_ratio, "skin": skin,
            }

    def play(self, scene):
        moments = range(scene.frames + 1)
        told = self.program.ask(
            "play", mass=task.MASS, radius=task.RADIUS, soft=self.soft, friction=scene.friction,
            tips=[scene.tips(frame).tolist() for frame in moments],
            tip={
                "radius": task.TIP, "mass": task.TIP_MASS, "stiffness": task.SPRING,
                "damping": task.TIP_DAMPING,
            },
            settings=self.settings,
        )["frames"]
        return Outcome([self.frame(scene, k, one) for k, one in enumerate(told)], scene)

    def frame(self, scene, number, told):
        tips = np.array(told["tips"])
        # What the springs say: right as long as nothing moves.
        forces = task.SPRING * (scene.tips(number + 1) - tips)
        height = told["height"] if told["height"] is not None else float("nan")
        if self.mesh is None:
            middle = np.array([0.0, 0.0, height])
            away = np.linalg.norm(tips - middle, axis=1).min()
            depth = max(task.RADIUS + task.TIP - away, task.RADIUS - height, 0.0)
        else:
            points = np.array(told["points"], dtype=float)
            depth = deepest(points, self.mesh.boundary, tips, self.skin)
        return Frame(told["ms"], height, tips, forces, 0.0, depth, {"cpu_ms": told["cpu_ms"]})


def masses(mesh):
    """A quarter of each tetrahedron at each of its corners, kg."""
    corners = mesh.points[mesh.tets]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    found = np.zeros(len(mesh.points))
    np.add.at(found, mesh.tets.ravel(), np.repeat(volumes, 4))
    return task.MASS * found / found.sum()
