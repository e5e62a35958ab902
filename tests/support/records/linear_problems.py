"""Inference problems whose answer is known: what an effect changes is its response times its
parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, make_dataclass
from functools import cache
from typing import cast

import numpy as np
from pyroshock.diagnosis.gap import GapTable, Noise
from pyroshock.diagnosis.inference.effect_laws import EffectLaw, LawRanges, laws_of
from pyroshock.diagnosis.inference.problem import InferenceProblem, Point, StageBlock
from pyroshock.diagnosis.observables.base import Observable, Stage
from pyroshock.diagnosis.record import CampaignRecord, Factor, Run, RunConfiguration
from pyroshock.twin.effects import Effect, parameter


@cache
def linear_kind(number: int, prior_odds: float = 1.0) -> type[Effect]:
    """An effect with one parameter whose prior is standard normal: u is the parameter."""
    return make_dataclass(
        f"Linear{number}",
        [
            (
                "size",
                float,
                parameter(
                    "of the response", "", default=1.0, low=-9.0, high=9.0, off=0.0, likely=(-2, 2)
                ),
            )
        ],
        bases=(Effect,),
        namespace={
            "id": f"gun.linear_{number}",
            "law": "response times size",
            "source": "a test",
            "prior_odds": prior_odds,
        },
        frozen=True,
    )


@cache
def linear_law(number: int, prior_odds: float = 1.0) -> EffectLaw:
    return laws_of(linear_kind(number, prior_odds), LawRanges(), {})[0]


@dataclass(eq=False)
class LinearSimulator:
    """`responses` (C, D) by effect id, in the observables' units; with `bend` a size s acts as s (1
    + bend s)."""

    responses: Mapping[str, np.ndarray]
    shape: tuple[int, int]
    bend: float = 0.0
    stages: tuple[Stage, ...] = ()

    def changes(self, points: Sequence[Point], _stages=None) -> np.ndarray:
        table = np.zeros((len(points), *self.shape))
        for row, point in zip(table, points, strict=True):
            for law, u in point:
                size = np.asarray(law.values(u)["size"]).reshape(-1, 1)
                row += size * (1 + self.bend * size) * self.responses[law.id]
        return table


def gap_of(
    residuals: np.ndarray,
    configuration: Sequence[int],
    factors: Sequence[Mapping[str, Factor]],
    scatter: float = 0.1,
) -> GapTable:
    """A gap table of runs with these residuals (R, D), in this order; every tolerance is 1, scatter
    independent."""
    rows = np.array(configuration)
    count = np.bincount(rows, minlength=len(factors))
    mean = np.array([residuals[rows == c].mean(axis=0) for c in range(len(factors))])
    columns = residuals.shape[1]
    return GapTable(
        record=CampaignRecord(
            "linear",
            "gun",
            tuple(RunConfiguration(str(c), dict(row)) for c, row in enumerate(factors)),
            tuple(Run(int(c), place, 1, place) for place, c in enumerate(rows)),
        ),
        observables=tuple(
            Observable(f"o{i}", "gun", "velocity", "1", 1.0, 0.1) for i in range(columns)
        ),
        residuals=residuals,
        mean=mean,
        count=np.repeat(count[:, None], columns, axis=1),
        noise=Noise(scatter**2 * np.eye(columns), np.full(columns, 5.0)),
        nuisances=np.zeros((0, len(factors), columns)),
        loudness={"gun": np.zeros(len(factors))},
    )


def linear_problem(
    responses: np.ndarray,
    gap: np.ndarray,
    covariance: np.ndarray,
    *,
    discrepancy: np.ndarray | None = None,
    bend: float = 0.0,
    laws: Sequence[EffectLaw] = (),
) -> InferenceProblem:
    """`responses` (m, C, D) of m effects to the `gap` (C, D), both in tolerances; `covariance` (N,
    N) of its cells."""
    count, *shape = responses.shape
    own_laws = tuple(laws) or tuple(linear_law(i) for i in range(count))
    c, o = (rows.ravel() for rows in np.indices(shape))
    size = len(c)
    block = StageBlock(
        stage="gun",
        configuration=c,
        observable=o,
        tolerance=np.ones(size),
        z=gap.ravel(),
        covariances=covariance[None],
        discrepancy=np.zeros((size, size)) if discrepancy is None else discrepancy,
        detail=np.zeros(size, dtype=bool),
    )
    table = gap_of(gap, range(shape[0]), [{"place": float(i)} for i in range(shape[0])])
    effects = dict.fromkeys(law.id for law in own_laws)
    simulator = LinearSimulator(
        dict(zip(effects, responses, strict=True)), (shape[0], shape[1]), bend
    )
    return InferenceProblem(table, (block,), simulator, own_laws)


def columns_of(problem: InferenceProblem, effects: Sequence[str]) -> np.ndarray:
    """A (N, k): the responses of some effects in the cells of the only block."""
    simulator = cast(LinearSimulator, problem.simulator)
    responses = [simulator.responses[name].ravel() for name in effects]
    return np.array(responses).reshape(len(responses), len(problem.blocks[0].z)).T
