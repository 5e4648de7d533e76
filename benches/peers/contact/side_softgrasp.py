"""Our side of the lift: contact frames of a server, by the Python client."""

import contextlib
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "clients" / "python" / "src"))

from softgrasp import (  # noqa: E402
    Body, ContactStep, Material, Mesh, Model, ObjectState, Plane, Pose, Server, Sphere,
)

from softgrasp.program import ServerProgram  # noqa: E402

import task  # noqa: E402
from task import Frame, Outcome  # noqa: E402

STAGES = ("decode", "assemble", "order", "factor", "solve", "encode")


class Softgrasp:
    """A mesh in a server; every scene begins at rest on the table."""

    def __init__(self, program, mesh, large):
        self.mesh = mesh
        self.large = large
        self.density = task.MASS / mesh.volume
        self.program = ServerProgram(program, threads=2)
        self.server = Server(self.program.address)
        model = Model(mesh, Material(task.YOUNG, task.POISSON), "t4")
        self.kept = self.server.keep(model)

    def close(self):
        self.server.close()
        self.program.end()

    def step(self):
        """As `run --grasp contact` asks: what is asked for, and how much effort it is worth."""
        return ContactStep(
            seconds=1.0 / task.RATE_HZ, density=self.density, viscosity=task.VISCOSITY,
            penetration_rel=1e-6, residual_rel=1e-4 if self.large else 1e-6, rounds_max=12,
            newton_max=80, deformation="large" if self.large else None,
        )

    def cpu_time_ms(self):
        """What the threads of the server have computed so far."""
        found = 0.0
        for path in Path(f"/proc/{self.program.pid}/task").glob("*/schedstat"):
            with contextlib.suppress(OSError):
                found += float(path.read_text().split()[0]) * 1e-6
        return found

    def play(self, scene):
        mesh, step = self.mesh, self.step()
        middle = centre(mesh)
        state, frames = ObjectState(), []
        for number in range(scene.frames):
            bodies = [table(scene), *tips(scene, number)]
            cpu, start = self.cpu_time_ms(), time.perf_counter()
            answer = self.kept.contact_frame(state, bodies, step, nodes=mesh.boundary_nodes)
            call_ms = (time.perf_counter() - start) * 1e3
            state = answer.state
            stages, contact, forces = answer.report.stage_ms, answer.contact, answer.loads.forces
            frames.append(Frame(
                ms=sum(getattr(stages, name) for name in STAGES),
                height=float(state.pose.to_world(middle[None])[0, 2]),
                tips=scene.tips(number + 1) - forces[1:] / task.SPRING,
                forces=forces[1:],
                table=float(forces[0, 2]),
                penetration=contact.penetration_max,
                more={
                    "call_ms": call_ms, "cpu_ms": self.cpu_time_ms() - cpu,
                    "residual_rel": contact.residual_rel,
                    "converged": contact.is_converged, "points": int(answer.loads.contacts.sum()),
                    "elastic_rel": answer.report.residual_rel,
                },
            ))
        return Outcome(frames, scene)


def centre(mesh):
    """Centre of mass at rest: a quarter of each tetrahedron at each of its corners."""
    corners = mesh.points[mesh.tets]
    edges = corners[:, 1:] - corners[:, :1]
    volumes = np.abs(np.linalg.det(edges))
    return (volumes[:, None] * corners.mean(axis=1)).sum(axis=0) / volumes.sum()


def table(scene):
    return Body(Plane((0.0, 0.0, 1.0)), friction=scene.friction)


def tips(scene, number):
    for begin, end in zip(scene.tips(number), scene.tips(number + 1)):
        yield Body(
            Sphere(task.TIP), Pose(tuple(begin)), Pose(tuple(end)), friction=scene.friction,
            compliance=1.0 / task.SPRING,
        )
