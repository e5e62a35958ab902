"""Batched L-BFGS against closed forms and SciPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import torch
from pyroshock.training.tuning.quasi_newton import minimise
from scipy.optimize import minimize, rosen


@dataclass(frozen=True)
class Bowls:
    """Quadratics about their own centre (b x p), of their own curvatures (b x p)."""

    centre: torch.Tensor
    curvature: torch.Tensor

    def take(self, rows: torch.Tensor) -> Bowls:
        return Bowls(self.centre[rows], self.curvature[rows])

    def __call__(self, w: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        away = w - self.centre
        return 0.5 * (self.curvature * away**2).sum(1), self.curvature * away


@dataclass(frozen=True)
class Valleys:
    """Rosenbrock's function, raised by 1 so that its relative decrease ends."""

    def take(self, rows: torch.Tensor) -> Valleys:
        return self

    def __call__(self, w: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        at = w.detach().clone().requires_grad_()
        value = 1 + (100 * (at[:, 1:] - at[:, :-1] ** 2) ** 2 + (1 - at[:, :-1]) ** 2).sum(1)
        (gradient,) = torch.autograd.grad(value.sum(), at)
        return value.detach(), gradient


def bowls(problems: int = 7, size: int = 12) -> Bowls:
    chance = torch.Generator().manual_seed(1)
    curvature = 10 ** (3 * torch.rand(problems, size, generator=chance, dtype=torch.float64))
    return Bowls(torch.randn(problems, size, generator=chance, dtype=torch.float64), curvature)


def test_reaches_the_bottom_of_each() -> None:
    problems = bowls()
    found = minimise(problems, torch.zeros(7, 12, dtype=torch.float64), 300, tolerance=0.0)
    torch.testing.assert_close(found, problems.centre, rtol=0, atol=1e-6)


def test_problems_do_not_touch_each_other() -> None:
    problems = bowls()
    together = minimise(problems, torch.zeros(7, 12, dtype=torch.float64), 25)
    for one in range(7):
        alone = minimise(problems.take(torch.tensor([one])), torch.zeros(1, 12, dtype=torch.float64), 25)
        torch.testing.assert_close(together[one], alone[0], rtol=1e-9, atol=1e-9)


def test_finds_the_valley_as_scipy_does() -> None:
    """Within twice its steps."""
    start = np.array([-1.2, 1.0, 0.5, -0.3])
    peer = minimize(rosen, start, method="L-BFGS-B", options={"maxcor": 10})
    found = minimise(Valleys(), torch.tensor(start)[None], 2 * peer.nit, tolerance=0.0)
    np.testing.assert_allclose(found[0].numpy(), np.ones(4), atol=1e-3)


@pytest.mark.parametrize("iterations", [1, 5, 50])
def test_never_ends_higher(iterations: int) -> None:
    problems, start = bowls(), torch.ones(7, 12, dtype=torch.float64)
    assert torch.all(problems(minimise(problems, start, iterations))[0] < problems(start)[0])


def test_stays_at_the_bottom() -> None:
    problems = bowls()
    assert torch.equal(minimise(problems, problems.centre, 10), problems.centre)
