"""Many small minimisations side by side: L-BFGS on a batch of independent problems of one shape, in PyTorch.

Nocedal and Wright, Numerical Optimization (2006): two-loop recursion (algorithm 7.4), steps halved and interpolated
until they decrease enough (algorithm 3.1, equation 3.57). PyTorch's own LBFGS knows one problem only: a batch given to
it as one long vector would share one curvature and one step. No Wolfe search: its second condition costs gradients,
and pairs of negative curvature, which it rules out, are simply not remembered.

Glossary: w, g: points and gradients (b x p); s, y: their differences from step to step; rho: 1 / (s . y), 0 for a pair
that is not used; t: step lengths (b,).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from torch import Tensor

SUFFICIENT, SHORTEST = 1e-4, 0.1  # of the slope's promise; of the step before
HALVINGS = 20
CHECKED_EVERY = 20


class Problems(Protocol):
    """b independent functions of p numbers each."""

    def __call__(self, w: Tensor) -> tuple[Tensor, Tensor]:
        """Values (b,) and gradients (b x p) at w (b x p)."""

    def take(self, rows: Tensor) -> Problems:
        """Some of them."""


@dataclass
class _Curvature:
    """The last `memory` pairs of differences."""

    memory: int
    pairs: list[tuple[Tensor, Tensor, Tensor]] = field(default_factory=list)

    def add(self, s: Tensor, y: Tensor) -> None:
        import torch

        product = _dot(s, y)
        used = product > 1e-8 * s.norm(dim=1) * y.norm(dim=1)
        self.pairs.append((s, y, torch.where(used, 1 / product, torch.zeros_like(product))))
        del self.pairs[: -self.memory]

    def take(self, rows: Tensor) -> _Curvature:
        return _Curvature(self.memory, [(s[rows], y[rows], rho[rows]) for s, y, rho in self.pairs])

    def direction(self, g: Tensor) -> Tensor:
        """The quasi-Newton step (b x p), to be subtracted; the first is no longer than 1."""
        q, weights = g.clone(), []
        for s, y, rho in reversed(self.pairs):
            weight = rho * _dot(s, q)
            q.addcmul_(y, weight[:, None], value=-1)
            weights.append(weight)
        q *= self._first_scale(g)[:, None]
        for (s, y, rho), weight in zip(self.pairs, reversed(weights), strict=True):
            q.addcmul_(s, (weight - rho * _dot(y, q))[:, None])
        return q

    def _first_scale(self, g: Tensor) -> Tensor:
        import torch

        if not self.pairs:
            return 1 / g.norm(dim=1).clamp_min(1.0)
        _, y, rho = self.pairs[-1]
        return torch.where(rho > 0, 1 / (rho * _dot(y, y)).clamp_min(1e-30), torch.ones_like(rho))


def minimise(problems: Problems, start: Tensor, iterations: int, memory: int = 10, tolerance: float = 1e-4) -> Tensor:
    """Points (b x p) after at most `iterations` steps from `start` (b x p).

    A problem is left alone once no step decreases it, or once 20 steps together gain less than `tolerance` of its
    value. The result depends on nothing but the arguments.
    """
    import torch

    found, rows = start.clone(), torch.arange(len(start))
    w, curvature = start, _Curvature(memory)
    value, g = problems(w)
    checked = value
    for iteration in range(1, iterations + 1):
        step = curvature.direction(g)
        uphill = _dot(step, g) <= 0
        step[uphill] = g[uphill]
        after, after_value, after_g, moved = _searched(problems, w, value, g, step)
        curvature.add(after - w, after_g - g)
        w, value, g, going = after, after_value, after_g, moved
        if iteration % CHECKED_EVERY == 0:
            going = going & (checked - value >= tolerance * value.abs())
            checked = value
        if not bool(going.all()):
            found[rows] = w
            kept = going.nonzero()[:, 0]
            if not len(kept):
                return found
            problems, curvature, rows = problems.take(kept), curvature.take(kept), rows[kept]
            w, value, g, checked = w[kept], value[kept], g[kept], checked[kept]
    found[rows] = w
    return found


def _searched(
    problems: Problems, w: Tensor, value: Tensor, g: Tensor, step: Tensor
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Points that decrease enough along -step, their values and gradients, and which were found (b,)."""
    import torch

    slope = -_dot(step, g)
    t = torch.ones_like(value)
    after = w - step
    after_value, after_g = problems(after)
    for _ in range(HALVINGS):
        failed = ~(after_value <= value + SUFFICIENT * t * slope)
        rows = failed.nonzero()[:, 0]
        if not len(rows):
            break
        t[rows] = _shorter(t[rows], value[rows], after_value[rows], slope[rows])
        after[rows] = w[rows] - t[rows, None] * step[rows]
        after_value[rows], after_g[rows] = problems.take(rows)(after[rows])
    moved = after_value < value
    back = ~moved
    after[back], after_value[back], after_g[back] = w[back], value[back], g[back]
    return after, after_value, after_g, moved


def _shorter(t: Tensor, value: Tensor, after_value: Tensor, slope: Tensor) -> Tensor:
    """Minimum of the parabola through both values, between a tenth and a half of the step before."""
    import torch

    parabola = -slope * t**2 / (2 * (after_value - value - slope * t))
    parabola = torch.where(parabola.isfinite(), parabola, SHORTEST * t)
    return torch.minimum(torch.maximum(parabola, SHORTEST * t), 0.5 * t)


def _dot(a: Tensor, b: Tensor) -> Tensor:
    return (a * b).sum(dim=1)
