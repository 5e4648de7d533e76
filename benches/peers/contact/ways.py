"""Every way in which the task is done, with its settings."""

from dataclasses import dataclass, field

from side_mujoco import MuJoCo
from side_rapier import Rapier
from side_softgrasp import Softgrasp

# Hard contacts for MuJoCo, and its integrator that takes stiffness implicitly.
FIRM = {
    "integrator": "discrete", "cone": "elliptic", "solimp": "0.99 0.999 0.0001 0.5 2",
    "solref": "0.005 1", "tolerance": 1e-12, "impratio": 1000.0,
}
# With an elliptic cone its forces jump from step to step and its fingers slip off.
EVERY_NODE = {
    **FIRM, "solver": "CG", "cone": "pyramidal", "impratio": 10.0, "tolerance": 1e-10,
}
# Contacts of Rapier that are stiffer than they come, and tolerances for things of this size.
STIFF = {"length_unit": 0.1, "substeps": 4, "solver_iterations": 16, "contact_frequency": 1000.0}
SOFT = {"length_unit": 0.1, "contact_frequency": 240.0}


@dataclass
class Way:
    """A side with settings; `slow` ones are held for a shorter time, and play fewer cases."""

    name: str
    settings: str
    make: object
    nodes: int
    steps: int
    slow: bool = False
    cases: tuple = ("firm", "near the limit", "too little")
    # Rounds of the firm case that are timed.
    rounds: int = 3
    # How far the fingers close at the first try, m, by case.
    depths: dict = field(default_factory=dict)


def rigid_ways(program):
    """Rigid balls, as they are recommended here."""
    return [
        Way("MuJoCo, rigid, as it comes",
            "steps of 1/480 s, all else as it comes", MuJoCo, 1, 8),
        Way("MuJoCo, rigid",
            "`discrete`, elliptic cone, `impratio` 1000, `solref` 0.005 1, `solimp` 0.99 0.999 "
            "0.0001, Newton, 20 `noslip` iterations, steps of 1/480 s",
            lambda: MuJoCo(noslip=20, **FIRM), 1, 8),
        Way("Rapier, rigid, as it comes", "steps of 1/60 s with 4 solver iterations",
            lambda: Rapier(program), 1, 1),
        Way("Rapier, rigid",
            "steps of 1/240 s with 16 solver iterations, contact frequency 1000 Hz, length unit "
            "0.1",
            lambda: Rapier(program, **STIFF), 1, 4),
    ]


def our_ways(server, meshes):
    """Ours on each mesh: linear elasticity, and large deformation."""
    def way(mesh, large):
        name = "Softgrasp, large deformation" if large else "Softgrasp, linear"
        asked = "1e-4" if large else "1e-6"
        return Way(name, f"one step of 1/60 s, residual {asked}, as a run asks",
                   lambda: Softgrasp(server, mesh, large), mesh.node_count, 1,
                   rounds=1, slow=large and mesh.node_count > 2000,
                   cases=("firm",) if large and mesh.node_count > 2000 else Way.cases)
    return [way(mesh, large) for mesh in meshes for large in (False, True)]


def soft_ways(program, meshes):
    """Soft balls of the others."""
    small, large = meshes
    cells = [
        ("one cell", 'dof="quadratic"'),
        ("2 × 2 × 2 cells", 'dof="quadratic" cellcount="2 2 2"'),
    ]
    settings = "`discrete`, elliptic, `impratio` 1000, `solref` 0.005 1, Newton, steps of 1/480 s"
    ways = [
        Way(f"MuJoCo flex, quadratic, {name}", settings,
            lambda dof=dof: MuJoCo(small, dof=dof, **{**FIRM, "tolerance": 1e-10}),
            small.node_count, 8, rounds=1)
        for name, dof in cells
    ]
    every = (
        "`discrete`, pyramidal, `impratio` 10, `solref` 0.005 1, CG with 100 iterations, "
        "steps of 1/480 s"
    )
    ways.append(Way("Rapier, soft, constraints",
                    "steps of 1/60 s with 16 solver iterations, contact frequency 240 Hz",
                    lambda: Rapier(program, small, "constraints", solver_iterations=16, **SOFT),
                    small.node_count, 1, slow=True, rounds=1,
                    cases=("firm",), depths={"firm": 0.008}))
    ways.append(Way("MuJoCo flex, every node", every,
                    lambda: MuJoCo(small, **EVERY_NODE), small.node_count, 8, slow=True, rounds=1,
                    cases=("firm",), depths={"firm": 0.007}))
    ways.append(Way("Rapier, soft, FEM",
                    "steps of 1/60 s with 4 solver iterations, contact frequency 240 Hz",
                    lambda: Rapier(program, small, "fem", **SOFT), small.node_count, 1,
                    slow=True, rounds=1, cases=()))
    ways.append(Way("Rapier, soft, constraints",
                    "steps of 1/60 s with 16 solver iterations, contact frequency 240 Hz",
                    lambda: Rapier(program, large, "constraints", solver_iterations=16, **SOFT),
                    large.node_count, 1, slow=True, rounds=1, cases=()))
    ways.append(Way("MuJoCo flex, every node", every,
                    lambda: MuJoCo(large, **EVERY_NODE), large.node_count, 8, slow=True, rounds=1,
                    cases=()))
    ways.append(Way("Rapier, soft, constraints, 4 inner iterations",
                    "the same with 4 inner iterations",
                    lambda: Rapier(program, small, "constraints", solver_iterations=16,
                                   pgs_iterations=4, **SOFT),
                    small.node_count, 1, slow=True, rounds=1,
                    cases=("firm", "too little"), depths={"firm": 0.0072, "too little": 0.0035}))
    return ways


def tried_ways(program, mesh):
    """What else was tried, on firm and near the limit."""
    def mujoco(text, **settings):
        return Way("MuJoCo, rigid", text, lambda: MuJoCo(**{**FIRM, **settings}), 1,
                   round(1.0 / 60.0 / settings.get("step_s", 1 / 480)))

    def rapier(text, **settings):
        return Way("Rapier, rigid", text, lambda: Rapier(program, **{**STIFF, **settings}), 1,
                   settings.get("substeps", 4))

    def flex(text, **settings):
        return Way("MuJoCo flex, quadratic, one cell", text,
                   lambda: MuJoCo(mesh, dof='dof="quadratic"',
                                  **{**FIRM, "tolerance": 1e-10, **settings}),
                   mesh.node_count, round(1.0 / 60.0 / settings.get("step_s", 1 / 480)))
    return [
        mujoco("no `noslip`"), mujoco("no `noslip`, `impratio` 100", impratio=100.0),
        mujoco("no `noslip`, `impratio` 10", impratio=10.0),
        mujoco("`implicitfast`, 20 `noslip`", integrator="implicitfast", noslip=20),
        mujoco("`condim` 4", condim=4), mujoco("CG, 20 `noslip`", solver="CG", noslip=20),
        mujoco("pyramidal cone, 20 `noslip`", cone="pyramidal", noslip=20),
        mujoco("steps of 1/240 s, `solref` 0.0085 1, 20 `noslip`", step_s=1 / 240,
               solref="0.0085 1", noslip=20),
        mujoco("steps of 1/960 s, `solref` 0.0025 1, 20 `noslip`", step_s=1 / 960,
               solref="0.0025 1", noslip=20),
        rapier("contact frequency 240 Hz", contact_frequency=240.0),
        rapier("240 Hz, steps of 1/60 s, 16 iterations", contact_frequency=240.0, substeps=1),
        rapier("240 Hz, steps of 1/60 s, 4 iterations", contact_frequency=240.0, substeps=1,
               solver_iterations=4),
        rapier("240 Hz, damping ratio 1", contact_frequency=240.0, contact_damping_ratio=1.0),
        rapier("1000 Hz, 4 iterations of 4", pgs_iterations=4, solver_iterations=4),
        flex("`impratio` 10", impratio=10.0), flex("`impratio` 1", impratio=1.0),
        flex("pyramidal cone, CG", cone="pyramidal", solver="CG"),
        flex("steps of 1/960 s, `solref` 0.0025 1", step_s=1 / 960, solref="0.0025 1"),
    ]
