"""The words of the report."""

import task

TASK = f"""
**Read this first.** MuJoCo and Rapier are made to move many bodies at once and to go on whatever
happens; ours moves one soft body and says how far each step is from the law. A rigid ball is another
model than a soft one: it has no dent, and nothing about the ball's stiffness can be learnt from it.
Where only the lift matters, a rigid ball does it, and far faster.

A ball of {2e3 * task.RADIUS:g} mm (Young's modulus {task.YOUNG / 1e3:g} kPa, Poisson's ratio
{task.POISSON:g}, {1e3 * task.MASS:.1f} g, which is {task.DENSITY:g} kg/m³ for a round one) lies on a
table. Two spheres of {1e3 * task.TIP:g} mm radius, opposite each other, close in a second, wait for
half a second, rise by {1e3 * task.LIFT:g} mm in a second and hold for ten seconds (three
where a side is slow: see `frames`); friction is {task.FRICTION:g} everywhere. A spring of
{task.SPRING:g} N/m holds each sphere where it should be, in all three directions: ours has that as
`compliance`; MuJoCo's springs are position actuators and Rapier's are joint motors, on spheres of
{1e3 * task.TIP_MASS:g} g without weight and with critical damping. How far the fingers close is found for each
side by trial, so that the normal force of each, when they have closed, is the same for all:

- `firm`: 2 N, which holds 1.82 times the weight by friction, `2 μ N / m g`;
- `near the limit`: 1.3 times. A soft ball hangs some millimetres below its fingers, which then press
  it down by a tenth of their force: nearer to 1 it must slide, and does;
- `too little`: 0.8 times. The ball must stay on the table.

All soft balls are one mesh, node for node: a round surface that `glove-client fill` filled. Those
of MuJoCo and Rapier lie 0.2 mm further inside, which is the thickness of their skin. Masses of the
nodes are equal in MuJoCo's flex, a quarter of each tetrahedron elsewhere. The viscosity of ours and
of the flex is {task.VISCOSITY:g} s; Rapier has a damping ratio instead, which stays 1. Young's
modulus and Poisson's ratio are the same; the laws are linear elasticity and `neo-hookean` (ours),
Saint Venant and Kirchhoff's (MuJoCo), corotational (Rapier, in double precision).
"""

SPEEDS = """
A frame is a sixtieth of a second: one step of ours, and as many steps of the others as
`steps_per_frame` says. `p50`, `p99` and `slowest` are of all frames of lift and hold, as the median
(smallest..largest) of the rounds; `slowest_closing` is that of the frames in which the fingers
close. `cpu_p50` is the median of what the processors together computed for a frame. Ours is the time in the server, by its own report;
`call_p50` is the time of the whole call from Python over TCP, search for triangles included. The
others are timed around their own step, in the same process, MuJoCo on one thread, Rapier and ours
on two.

**These times were taken beside other work of the machine** (the load is in the head): where a frame takes
more than some milliseconds, the clock counts what others computed meanwhile, and `cpu_p50` is the better
figure. Times are of this run; the order of magnitude is what they say.
"""

RESULTS = """
`rise` is from before the lift to the end; a ball that is lifted hangs below its fingers by the springs
and, if it is soft, by its own shear. `sink` and `slip` are of the hold after its first two seconds: how fast the centre of
mass sinks, and how far the ball goes down along its fingers; both should be 0, and a negative one
rises. `penetration_max` is the depth of the deepest point of the surface in a fingertip or in the
table in any frame, for a soft ball measured on its triangles (the flex of MuJoCo: as it tells it), for a
rigid one between the centres. `indentation` is how much nearer a fingertip is to the centre than it
would be without any dent, while it holds. `balance_error` is the largest difference between all
forces and the weight while it holds; the forces of MuJoCo and ours are told by them, those of Rapier are the
springs'. `residual_rel_max` is the residual of the law of Signorini and Coulomb over the largest force, which
only ours tells, and `steps_not_met` how many steps told that they do not meet what was asked for
(linear 1e-6, large deformation 1e-4, penetration 1e-6 of the ball).
"""

TRIED = """
These are on top of the settings of the rows above that are not called "as it comes"; the hold is three seconds.
"""

PICTURE = """
![Time of a frame against how fast the held ball sinks or rises, of all that lift it firmly. What moves slower than the scale lies on its lower edge.](contact-peers.svg)

Time of a frame against how fast the held ball sinks or rises, of all that lift it firmly. What moves slower than the scale lies on its lower edge.
"""


def findings(speeds, results):
    """What the tables say, in sentences."""
    def fast(side, nodes=None):
        found = [one["p50_ms"].median for one in speeds
                 if one["side"] == side and nodes in (None, one["nodes"])]
        return f"{found[0]:.2g} ms" if found else "not measured"

    def firm(side, name):
        found = [one[name] for one in results
                 if one["side"] == side and one["case"] == "firm" and one[name] is not None]
        return found[0] if found else float("nan")

    nodes = min(one["nodes"] for one in results if one["side"] == "Softgrasp, linear")
    ours, large = "Softgrasp, linear", "Softgrasp, large deformation"
    two = "MuJoCo flex, quadratic, 2 × 2 × 2 cells"
    one = "MuJoCo flex, quadratic, one cell"
    return f"""
- **Rigid balls are the fastest, and hold.** Rapier's takes {fast("Rapier, rigid")} for a frame and as little as
  0.01 ms with fewer steps (last table), MuJoCo's {fast("MuJoCo, rigid")}; with {nodes} nodes ours takes
  {fast(ours, nodes)} by linear elasticity and {fast(large, nodes)} at large deformation. Rapier's rigid ball does
  not sink at all; MuJoCo's sinks {firm("MuJoCo, rigid", "sink_m_per_s"):.1e} m/s with `noslip`.
- **As they come, their contacts are too soft for this task.** MuJoCo's give way by two millimetres and the
  ball slips out; Rapier lifts it with fingertips that are
  {1e3 * firm("Rapier, rigid, as it comes", "penetration_max_m"):.1f} mm deep in it. Settings cure both.
- **Soft balls**: ours slips {abs(firm(ours, "slip_m")):.0e} m in eight seconds by linear elasticity and
  {abs(firm(large, "slip_m")):.0e} m at large deformation. MuJoCo's flex of one quadratic cell sinks
  {firm(one, "sink_m_per_s"):.0e} m/s when it is held firmly and slides out near the limit; with 2 × 2 × 2 cells it
  sinks {firm(two, "sink_m_per_s"):.0e} m/s. Its friction is regularised, and `noslip`, which
  cures the rigid ball, is refused with a flex. With every node of the mesh free, MuJoCo's flex and Rapier's soft ball
  (constraints) slid out of the fingers, where `force_on_table` is what two tries to meet the force came to. We did
  not find settings by which they lift in the time that we gave to it; that is no proof that there are none, and their
  makers may know them.
- **Time of soft balls**: {fast(one)} for MuJoCo's one cell and {fast(two)} for 2 × 2 × 2 cells, against
  {fast(ours, nodes)} (linear) and {fast(large, nodes)} (large deformation) of ours on the same surface. One cell has 81
  degrees of freedom and is too stiff: its dent is a third of ours. Where every node is free the processors
  compute some 70 ms for a frame of the others on the coarser mesh and hundreds on the finer. They carry the waves in the ball and its inertia, which ours leaves out.
- **Penetration** is about a micrometre at most by our law; with the best settings of the others some micrometres
  to tens of micrometres for rigid balls, tens and more for soft ones.
- **Where the ball must slide, no side lifts it.**
- **Ours is not always converged.** `steps_not_met` counts the steps that said so; they are in the closing of the fingers.
- **The dent depends on the mesh**: the finer one is softer by a quarter under the same force, since the contact is
  no larger than an element or two of the coarse one. Hertz's formula, for bodies that are large against their
  contact, gives {1e3 * task.hertz(2.0):.1f} mm for 2 N without the far field of the ball; ours on the finer mesh is nearest to that.

What was not measured: Rapier's FEM solver through a whole lift (half a second for a frame on this machine), Rapier in single precision,
MuJoCo's flex of the finer mesh in a lift, the acceleration of a ball that slides (spring and shear of a soft ball hide it in the first
tenths of a second).
"""
