"""Derivatives of a quantity by all that it depends on, by one more solve with the same factor.

A quantity J of displacements u and reactions R, linear elasticity, K u = f. The adjoint λ has the load
∂J/∂u where u is free and the displacement −∂J/∂R where u is prescribed; with its reactions r,

    ∂J/∂f = λ,    ∂J/∂(prescribed u) = ∂J/∂u − r,    ∂J/∂p = −λᵀ (∂K/∂p) u

for a number p of a material or the place of a node: of linear tetrahedra ∂K/∂p is known in closed form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .answer import Answer
from .arrays import F64, U32, Floats, Numbers
from .load_case import LoadCase
from .model import Material, Model


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of a quantity J by what it depends on."""

    known_displacements: Floats
    """By each known displacement of the load case, in its order: dJ per m."""
    forces: Floats
    """By a force on each node, dJ per N; shape (nodes, 3), 0 where a displacement is known."""
    points: Floats | None
    """By the place of each node at rest, dJ per m; shape (nodes, 3). None but for `t4`."""
    young: dict[int, float] | None
    """By Young's modulus of each region's label (0 where there is one): dJ per Pa. None but for `t4`."""
    poisson: dict[int, float] | None
    """By Poisson's ratio of each region's label. None but for `t4`."""


def gradient(
    model: Model,
    fixed_dofs: Numbers,
    ask: Callable[[LoadCase], Answer],
    case: LoadCase,
    by_displacements: ArrayLike | None,
    by_reactions: ArrayLike | None,
    answer: Answer | None,
) -> Gradient:
    """The derivatives at a load case; see `KeptModel.gradient`. `ask` solves a load case of the model, whose
    `fixed_dofs` stay at zero."""
    if case.masks:
        raise ValueError("there is no gradient for load cases with masks")
    nodes, dofs = model.mesh.node_count, case.known_dofs
    slope = _shaped(by_displacements, (nodes, 3), "by_displacements").reshape(-1)
    of_reactions = _shaped(by_reactions, (len(dofs),), "by_reactions")
    held = np.union1d(dofs, fixed_dofs)
    used = 3 * np.unique(model.mesh.tets)[:, None] + np.arange(3)
    free = np.setdiff1d(used, held).astype(U32)
    adjoint = ask(LoadCase(dofs, -of_reactions, free, slope[free]))
    of_adjoint = adjoint.reactions
    holding = of_adjoint.forces[np.searchsorted(of_adjoint.dofs, dofs)]
    forces = np.array(adjoint.displacements, dtype=F64)
    forces.reshape(-1)[held] = 0.0
    points, young, poisson = None, None, None
    if model.kept_element == "t4":
        solved = ask(case) if answer is None else answer
        if solved.nodes is not None:
            raise ValueError("the answer must have the displacements of all nodes")
        points, young, poisson = _by_elements(model, solved.displacements, adjoint.displacements)
    return Gradient(slope[dofs] - holding, forces, points, young, poisson)


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
    volume = np.abs(np.linalg.det(edges)) / 6.0
    three = np.linalg.inv(edges).transpose(0, 2, 1)
    slopes = np.concatenate([-three.sum(axis=1, keepdims=True), three], axis=1)

    def field(values: Floats) -> tuple[Floats, Floats, Floats]:
        """Displacement gradient, strain and stress of every element."""
        grad = np.einsum("mai,maj->mij", values[mesh.tets], slopes)
        strain = 0.5 * (grad + grad.transpose(0, 2, 1))
        trace = np.trace(strain, axis1=1, axis2=2)[:, None, None]
        return grad, strain, lame * trace * np.eye(3) + 2.0 * mu * strain

    (grad_u, strain_u, stress_u), (grad_a, strain_a, stress_a) = map(field, (displacements, adjoint))
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
