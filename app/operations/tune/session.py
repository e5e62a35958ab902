"""One search of the tuner, made ready from what is in the store; and the best settings' spectra
as a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ....array_types import Floats
from ....doe.limits.bench import BenchLimits, read_limits
from ....schema.session import Store
from ....twin.measured_shots import MeasuredShots
from ....twin.srs.target import Target
from ....twin.tune.goal import Goal, level_db
from ....twin.tune.space import TuningSpace
from ....twin.tune.tuner import FiredShots, Tuned, tune
from ...common.number_format import percent
from ...common.plots import MEASURED, MODEL, QUIET, new_figure, save
from ...common.quantities import shown_unit
from ...twins.building import BuiltTwin, TwinRequest, twin_of
from ...twins.measured_shots import read_measured_shots, struck_plate
from .bench_adapter import SensorTwin, bench_refusals, goal_of, level_m_s2, outside_of, tuning_space
from .verdict import drawn_share

if TYPE_CHECKING:
    from .request import SpectrumSearch

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class TuningSession:
    """Ready to run; `notes` are for the user."""

    search: SpectrumSearch
    built: BuiltTwin
    goal: Goal
    space: TuningSpace
    limits: BenchLimits
    measured: FiredShots
    notes: tuple[str, ...]

    def run(self, progress: Progress | None = None) -> Tuned:
        """Raises as `twin.tune.tuner.tune`."""
        return tune(
            SensorTwin(self.built.twin, self.search.sensor),
            self.space,
            self.goal,
            np.random.default_rng(self.search.seed),
            measured=self.measured,
            refusals=bench_refusals(self.built.twin, self.limits),
            outside=outside_of(self.built.twin),
            extrapolate=self.search.extrapolate,
            at_least=self.search.at_least,
            calibrated=self.built.twin.calibration is not None,
            progress=progress,
        )


def session_of(
    store: Store | None, db: str, target: Target, search: SpectrumSearch, twin: TwinRequest
) -> TuningSession:
    """A search at the lines of its target. Raises `LookupError` and `ValueError` for what there is
    not, in one line."""
    at_lines = replace(twin, frequency_hz=tuple(target.lines().tolist()))
    built = _without_double_counting(twin_of(store, db, at_lines), search.measured)
    factors = search.space()
    if not built.bench.has_gun:
        raise ValueError(
            f"campaign {built.bench.campaign!r} is of kind {built.bench.kind!r} and has no gun, "
            "whose settings are searched: give the campaign of a gun with --campaign"
        )
    limits = read_limits(factors.bench)
    own = built.setting(
        impactor_mass_kg=1.0, tip=built.plate, tip_radius_m=1.0, impact_velocity_m_s=1.0
    )
    space = tuning_space(
        factors,
        built.material,
        built.plate,
        own.plate_thickness_m,
        own.plate_mass_kg,
        built.twin.plate.ensemble(built.plate.name)[0].impact_points,
        limits,
        search.masses(),
    )
    measured, left_out = _measured(store, built, search)
    goal = goal_of(target, built.twin.frequency_hz, search.share)
    notes = (*(line for line in built.notes if line), *left_out)
    return TuningSession(search, built, goal, space, limits, measured, notes)


def _without_double_counting(built: BuiltTwin, measured: Sequence[str]) -> BuiltTwin:
    """Spectra of a campaign that the tuner learns from itself are not learned by the twin as well;
    and a calibration that no shot has taught leaves what is not known to the tuner."""
    calibration = built.twin.calibration
    if calibration is None or (calibration.shots and built.bench.campaign not in measured):
        return built
    return replace(built, twin=replace(built.twin, calibration=None))


def _measured(
    store: Store | None, built: BuiltTwin, search: SpectrumSearch
) -> tuple[FiredShots, list[str]]:
    """Of all campaigns named, and what was left out of each. Raises `LookupError` for a campaign
    without a store."""
    together = FiredShots()
    notes: list[str] = []
    if store is None:
        if search.measured:
            raise LookupError(f"no campaign {search.measured[0]!r}: there is no store")
        return together, notes
    sensor = search.sensor or built.twin.sensor_names[0]
    with store.reading() as session:
        for name in search.measured:
            shots, left_out = read_measured_shots(
                session,
                name,
                frequency_hz=built.twin.frequency_hz,
                q=built.twin.q,
                sensors=(sensor,),
                material=built.material,
                plate=struck_plate(built.bench),
            )
            measured, others = _levels(shots, built)
            together = together + measured
            reasons = [*left_out, *others]
            why = (
                f"; left out {len(shots) - len(measured) + len(left_out)}: {reasons[0]}"
                if reasons
                else ""
            )
            notes.append(f"{name}: learned from {len(measured)} shots{why}")
    return together, notes


def _levels(shots: MeasuredShots, built: BuiltTwin) -> tuple[FiredShots, list[str]]:
    """Those with a spectrum, on plates that the twin has, and why others are left out."""
    plates = built.twin.plate.plates
    force_given = shots.force_is_given
    others = [
        f"no modes of its plate of {s.plate.name}"
        for s in shots.settings
        if s.plate.name not in plates
    ]
    others += ["no mass or no velocity of the impactor"] * int(force_given.sum())
    there = np.array([setting.plate.name in plates for setting in shots.settings], dtype=np.bool_)
    rows = np.flatnonzero(np.isfinite(shots.spectra_m_s2).all(axis=(1, 2)) & there & ~force_given)
    if not rows.size:
        return FiredShots(), others
    settings = tuple(shots.settings[row] for row in rows)
    return FiredShots(settings, level_db(shots.spectra_m_s2[rows, 0])), others


def plot_tuned(tuned: Tuned, goal: Goal, path: Path) -> None:
    """The picture of `draw_tuned`; the suffix decides the format."""
    figure = new_figure(8, 5)
    draw_tuned(figure.subplots(), tuned, goal)
    save(figure, path)


def draw_tuned(axes: Any, tuned: Tuned, goal: Goal) -> None:
    """The first proposal with its 90 % band, the next two as lines, in the band of the target."""
    lines, (unit, scale) = goal.frequency_hz, shown_unit("m/s2")

    def shown(level_db: Floats) -> Floats:
        return scale * level_m_s2(level_db)

    low, high = (
        np.clip(edge, -200, 400)
        for edge in (goal.level_db - goal.lower_db, goal.level_db + goal.upper_db)
    )
    axes.fill_between(
        lines, shown(low), shown(high), color=QUIET, alpha=0.25, lw=0, label="tolerance"
    )
    axes.plot(lines, shown(goal.level_db), color=QUIET, lw=1.5, label="prescribed")
    first, *others = tuned.proposals[:3]
    axes.fill_between(
        lines, shown(first.lower_db), shown(first.upper_db), color=MODEL, alpha=0.2, lw=0
    )
    axes.plot(
        lines,
        shown(first.level_db),
        color=MODEL,
        lw=1.8,
        label=f"first: {percent(drawn_share(first.probability_within))} within",
    )
    for rank, proposal in enumerate(others, 2):
        label = f"{rank}: {percent(drawn_share(proposal.probability_within))} within"
        axes.plot(
            lines,
            shown(proposal.level_db),
            color=MEASURED,
            lw=1.0,
            ls="--" if rank == 2 else ":",
            label=label,
        )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="natural frequency (Hz)",
        ylabel=f"maximax acceleration ({unit})",
    )
    axes.set_ylim(0.3 * shown(goal.level_db).min(), 5 * shown(goal.level_db).max())
    axes.legend(frameon=False)
