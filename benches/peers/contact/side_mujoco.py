"""MuJoCo's side of the lift: a rigid ball, or a flex on the mesh of ours."""

import time

import mujoco
import numpy as np

import task
from task import Frame, Outcome

MODEL = """
<mujoco>
  <option timestep="{step_s}" gravity="0 0 {gravity}" integrator="{integrator}" cone="{cone}"
          impratio="{impratio}" solver="{solver}" iterations="{iterations}"
          tolerance="{tolerance}" noslip_iterations="{noslip}" noslip_tolerance="1e-10"/>
  <size memory="400M"/>
  <worldbody>
    <geom name="table" type="plane" size="1 1 0.1" contype="0" conaffinity="1" {surface}/>
    {tips}
    {ball}
  </worldbody>
  <actuator>{springs}</actuator>
</mujoco>
"""
TIP = """
<body name="tip{side}" gravcomp="1" pos="{place}">
  <inertial pos="0 0 0" mass="{mass}" diaginertia="1e-6 1e-6 1e-6"/>
  <joint name="x{side}" type="slide" axis="1 0 0"/>
  <joint name="y{side}" type="slide" axis="0 1 0"/>
  <joint name="z{side}" type="slide" axis="0 0 1"/>
  <geom type="sphere" size="{radius}" contype="0" conaffinity="1" {surface}/>
</body>
"""
RIGID = """
<body name="ball" pos="0 0 {radius}">
  <freejoint/>
  <geom type="sphere" size="{radius}" mass="{mass}" contype="1" conaffinity="1" {surface}/>
</body>
"""
FLEX = """
<flexcomp name="ball" type="direct" dim="3" radius="{skin}" mass="{mass}" point="{points}"
          element="{elements}" {dof}>
  <contact selfcollide="none" contype="1" conaffinity="1" {surface}/>
  <edge equality="false"/>
  <elasticity young="{young}" poisson="{poisson}" damping="{damping}"/>
</flexcomp>
"""
# As MuJoCo comes, but for the step.
USUAL = {
    "step_s": 1 / 480, "integrator": "implicitfast", "cone": "pyramidal", "impratio": 1.0,
    "solver": "Newton", "iterations": 100, "tolerance": 1e-8, "noslip": 0, "condim": 3,
    "solref": "0.02 1", "solimp": "0.9 0.95 0.001 0.5 2",
}


def text(values):
    return " ".join(f"{value:.12g}" for value in np.ravel(values))


class MuJoCo:
    """A way to simulate the task; `mesh` is None for a rigid ball."""

    def __init__(self, mesh=None, dof="", skin=2e-4, **settings):
        self.mesh, self.dof, self.skin = mesh, dof, skin
        self.settings = {**USUAL, **settings}

    def model(self, scene):
        settings = self.settings
        surface = (
            f'friction="{scene.friction} 0.003 0.0001" condim="{settings["condim"]}" '
            f'solref="{settings["solref"]}" solimp="{settings["solimp"]}"'
        )
        common = {"surface": surface, "mass": task.MASS, "radius": task.RADIUS}
        if self.mesh is None:
            ball = RIGID.format(**common)
        else:
            # The skin is part of the ball: its nodes lie so much further inside.
            middle = np.array([0.0, 0.0, task.RADIUS])
            points = middle + (self.mesh.points - middle) * (1.0 - self.skin / task.RADIUS)
            ball = FLEX.format(
                **common, skin=self.skin, points=text(points), elements=text(self.mesh.tets),
                dof=self.dof, young=task.YOUNG, poisson=task.POISSON,
                damping=task.VISCOSITY,
            )
        places = scene.tips(0)
        tips = "".join(
            TIP.format(side=side, place=text(places[side]), mass=task.TIP_MASS, radius=task.TIP,
                       surface=surface)
            for side in range(2)
        )
        springs = "".join(
            f'<position joint="{axis}{side}" kp="{task.SPRING}" kv="{task.TIP_DAMPING}"/>'
            for side in range(2) for axis in "xyz"
        )
        return mujoco.MjModel.from_xml_string(MODEL.format(
            gravity=-task.GRAVITY, tips=tips, ball=ball, springs=springs, surface=surface,
            **settings,
        ))

    def play(self, scene):
        model = self.model(scene)
        data = mujoco.MjData(model)
        substeps = round(1.0 / task.RATE_HZ / model.opt.timestep)
        first = np.array([model.joint(f"x{side}").dofadr[0] for side in range(2)])
        dofs = first[:, None] + np.arange(3)
        weights = self.weights(model)
        places, frames = scene.tips(0), []
        for number in range(scene.frames):
            begin, end = scene.tips(number) - places, scene.tips(number + 1) - places
            spent = cpu = 0.0
            for step in range(1, substeps + 1):
                data.ctrl[:] = (begin + (end - begin) * step / substeps).ravel()
                start, cpu_start = time.perf_counter(), time.thread_time()
                mujoco.mj_step(model, data)
                spent += time.perf_counter() - start
                cpu += time.thread_time() - cpu_start
            height = self.height(data, weights)
            depths = [0.0] if data.ncon == 0 else -data.contact.dist
            forces = -data.qfrc_constraint[dofs]
            frames.append(Frame(
                ms=spent * 1e3, height=height,
                tips=places + data.qpos[dofs_to_places(model, dofs)], forces=forces,
                table=self.table_force(model, data, forces),
                penetration=float(np.max(depths)),
                more={
                    "points": data.ncon, "warnings": data.warning[INERTIA].number,
                    "cpu_ms": cpu * 1e3,
                },
            ))
            if not np.isfinite(height) or any(data.warning[k].number for k in UNSTABLE):
                frames[-1].height = float("nan")
                break
        return Outcome(frames, scene)

    def weights(self, model):
        """Share of the mass at each node; None for a rigid ball."""
        if self.mesh is None:
            return None
        return np.full(model.nflexvert, 1.0 / model.nflexvert)

    def height(self, data, weights):
        if weights is None:
            return float(data.body("ball").xipos[2])
        return float(weights @ data.flexvert_xpos[:, 2])

    def table_force(self, model, data, forces):
        """Upwards, N: of all contacts with the table."""
        total, wrench = 0.0, np.zeros(6)
        plane = 0
        for number in range(data.ncon):
            contact = data.contact[number]
            if plane in (contact.geom[0], contact.geom[1]):
                mujoco.mj_contactForce(model, data, number, wrench)
                total += float(contact.frame.reshape(3, 3).T[2] @ wrench[:3]) * (
                    1.0 if contact.geom[0] == plane else -1.0
                )
        return total


# Its warnings are counted by `MjData`; those of a flex would fill the screen.
mujoco.set_mju_user_warning(lambda text: None)
INERTIA = mujoco.mjtWarning.mjWARN_INERTIA
UNSTABLE = (
    mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)


def dofs_to_places(model, dofs):
    """Addresses in `qpos` of slide joints with these degrees of freedom."""
    return model.jnt_qposadr[model.dof_jntid[dofs]]
