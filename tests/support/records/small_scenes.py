"""Scenes of the toy bench that are small enough to be reckoned again by dense algebra."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from pyroshock.diagnosis.evidence.coordinates import sheets
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.surface import Surface, basis, surfaces
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.stages.base import Stage
from pyroshock.twin.effects import Effect

from support.records.toy_bench import (
    Design,
    ToyForceGain,
    ToyLayer,
    ToyLeak,
    ToyLoss,
    ToyMass,
    ToyVelocityGain,
    campaign,
    stages_of,
)

KINDS = (ToyLoss, ToyLeak, ToyMass, ToyLayer, ToyForceGain, ToyVelocityGain)
#: Eight configurations.
DESIGN = Design((0.5, 2.0), (0.25, 1.0), ("none", "polymeric"), 3)


@cache
def small(*effects: Effect, seed: int = 1) -> tuple[GapTable, tuple[Surface, ...], tuple[Stage, ...]]:
    """Gun and contact: eight configurations by four observables."""
    stages = stages_of(campaign(effects, np.random.default_rng(seed), DESIGN))[:2]
    return GapTable.of(stages[0].record, stages), _shown(), stages


@cache
def _shown() -> tuple[Surface, ...]:
    return surfaces(stages_of(campaign((), np.random.default_rng(0), DESIGN))[:2], KINDS)


@cache
def small_scene(*effects: Effect, seed: int = 1) -> Scene:
    gap, shown, _ = small(*effects, seed=seed)
    return Scene.of(gap, shown)


def dense(scene: Scene, background: int) -> np.ndarray:
    """(N, N) covariance of the gap where nothing acts."""
    cells = scene.cells
    return np.asarray(
        cells.noise + scene.kernels.background(scene.backgrounds[background]) + 0.02 * np.eye(len(cells.z))
    )


def given(gap: GapTable, nodes: np.ndarray, valid: Sequence[bool] | None = None) -> Surface:
    """A surface that is asked at its nodes (K, C, D) alone, in the observables' units."""
    k = len(nodes)
    points = np.linspace(0, 1, k)[:, None]
    allowed = np.ones(k, dtype=bool) if valid is None else np.array(valid)
    return Surface(sheets(ToyLoss)[0], nodes, points, np.eye(k), allowed)


def of_size(gap: GapTable, sizes: np.ndarray, stage: str = "gun") -> Surface:
    """The same in all cells of one stage, so many tolerances at each point."""
    here = np.array([item.stage == stage for item in gap.observables])
    nodes = sizes[:, None, None] * gap.tolerance * here * np.ones((len(gap.rows), 1))
    return given(gap, nodes)


def law(kind: type[Effect], ends: np.ndarray, points: int = 385, bend: float = 0.0) -> Surface:
    """Changes u ends[0] + v ends[1] + ..., ends (p, C, D) in the observables' units, at so many points along each axis;
    with `bend` u (1 + bend u) for u."""
    p, knots = len(ends), {1: 13, 2: 9, 3: 5}[len(ends)]
    one = (1 - np.cos(np.pi * np.arange(knots) / (knots - 1))) / 2
    places = np.array(list(itertools.product(one, repeat=p)))
    asked = np.array(list(itertools.product(np.linspace(0, 1, points), repeat=p)))
    nodes = np.tensordot(places * (1 + bend * places), ends, axes=1)
    sheet = sheets(kind)[0]
    sheet = replace(sheet, axes=tuple(sheet.axes[0] for _ in range(p)))
    return Surface(sheet, nodes, asked, basis(asked, knots), np.ones(len(asked), dtype=bool))


def with_gap(gap: GapTable, change: np.ndarray) -> GapTable:
    """The gap (C, D) itself in the observables' units."""
    return replace(gap, mean=np.where(gap.count > 0, change, np.nan))
