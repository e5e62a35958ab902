"""One search of the tuner, made ready from what is in the store."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ....doe.limits.bench import BenchLimits, read_limits
from ....schema.session import Store
from ....twin.measured_shots import MeasuredShots
from ....twin.srs.target import Target
from ....twin.tune.goal import Goal, level_db
from ....twin.tune.space import TuningSpace
from ....twin.tune.tuner import FiredShots, Tuned, tune
from ...twins.building import BuiltTwin, TwinRequest, twin_of
from ...twins.measured_shots import read_measured_shots, struck_plate
from ..predict.factors import answering_contact
from .bench_adapter import SensorTwin, bench_refusals, goal_of, outside_of, tuning_space

if TYPE_CHECKING:
    from .request import SpectrumSearch

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class TuningSession:
    """Ready to run; `notes` are for the user. `answering` is the request of the twin by the names
    of what answers it, which stay the same when another model is put in use."""

    search: SpectrumSearch
    built: BuiltTwin
    goal: Goal
    space: TuningSpace
    limits: BenchLimits
    measured: FiredShots
    notes: tuple[str, ...]
    answering: TwinRequest

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
    answering = replace(
        twin,
        campaign=built.bench.campaign,
        contact=answering_contact(built, twin.contact),
    )
    return TuningSession(search, built, goal, space, limits, measured, notes, answering)


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
