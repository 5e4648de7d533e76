"""Derivatives of a quantity by all that it depends on, by one more solve with the same factor.

A quantity J of displacements u and reactions R, linear elasticity, K u = f. The adjoint λ has the load
∂J/∂u where u is free and the displacement −∂J/∂R where u is prescribed; with its reactions r,

    ∂J/∂f = λ,    ∂J/∂(prescribed u) = ∂J/∂u − r,    ∂J/∂p = λᵀ (∂f/∂p) − λᵀ (∂K/∂p) u

for a number p of a load, a material or the place of a node: of linear tetrahedra ∂K/∂p and ∂f/∂p are
known in closed form. This needs nothing of the server but answers; with the capability `gradients` it
answers derivatives itself, at large deformation too (`Quantity`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .answer import Answer
from .arrays import F64, U32, Floats, Numbers
from .load_case import LoadCase
from .mesh import Mesh
from .model import Material, Model
from .quantity import Gradient


class GradientQuestion:
    """What the derivatives at a load case are made of: two answers, then arithmetic.

    `adjoint` is the load case to be answered in any case, `needs_answer` says whether the answer to
    the case itself is needed too. See `KeptModel.gradient`.
    """

    def __init__(
        self,
        model: Model,
        fixed_dofs: Numbers,
        case: LoadCase,
        by_displacements: ArrayLike | None,
        by_reactions: ArrayLike | None,
    ) -> None:
        """Raises `ValueError` for masks and other shapes. The model's `fixed_dofs` stay at zero."""
        if case.masks:
            raise ValueError("there is no gradient for load cases with masks")
        nodes, dofs = model.mesh.node_count, case.known_dofs
        self._model, self._case = model, case
        self._slope = _shaped(by_displacements, (nodes, 3), "by_displacements").reshape(-1)
        of_reactions = _shaped(by_reactions, (len(dofs),), "by_reactions")
        self._held = np.union1d(dofs, fixed_dofs)
        used = 3 * model.used_nodes[:, None] + np.arange(3)
        free = np.setdiff1d(used, self._held).astype(U32)
        self.adjoint = LoadCase(dofs, -of_reactions, free, self._slope[free])
        self.needs_answer = model.kept_element == "t4"

    def gradient(self, adjoint: Answer, solved: Answer | None) -> Gradient:
        """The derivatives, from the answers to `adjoint` and, where it is needed, to the case."""
        model, case, dofs = self._model, self._case, self._case.known_dofs
        of_adjoint = adjoint.reactions
        holding = of_adjoint.forces[np.searchsorted(of_adjoint.dofs, dofs)]
        forces = np.array(adjoint.displacements, dtype=F64)
        forces.reshape(-1)[self._held] = 0.0
        points, young, poisson = None, None, None
        if solved is not None and self.needs_answer:
            if solved.nodes is not None:
                raise ValueError("the answer must have the displacements of all nodes")
            points, young, poisson = _by_elements(
                model, solved.displacements, adjoint.displacements
            )
            points += _by_loads(model, case, adjoint.displacements)
        by_known = self._slope[dofs] - holding
        by_load = _amounts(model, case, adjoint.displacements)
        return Gradient(by_known, forces, points, young, poisson, *by_load)


def _weights(model: Model, case: LoadCase) -> Floats:
    """Density times volume of every element, kg."""
    if len(case.densities) == 1:
        of_one: Floats = case.densities[0] * _volumes(model.mesh)
        return of_one
    labels = np.zeros(len(model.mesh.tets), dtype=U32)
    if model.mesh.regions is not None:
        labels = model.mesh.regions
    ranks = np.searchsorted(np.unique(labels), labels)
    return np.asarray(case.densities[ranks] * _volumes(model.mesh))


def _volumes(mesh: Mesh) -> Floats:
    edges = mesh.points[mesh.tets[:, 1:]] - mesh.points[mesh.tets[:, :1]]
    volumes: Floats = np.abs(np.linalg.det(edges)) / 6.0
    return volumes


def _outward(mesh: Mesh, triangles: Numbers) -> Numbers:
    """Triangles of the boundary with their corners counter-clockwise seen from outside."""
    boundary = mesh.boundary.astype(np.int64)
    names = np.sort(boundary, axis=1) @ _powers(mesh)
    order = np.argsort(names)
    wanted = np.sort(triangles.astype(np.int64), axis=1) @ _powers(mesh)
    found: Numbers = mesh.boundary[order[np.searchsorted(names[order], wanted)]]
    return found


def _powers(mesh: Mesh) -> NDArray[np.int64]:
    return np.array([mesh.node_count**2, mesh.node_count, 1], dtype=np.int64)


def _amounts(model: Model, case: LoadCase, adjoint: Floats) -> tuple[Floats | None, Floats | None]:
    """λᵀ ∂f/∂p for the acceleration and for each pressure; None where none is, and for `t10`."""
    mesh = model.mesh
    if model.kept_element not in ("t4", "t4-anp") or not case.has_spread_loads:
        return None, None
    by_acceleration: Floats | None = None
    if len(case.densities):
        mean = adjoint[mesh.tets].mean(axis=1)
        by_acceleration = np.asarray(_weights(model, case) @ mean)
    by_pressures = [
        -0.5 * float((adjoint[outward].mean(axis=1) * _areas(mesh, outward)).sum())
        for outward in (_outward(mesh, pressure.triangles) for pressure in case.pressures)
    ]
    return by_acceleration, np.array(by_pressures)


def _areas(mesh: Mesh, outward: Numbers) -> Floats:
    """Twice the area of triangles, along their outward normals."""
    a, b, c = (mesh.points[outward[:, corner]] for corner in range(3))
    return np.asarray(np.cross(b - a, c - a))


def _by_loads(model: Model, case: LoadCase, adjoint: Floats) -> Floats:
    """λᵀ ∂f/∂x of weight and pressure, by the place of each node; linear tetrahedra."""
    mesh = model.mesh
    points = np.zeros_like(mesh.points)
    if len(case.densities):
        edges = mesh.points[mesh.tets[:, 1:]] - mesh.points[mesh.tets[:, :1]]
        three = np.linalg.inv(edges).transpose(0, 2, 1)
        slopes = np.concatenate([-three.sum(axis=1, keepdims=True), three], axis=1)
        work = _weights(model, case) * (adjoint[mesh.tets].mean(axis=1) @ case.acceleration)
        # The volume grows by its own size times the gradient of the corner's shape function.
        np.add.at(points, mesh.tets, work[:, None, None] * slopes)
    for pressure in case.pressures:
        outward = _outward(mesh, pressure.triangles)
        a, b, c = (mesh.points[outward[:, corner]] for corner in range(3))
        mean = -0.5 * pressure.pressure * adjoint[outward].mean(axis=1)
        by_b, by_c = np.cross(c - a, mean), np.cross(mean, b - a)
        moved = np.stack([-by_b - by_c, by_b, by_c], axis=1)
        np.add.at(points, outward, moved)
    return points


def _shaped(values: ArrayLike | None, shape: tuple[int, ...], what: str) -> Floats:
    """Numbers in a shape; zeros where there are none."""
    if values is None:
        return np.zeros(shape)
    given: Floats = np.array(values, dtype=F64)
    if given.shape != shape:
        raise ValueError(f"{what} has the shape {given.shape}, not {shape}")
    return given


def _by_elements(
    model: Model, displacements: Floats, adjoint: Floats
) -> tuple[Floats, dict[int, float], dict[int, float]]:
    """−λᵀ (∂K/∂p) u for places of nodes, Young's moduli and Poisson's ratios of linear tetrahedra."""
    mesh = model.mesh
    labels, young, poisson = _materials(model)
    mu = (young / (2.0 * (1.0 + poisson)))[:, None, None]
    ratio = poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    lame = (young * ratio)[:, None, None]
    edges = mesh.points[mesh.tets[:, 1:]] - mesh.points[mesh.tets[:, :1]]
    volume = _volumes(mesh)
    three = np.linalg.inv(edges).transpose(0, 2, 1)
    slopes = np.concatenate([-three.sum(axis=1, keepdims=True), three], axis=1)

    def field(values: Floats) -> tuple[Floats, Floats, Floats]:
        """Displacement gradient, strain and stress of every element."""
        grad = np.einsum("mai,maj->mij", values[mesh.tets], slopes)
        strain = 0.5 * (grad + grad.transpose(0, 2, 1))
        trace = np.trace(strain, axis1=1, axis2=2)[:, None, None]
        return grad, strain, lame * trace * np.eye(3) + 2.0 * mu * strain

    (grad_u, strain_u, stress_u), (grad_a, strain_a, stress_a) = map(
        field, (displacements, adjoint)
    )
    work = np.einsum("mij,mij->m", stress_u, grad_a)
    # A node that moves changes the volume and the gradients of all fields in its elements.
    turned = np.einsum("mik,mij->mkj", grad_a, stress_u) + np.einsum(
        "mik,mij->mkj", grad_u, stress_a
    )
    moved = work[:, None, None] * slopes - np.einsum("mkj,maj->mak", turned, slopes)
    points = np.zeros_like(mesh.points)
    np.add.at(points, mesh.tets, -volume[:, None, None] * moved)
    traces = np.trace(strain_u, axis1=1, axis2=2) * np.trace(strain_a, axis1=1, axis2=2)
    products = np.einsum("mij,mij->m", strain_u, strain_a)
    lame_by_poisson = (
        young * (1.0 + 2.0 * poisson**2) / ((1.0 + poisson) * (1.0 - 2.0 * poisson)) ** 2
    )
    mu_by_poisson = -young / (2.0 * (1.0 + poisson) ** 2)
    by_young = -volume * work / young
    by_poisson = -volume * (lame_by_poisson * traces + 2.0 * mu_by_poisson * products)
    regions = {int(label): labels == label for label in np.unique(labels)}
    return (
        points,
        {label: float(by_young[own].sum()) for label, own in regions.items()},
        {label: float(by_poisson[own].sum()) for label, own in regions.items()},
    )


def _materials(model: Model) -> tuple[Numbers, Floats, Floats]:
    """Label, Young's modulus and Poisson's ratio of every element."""
    regions, given = model.mesh.regions, model.material
    count = len(model.mesh.tets)
    if isinstance(given, Material):
        # One material for the whole body is one region, whatever the mesh says.
        labels = np.zeros(count, dtype=U32)
        return labels, np.full(count, given.young), np.full(count, given.poisson)
    labels = np.zeros(count, dtype=U32) if regions is None else regions
    young = np.array([given[int(label)].young for label in labels])
    poisson = np.array([given[int(label)].poisson for label in labels])
    return labels, young, poisson
