"""Marginal likelihoods of none, of every effect alone, and of a gap that no effect explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .logs import log_mean, log_sum
from .scene import Scene, Seen
from .surface import Surface
from .whitening import Whitening

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OnSurface:
    """What a gap says of one sheet: `log_likelihood` (M, B) at its points before each background.

    `log_evidence` is the mean over points by their prior and over backgrounds.
    """

    surface: Surface
    log_prior: Floats
    log_likelihood: Floats
    log_evidence: float

    @property
    def log_posterior(self) -> Floats:
        """(M,) summing to one, over backgrounds."""
        both = self.log_prior + log_sum(self.log_likelihood, axis=1)
        return np.asarray(both - log_sum(both))

    @property
    def best(self) -> tuple[int, int]:
        """The likeliest point and background."""
        joint = self.log_prior[:, None] + self.log_likelihood
        point, background = np.unravel_index(int(np.argmax(joint)), joint.shape)
        return int(point), int(background)


def of_none(scene: Scene, z: Floats) -> float:
    """Backgrounds alone."""
    return log_mean([white.log_density(z) for white in scene.before])


def of_strays(scene: Scene, z: Floats) -> dict[str, float]:
    """By stage: a gap of any size beyond tolerance there."""
    each = [(one.stage, one.log_density(z)) for one in scene.astray]
    return {name: log_mean([value for stage, value in each if stage == name]) for name in scene.gap.stages}


def of_surface(scene: Scene, index: int, whitened: list[Floats]) -> OnSurface:
    """`whitened` is z before each background."""
    surface, prior = scene.surfaces[index], scene.log_prior[index]
    columns = [
        likelihood(surface, seen, zw, white)
        for seen, zw, white in zip(scene.seen[index], whitened, scene.before, strict=True)
    ]
    return summed(surface, prior, np.stack(columns, axis=1))


def summed(surface: Surface, prior: Floats, log_likelihood: Floats) -> OnSurface:
    total = float(log_sum(prior[:, None] + log_likelihood) - np.log(log_likelihood.shape[1]))
    return OnSurface(surface, prior, log_likelihood, total)


def likelihood(surface: Surface, seen: Seen, zw: Floats, white: Whitening) -> Floats:
    """(M,): -1/2 |z - change|^2 + constant, expanded so that nothing of size M by N is made."""
    return np.asarray(white.log_norm - 0.5 * (zw @ zw - 2 * surface.basis @ (seen.nodes.T @ zw) + seen.square))
