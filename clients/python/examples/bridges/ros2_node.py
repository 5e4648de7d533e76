"""A soft object as a ROS 2 node: fingertips in, its shape and their forces out.

    python ros2_node.py --ros-args -p mesh:=liver.msh -p scale:=0.001

Takes `fingertips` (geometry_msgs/PoseArray, metres, in the frame `object_world`, any number of spheres
of the parameter `radius`), plays one step of contact with friction and weight on a table for each, and
publishes `surface` (visualization_msgs/Marker, triangles) and, for each fingertip, the force that it
feels, `force_0`, `force_1`, … (geometry_msgs/WrenchStamped, newtons at the fingertip's centre).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import softgrasp
from softgrasp import Body, ContactStep, ObjectState, Plane, Pose, Sphere


@dataclass(frozen=True)
class Felt:
    """What a step has come to: corners of the surface's triangles, m, and forces on the tips, N."""

    triangles: np.ndarray
    forces: np.ndarray


class SoftObject:
    """An object on a table that spheres press; no word of ROS here, so that it can be tried alone."""

    def __init__(
        self, server: softgrasp.Server, mesh: softgrasp.Mesh, material: softgrasp.Material
    ) -> None:
        self.mesh = mesh
        self.kept = server.keep(softgrasp.Model(mesh, material))
        self.state = ObjectState(Pose((0.0, 0.0, 0.0)))
        self.table = Body(Plane((0.0, 0.0, 1.0)), Pose((0.0, 0.0, mesh.bounds[0][2])), friction=0.6)
        self.tips: np.ndarray = np.zeros((0, 3))

    def step(self, tips: np.ndarray, radius: float, seconds: float) -> Felt:
        """Moves the fingertips to new places (n, 3), m, within so many seconds."""
        before = self.tips if self.tips.shape == tips.shape else tips
        ways = zip(before, tips, strict=True)
        fingers = [
            Body(Sphere(radius), Pose(tuple(old)), Pose(tuple(new)), friction=0.8)
            for old, new in ways
        ]
        self.tips = tips
        how = ContactStep(seconds=seconds, density=1000.0, viscosity=0.01)
        bodies = [self.table, *fingers]
        nodes = self.mesh.boundary_nodes
        answer = self.kept.contact_frame(self.state, bodies, how, nodes=nodes)
        self.state = answer.state
        places = self.state.places(self.mesh)
        # What acts on a finger is the opposite of what acts on the object.
        return Felt(places[self.mesh.boundary], -np.asarray(answer.loads.forces)[1:])


def spin(arguments: list[str]) -> None:
    """Runs the node until it is shut down."""
    import rclpy
    from geometry_msgs.msg import Point, PoseArray, WrenchStamped
    from rclpy.node import Node
    from visualization_msgs.msg import Marker

    rclpy.init(args=arguments)
    node = Node("softgrasp")
    for name, value in (("mesh", ""), ("scale", 1.0), ("radius", 0.008), ("rate", 60.0)):
        node.declare_parameter(name, value)
    for name, value in (("young", 20_000.0), ("poisson", 0.4)):
        node.declare_parameter(name, value)

    def value(name: str):
        return node.get_parameter(name).value

    mesh = softgrasp.Mesh.read(Path(value("mesh")), value("scale"))
    material = softgrasp.Material(value("young"), value("poisson"))
    shape = node.create_publisher(Marker, "surface", 1)
    forces: list = []
    with softgrasp.Server.spawn() as server:
        soft = SoftObject(server, mesh, material)

        def heard(message: PoseArray) -> None:
            tips = np.array([[p.position.x, p.position.y, p.position.z] for p in message.poses])
            felt = soft.step(tips.reshape(-1, 3), value("radius"), 1.0 / value("rate"))
            marker = Marker(header=message.header, type=Marker.TRIANGLE_LIST)
            marker.scale.x = marker.scale.y = marker.scale.z = 1.0
            marker.color.r = marker.color.a = 1.0
            corners = felt.triangles.reshape(-1, 3)
            marker.points = [Point(x=x, y=y, z=z) for x, y, z in corners.tolist()]
            shape.publish(marker)
            while len(forces) < len(tips):
                topic = f"force_{len(forces)}"
                forces.append(node.create_publisher(WrenchStamped, topic, 1))
            for publisher, (x, y, z) in zip(forces, felt.forces.tolist(), strict=False):
                wrench = WrenchStamped(header=message.header)
                wrench.wrench.force.x, wrench.wrench.force.y, wrench.wrench.force.z = x, y, z
                publisher.publish(wrench)

        # The newest fingertips count: older ones that wait are of no use.
        node.create_subscription(PoseArray, "fingertips", heard, 1)
        rclpy.spin(node)
    rclpy.shutdown()


if __name__ == "__main__":
    spin(sys.argv)
