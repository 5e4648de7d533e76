"""Time steps of MuJoCo's flex on a mesh that Softgrasp wrote, scaled to an edge of one metre."""

import mujoco
import numpy as np

from lines import serve, timed_ms
from problem import Problem

MODEL = """
<mujoco>
  <option timestep="{step_s}" gravity="0 {gravity} 0" integrator="{integrator}"/>
  <worldbody>
    <flexcomp name="body" type="direct" dim="3" radius="0.001" mass="{mass}"
              point="{points}" element="{elements}">
      <contact selfcollide="none" contype="0" conaffinity="0"/>
      <edge equality="false"/>
      <elasticity young="{young}" poisson="{poisson}" damping="{damping}"/>
      <pin id="{held}"/>
    </flexcomp>
  </worldbody>
</mujoco>
"""
# Explicit steps are short for the smallest tetrahedra's sake. Implicit ones of 1/60 s would do, but
# from 3375 nodes on MuJoCo then warns that its linear solve does not converge.
INTEGRATORS = {"explicit": ("Euler", 1e-3, 1e-3), "implicit": ("discrete", 4e-3, 2e-2)}


def text(values):
    return " ".join(f"{value:.12g}" for value in np.ravel(values))


def load(folder, method, scene):
    global problem, rest, model, data
    problem = Problem(folder)
    rest = problem.array("vertex.f64").reshape((-1, 3)) * scene["scale"]
    integrator, step_s, damping = INTEGRATORS[method]
    xml = MODEL.format(
        step_s=step_s, gravity=-scene["gravity_m_s2"], integrator=integrator,
        mass=scene["mass_kg"], points=text(rest), elements=text(problem.array("tet.u32")),
        young=scene["young_pa"], poisson=scene["poisson"], damping=damping,
        held=text(problem.array("held.u32")),
    )
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    return {}


def steps(count):
    times = [timed_ms(mujoco.mj_step, model, data)[0] for _ in range(count)]
    moved = data.flexvert_xpos - rest
    moved.astype("<f8").tofile(problem.folder / "moved.f64")
    return {"step_ms": times, "step_s": model.opt.timestep}


def about():
    return {"versions": [f"MuJoCo {mujoco.__version__}"]}


problem = rest = model = data = None
serve({"load": load, "steps": steps, "about": about})
