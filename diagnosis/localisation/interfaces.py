"""What each stage adds to the gap of the bench when its simulators run freely: measured interfaces swapped in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..observables.base import Observable, Stage, Upstream

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Link:
    """One stage, or several whose interfaces were not measured. `parts` (S, R, d): what each of the S links of the
    chain adds to the free-running residual at this link's exit; zero for links further down. `own` (R, d) is its
    residual given its measured entrance, the part of its own. `floor` (R, d) is the scatter of a run of `own` that the
    sensors at its entrance and its exit allow.
    """

    name: str
    observables: tuple[Observable, ...]
    parts: Floats
    own: Floats
    floor: Floats


@dataclass(frozen=True, eq=False)
class Chain:
    """Links in the order of the bench."""

    links: tuple[Link, ...]
    configuration: NDArray[np.intp]
    configurations: int


def chain_of(stages: Sequence[Stage]) -> Chain:
    """Stages in their order on the bench: gun, contact, plate.

    With y measured at an exit, and s_k simulated there by all stages from the measured entrance of link k on,
    link i adds s_(i+1) - s_i, and the last one y - s_i. Velocities and pulses are compared as logarithms and spectra
    in dB, so that the parts of a small gap add up as causes do.
    Raises `ValueError` without stages, or where none has a measured exit.
    """
    groups = _groups(stages)
    simulated = [_from_entrance(groups[start:]) for start in range(len(groups))]
    links = []
    for k, group in enumerate(groups):
        reached = [simulated[start][k - start] for start in range(k + 1)]
        whole = [*reached, np.asarray(group[-1].measured())]
        parts = np.zeros((len(groups), *whole[0].shape))
        parts[: k + 1] = np.diff(np.array(whole), axis=0)
        links.append(
            Link(
                _name(group), group[-1].observables, parts, parts[k], _floor(group, [s for g in groups[:k] for s in g])
            )
        )
    record = stages[0].record
    return Chain(tuple(links), record.configuration_of, len(record.configurations))


def notes_of(stages: Sequence[Stage]) -> tuple[str, ...]:
    """Sentences on stages that have no measured exit of their own. Raises `ValueError` as `chain_of`."""
    return tuple(_note(group) for group in _groups(stages) if len(group) > 1)


def _groups(stages: Sequence[Stage]) -> list[tuple[Stage, ...]]:
    """Stages up to the next one whose exit was measured belong together."""
    groups: list[tuple[Stage, ...]] = []
    waiting: tuple[Stage, ...] = ()
    for stage in stages:
        waiting = (*waiting, stage)
        if np.isfinite(stage.measured()).any():
            groups.append(waiting)
            waiting = ()
    if not groups:
        raise ValueError(f"none of {', '.join(s.name for s in stages) or 'no stages'} has a measured exit to compare")
    return groups


def _from_entrance(groups: Sequence[Sequence[Stage]]) -> list[Floats]:
    """What every group's exit would show, from the measured entrance of the first one on."""
    shown: list[Floats] = []
    handed: Upstream | None = None
    for at, group in enumerate(groups):
        for stage in group[:-1]:
            handed = stage.output((), handed)
        shown.append(np.asarray(group[-1].simulated((), handed)))
        if at + 1 < len(groups):
            handed = group[-1].output((), handed)
    return shown


def _floor(group: Sequence[Stage], before: Sequence[Stage]) -> Floats:
    """(R, d): standard deviation of one run that the sensors at exit and entrance allow, J Sigma J' of the velocity."""
    stage = group[0]
    sheet = np.array([item.floor for item in group[-1].observables])
    if stage.name != "contact" or len(group) > 1:
        return np.tile(sheet, (len(stage.record.runs), 1))
    assumed = next((item.floor for each in before for item in each.observables if item.channel == "velocity"), 0.0)
    return np.asarray(np.hypot(sheet, np.nan_to_num(velocity_slope(stage)) * _relative_u(stage, assumed)[:, None]))


def _relative_u(stage: Stage, assumed: float) -> Floats:
    known = [(run.velocity_u_m_s, run.velocity_m_s) for run in stage.record.runs]
    return np.array([u / v if u and v else assumed for u, v in known])


def velocity_slope(stage: Stage, step: float = 0.01) -> Floats:
    """(R, d): by how much its observables move for a relative change of the velocity at its entrance."""
    recorded = [run.velocity_m_s or np.nan for run in stage.record.runs]
    moved = stage.simulated((), [each * (1 + step) for each in recorded])
    return np.asarray((moved - stage.simulated((), recorded)) / step)


def _name(group: Sequence[Stage]) -> str:
    return " and ".join(stage.name for stage in group)


def _note(group: Sequence[Stage]) -> str:
    return f"nothing was measured between {_name(group)}: their gaps are told as one"
