"""Gradients by one more solve: which prescribed displacements give a wanted shape.

    python gradient.py

The derivative of a quantity J(u) is one more linear solve with the same stiffness
(`KeptModel.gradient`). Where torch is installed (`softgrasp[torch]`), a function
of autograd does it, and an optimiser of torch finds the displacements; without it numpy does.
"""

from __future__ import annotations

import numpy as np

import softgrasp
from softgrasp import LoadCase

try:
    import torch
except ImportError:
    torch = None


class Elastic:
    """A kept model as a differentiable function of its prescribed displacements."""

    def __init__(self, kept: softgrasp.KeptModel, case: LoadCase) -> None:
        self.kept, self.case = kept, case

    def displacements(self, known: np.ndarray) -> np.ndarray:
        """Displacements of all nodes for the known ones, m; shape (nodes, 3)."""
        answer = self.kept.frame(self.case.with_displacements(known), reactions=False)
        return answer.displacements

    def gradient(self, by_displacements: np.ndarray) -> np.ndarray:
        """dJ by each known displacement, from dJ by each displacement (nodes, 3)."""
        found = self.kept.gradient(self.case, by_displacements=by_displacements)
        return found.known_displacements


class Large(Elastic):
    """The same at large deformation: the server works out the derivatives at the equilibrium."""

    FROM_REST = softgrasp.LargeDeformation(path="from-rest")

    def displacements(self, known: np.ndarray) -> np.ndarray:
        self.case = self.case.with_displacements(known)
        return self.kept.large_frame(self.case, self.FROM_REST).displacements

    def gradient(self, by_displacements: np.ndarray) -> np.ndarray:
        """At the displacements that were asked for last."""
        quantity = softgrasp.Quantity(slopes=by_displacements)
        found = self.kept.large_frame(self.case, self.FROM_REST, quantity=quantity).gradient
        assert found is not None
        return found.known_displacements


def wanted_shape(mesh: softgrasp.Mesh) -> np.ndarray:
    """Displacements that the upper face should have: a gentle wave, m."""
    place = mesh.points[mesh.nodes_at(z=0.02)]
    wave = np.zeros((len(place), 3))
    wave[:, 2] = -0.0008 * np.sin(np.pi * place[:, 0] / 0.06) ** 2
    return wave


def by_numpy(elastic: Elastic, top: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, list]:
    """Conjugate gradients for the squares of the misfit, which are quadratic in what is known."""
    known = np.zeros(len(elastic.case.known_dofs))
    loss, slope = misfit(elastic, known, top, wanted)
    losses, direction = [loss], -slope
    for _ in range(30):
        # Displacements are linear in what is known: the best step is known beforehand.
        moved = elastic.displacements(direction)[top].reshape(-1)
        step = -(slope @ direction) / (2.0 * moved @ moved)
        known = known + step * direction
        loss, new = misfit(elastic, known, top, wanted)
        direction = -new + (new @ new) / (slope @ slope) * direction
        slope = new
        losses.append(loss)
    return known, losses


def by_torch(elastic: Elastic, top: np.ndarray, wanted: np.ndarray) -> tuple[np.ndarray, list]:
    """The same by autograd and the optimiser L-BFGS of torch."""

    class Displacements(torch.autograd.Function):
        @staticmethod
        def forward(context, known):
            return torch.tensor(elastic.displacements(known.detach().numpy()))

        @staticmethod
        def backward(context, by_displacements):
            return torch.tensor(elastic.gradient(by_displacements.numpy()))

    known = torch.zeros(len(elastic.case.known_dofs), dtype=torch.float64, requires_grad=True)
    goal, nodes = torch.tensor(wanted), torch.tensor(top.astype(np.int64))
    optimiser = torch.optim.LBFGS(
        [known],
        max_iter=30,
        line_search_fn="strong_wolfe",
        tolerance_grad=1e-12,
        tolerance_change=1e-16,
    )
    losses: list[float] = []

    def closure():
        optimiser.zero_grad()
        # In mm, so that squares are of a size that the optimiser's tolerances are made for.
        loss = (1e3 * (Displacements.apply(known)[nodes] - goal)).square().sum()
        loss.backward()
        losses.append(1e-6 * loss.item())
        return loss

    optimiser.step(closure)
    return known.detach().numpy(), losses


def misfit(
    elastic: Elastic, known: np.ndarray, top: np.ndarray, wanted: np.ndarray
) -> tuple[float, np.ndarray]:
    """Sum of squares of the misfit of the upper face, m², and its gradient."""
    off = elastic.displacements(known)[top] - wanted
    by_displacements = np.zeros((elastic.kept.model.mesh.node_count, 3))
    by_displacements[top] = 2.0 * off
    return float((off**2).sum()), elastic.gradient(by_displacements)


def off_by(
    elastic: Elastic, at: np.ndarray, top: np.ndarray, wanted: np.ndarray, size: float
) -> float:
    """How far the gradient is from central differences, of its largest number."""
    _, slope = misfit(elastic, at, top, wanted)
    worst = 0.0
    for k in range(0, len(at), 5):
        step = np.zeros(len(at))
        step[k] = size
        up, down = (misfit(elastic, at + s * step, top, wanted)[0] for s in (1, -1))
        worst = max(worst, abs((up - down) / (2 * size) - slope[k]) / np.abs(slope).max())
    return worst


def main() -> None:
    mesh = softgrasp.Mesh.block((0.06, 0.02, 0.02), (6, 2, 2))
    top = mesh.nodes_at(z=0.02)
    # Actuators: three strips of the lower face, held in all directions; the ends are fixed.
    lower = mesh.nodes_at(z=0.0)
    moved = lower[np.isin(np.round(mesh.points[lower, 0], 6), (0.02, 0.03, 0.04))]
    ends = np.concatenate([mesh.nodes_at(x=0.0, z=0.0), mesh.nodes_at(x=0.06, z=0.0)])
    case = LoadCase().prescribe(moved, (0.0, 0.0, 0.0))
    model = softgrasp.Model(mesh, softgrasp.Material(20e3, 0.4))
    wanted = wanted_shape(mesh)
    with softgrasp.Server.spawn() as server:
        kept = server.keep(model, fixed=ends)
        elastic = Elastic(kept, case)
        at = 1e-4 * np.random.default_rng(3).standard_normal(len(case.known_dofs))
        for name, function, size in (("linear", elastic, 1e-4), ("large", Large(kept, case), 1e-6)):
            worst = off_by(function, at, top, wanted, size)
            print(f"{name} gradient against central differences: off by {worst:.1e}")
            assert worst < 1e-6
        known, losses = (by_numpy if torch is None else by_torch)(elastic, top, wanted)
    how = "numpy" if torch is None else f"torch {torch.__version__}"
    print(f"{how}: misfit {losses[0]:.2e} m², after {len(losses)} evaluations {losses[-1]:.2e} m²")
    print(f"largest displacement of an actuator {1e3 * np.abs(known).max():.2f} mm")
    assert losses[-1] < 0.2 * losses[0]


if __name__ == "__main__":
    main()
