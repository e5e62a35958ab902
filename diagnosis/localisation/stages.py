"""In which stage the gap arises: measured interfaces take the place of simulated ones, stage by
stage."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise, permutations

import numpy as np

from ...array_types import Floats
from ..gap import Means, floors, metric_columns, tolerances
from ..observables.base import Observable, Stage, Upstream
from ..record import CampaignRecord
from ..verdict import Interval, StageShare

_RESAMPLES = 2000
#: Relative step of the velocity in finite differences.
_STEP = 0.01


@dataclass(frozen=True, eq=False)
class Link:
    """One stage, or several whose interfaces were not measured. `parts` (S, R, d): what each of the
    S links of the chain adds to the free-running residual at this link's exit; zero for links
    further down. Its own part is its residual given its measured entrance. `floor` (d,): the
    scatter of a run of that which the sensors at its entrance and its exit allow.
    """

    name: str
    observables: tuple[Observable, ...]
    parts: Floats
    floor: Floats


def stage_shares(stages: Sequence[Stage], rng: np.random.Generator) -> tuple[StageShare, ...]:
    """The stages by falling own gap: the first is where the cause acts.

    `own` is what decides, since a stage that is given its measured entrance cannot be blamed for
    another's cause: the rms of its mean residuals over configurations and observables, in
    tolerances, scatter of the repetitions taken off. Only the observables that the size of the gap
    counts are asked: shapes and timings would dilute amplitudes. `share` is of the gap that the
    chain shows when it runs freely from its entrance: the loss is the squared gap in tolerances at
    every measured exit (each exit counts the same, the scatter taken off), and exact Shapley values
    share it among the stages that get replaced by what was measured. The exits on the way count
    beside the last one because errors that cancel at the end (a gain of the sensor between two
    stages) would otherwise be nobody's. Shares are clipped at zero and sum to one. The 90 %
    intervals draw whole configurations with replacement; where there are not two, that of a share
    is (0, 1), and own gaps have none.

    Parameters:
        stages: The stages of the campaign, in the order of the bench.
        rng: Random numbers by which configurations are drawn.

    Raises:
        ValueError: Without stages, or where none has a measured exit.
    """
    links, record = [_counted(link) for link in chain_of(stages)], stages[0].record
    worth = np.mean([_worth(link, place, record) for place, link in enumerate(links)], axis=0)
    own_gap = np.array(
        [_square(link.parts[i], link, record, link.floor) for i, link in enumerate(links)]
    )
    share = _shares(worth.sum(axis=1), own_gap.sum(axis=1))
    low, high, cells = np.zeros(len(links)), np.ones(len(links)), len(record.configurations)
    size = np.sqrt(np.maximum(own_gap.mean(axis=1), 0.0))
    own_intervals: list[Interval | None] = [None] * len(links)
    if cells > 1:
        drawn = rng.multinomial(cells, np.full(cells, 1 / cells), size=_RESAMPLES).T.astype(
            np.float64
        )
        low, high = np.quantile(_shares(worth @ drawn, own_gap @ drawn), [0.05, 0.95], axis=1)
        ends = np.quantile(np.sqrt(np.maximum(own_gap @ drawn / cells, 0.0)), [0.05, 0.95], axis=1)
        own_intervals = [
            (float(min(lower, own)), float(max(upper, own)))
            for lower, upper, own in zip(*ends, size, strict=True)
        ]
    rows = np.array([share, np.minimum(low, share), np.maximum(high, share), size]).T.tolist()
    entries = [
        StageShare(link.name, part, (lower, upper), own_size, own_interval)
        for link, (part, lower, upper, own_size), own_interval in zip(
            links, rows, own_intervals, strict=True
        )
    ]
    return tuple(sorted(entries, key=lambda entry: (entry.own, entry.share), reverse=True))


def _counted(link: Link) -> Link:
    """With the observables alone that the size of the gap counts."""
    columns = metric_columns(link.observables)
    observables = tuple(link.observables[column] for column in columns.tolist())
    return Link(link.name, observables, link.parts[:, :, columns], link.floor[columns])


def stage_notes(stages: Sequence[Stage]) -> tuple[str, ...]:
    """Sentences on stages that have no measured exit of their own.

    Parameters:
        stages: The stages of the campaign, in the order of the bench.

    Raises:
        ValueError: Without stages, or where none has a measured exit.
    """
    return tuple(
        f"nothing was measured between {_name(group)}: their gaps are told as one"
        for group in _groups(stages)
        if len(group) > 1
    )


def chain_of(stages: Sequence[Stage]) -> tuple[Link, ...]:
    """Links in the order of the bench.

    With y measured at an exit, and s_k simulated there by all stages from the measured entrance of
    link k on, link i adds s_(i+1) - s_i, and the last one y - s_i. Velocities and pulses are
    compared as logarithms and spectra in dB, so that the parts of a small gap add up as causes do.

    Parameters:
        stages: The stages of the campaign, in the order of the bench: gun, contact, plate.

    Raises:
        ValueError: Without stages, or where none has a measured exit.
    """
    groups = _groups(stages)
    exits: list[list[Floats]] = [[] for _ in groups]
    for start in range(len(groups)):
        upstream: Upstream | None = None
        for k, group in enumerate(groups[start:], start):
            for stage in group[:-1]:
                upstream = stage.output((), upstream)
            exits[k].append(group[-1].simulated((), upstream))
            if group is not groups[-1]:
                upstream = group[-1].output((), upstream)
    links = []
    for k, group in enumerate(groups):
        gains = np.diff(np.array([*exits[k], group[-1].measured()]), axis=0)
        parts = np.concatenate([gains, np.zeros((len(groups) - len(gains), *gains.shape[1:]))])
        floor = _floor(group, [stage for before in groups[:k] for stage in before])
        links.append(Link(_name(group), group[-1].observables, parts, floor))
    return tuple(links)


def shapley(value: Callable[[frozenset[int]], Floats], players: int) -> Floats:
    """(players, ...): each player's mean gain over all orders of joining.

    Parameters:
        value: A function that gives the value of a coalition, a set of the numbers of its players.
            It is called once for each of the 2^S coalitions.
        players: The number S of players.

    Source:
        Shapley, A value for n-person games, Annals of Mathematics Studies 28 (1953) 307.
    """
    worth = cache(value)
    gains = np.zeros((players, *worth(frozenset()).shape))
    for order in permutations(range(players)):
        for place, player in enumerate(order):
            gains[player] += worth(frozenset(order[: place + 1])) - worth(frozenset(order[:place]))
    return gains / math.factorial(players)


def _worth(link: Link, last: int, record: CampaignRecord) -> Floats:
    """(S, C): Shapley values of the squared gap at the exit of the link at the place `last`.

    Errors of the velocity at an entrance stand in two parts with opposite signs and not in their
    sum: they average out of Shapley values. The scatter at the exit stands in the last part alone.
    """

    def loss(replaced: frozenset[int]) -> Floats:
        simulated = [i for i in range(len(link.parts)) if i not in replaced]
        floor = floors(link.observables) if last in simulated else 0.0
        return -_square(link.parts[simulated].sum(axis=0), link, record, floor)

    return shapley(loss, len(link.parts))


def _square(values: Floats, link: Link, record: CampaignRecord, floor: Floats | float) -> Floats:
    """(C,): mean squared gap of values (R, d) in tolerances, the noise taken off."""
    means = Means.of(values, record.configuration_of, len(record.configurations), floor)
    squares = (means.mean**2 - means.variance) / tolerances(link.observables) ** 2
    count = np.isfinite(squares).sum(axis=1)
    return np.asarray(np.nansum(squares, axis=1) / np.maximum(count, 1))


def _shares(worth: Floats, own_gap: Floats) -> Floats:
    """(S, ...) from sums over configurations. Where the chain has no gap left by the scatter, own
    gaps are shared."""
    gains, own_gap = np.maximum(worth, 0.0), np.maximum(own_gap, 0.0)
    gains = np.where(gains.sum(axis=0) > 0, gains, np.where(own_gap.sum(axis=0) > 0, own_gap, 1.0))
    return np.asarray(gains / gains.sum(axis=0))


def _groups(stages: Sequence[Stage]) -> list[tuple[Stage, ...]]:
    """Stages up to the next one whose exit was measured belong together."""
    stops = [i + 1 for i, stage in enumerate(stages) if np.isfinite(stage.measured()).any()]
    if not stops:
        raise ValueError(
            f"none of {', '.join(s.name for s in stages) or 'no stages'} has "
            f"a measured exit to compare"
        )
    return [tuple(stages[first:stop]) for first, stop in pairwise([0, *stops])]


def _floor(group: Sequence[Stage], before: Sequence[Stage]) -> Floats:
    """(d,): standard deviation of a run that the sensors at exit and entrance allow, J Sigma J' of
    the velocity."""
    stage, runs = group[0], group[0].record.runs
    sheet = floors(group[-1].observables)
    if stage.name != "contact" or len(group) > 1:
        return sheet
    velocities = np.array([run.velocity_m_s or np.nan for run in runs])
    faster = stage.simulated((), (velocities * (1 + _STEP)).tolist())
    slope = (faster - stage.simulated((), velocities.tolist())) / _STEP
    assumed = next(
        (
            item.floor
            for first in before
            for item in first.observables
            if item.channel == "velocity"
        ),
        0.0,
    )
    readings = [(run.velocity_u_m_s, run.velocity_m_s) for run in runs]
    relative = np.array([u / v if u and v else assumed for u, v in readings])
    return np.asarray(
        np.sqrt(sheet**2 + np.mean((np.nan_to_num(slope) * relative[:, None]) ** 2, axis=0))
    )


def _name(group: Sequence[Stage]) -> str:
    return " and ".join(stage.name for stage in group)
