"""One question to the tuner, made ready from what is in the store."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...doe.limits.bench import BenchLimits, read_limits
from ...doe.space import Space
from ...schema.session import Store
from ...twin.srs.target import Target
from ...twin.tune.goal import Goal
from ...twin.tune.space import Amount, TuningSpace
from ...twin.tune.tuner import Measured, Tuned, tune
from ..twins.building import BuiltTwin, TwinRequest, twin_of
from .laboratory import AtSensor, bench_refusals, goal_of, outside_of, tuning_space
from .shots import PlateFigures, ShotReader

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class Ask:
    """What a user asks: a spectrum, of which twin, with what the lab owns, learning from which campaigns."""

    target: Target
    request: TwinRequest
    factors: Space
    measured: tuple[str, ...] = ()
    sensor: str | None = None
    mass_kg: Amount | None = None
    share: float = 1.0
    extrapolate: bool = False
    seed: int = 0


@dataclass(frozen=True, eq=False)
class TuningSession:
    """Ready to run; `notes` are for the user."""

    ask: Ask
    built: BuiltTwin
    goal: Goal
    space: TuningSpace
    limits: BenchLimits
    measured: Measured
    notes: tuple[str, ...]

    def run(self, progress: Progress | None = None) -> Tuned:
        """Raises as `twin.tune.tuner.tune`."""
        return tune(
            AtSensor(self.built.twin, self.ask.sensor),
            self.space,
            self.goal,
            np.random.default_rng(self.ask.seed),
            measured=self.measured,
            refusals=bench_refusals(self.built.twin, self.limits),
            outside=outside_of(self.built.twin),
            extrapolate=self.ask.extrapolate,
            progress=progress,
        )


def session_of(store: Store, db: str, ask: Ask) -> TuningSession:
    """Raises `LookupError` and `ValueError` for what there is not, in one line."""
    built = twin_of(store, db, ask.request)
    if not built.bench.has_gun:
        raise ValueError(
            f"campaign {built.bench.campaign!r} is of kind {built.bench.kind!r} and has no gun, whose settings are "
            "searched: give the campaign of a gun with --campaign"
        )
    limits = read_limits(ask.factors.bench)
    own = built.setting(impactor_mass_kg=1.0, tip=built.plate, tip_radius_m=1.0, impact_velocity_m_s=1.0)
    space = tuning_space(
        ask.factors,
        built.material,
        built.plate,
        own.plate_thickness_m,
        own.plate_mass_kg,
        built.twin.plate.ensemble(built.plate.name)[0].impact_points,
        limits,
        ask.mass_kg,
    )
    measured, left_out = _measured(store, built, ask, PlateFigures(own.plate_thickness_m, own.plate_mass_kg))
    goal = goal_of(ask.target, built.twin.frequency_hz, ask.share)
    notes = (*(line for line in built.notes if line), *left_out)
    return TuningSession(ask, built, goal, space, limits, measured, notes)


def _measured(store: Store, built: BuiltTwin, ask: Ask, plate: PlateFigures) -> tuple[Measured, list[str]]:
    """Of all campaigns named, and what was left out of each."""
    together, notes = Measured(), []
    with store.reading() as session:
        reader = ShotReader(
            session,
            built.twin.frequency_hz,
            built.twin.q,
            ask.sensor or built.twin.sensor_names[0],
            built.material,
            {built.plate.name: plate},
        )
        for name in ask.measured:
            shots, left_out = reader.measured(name)
            together = together + shots
            why = f"; left out {len(left_out)}: {left_out[0]}" if left_out else ""
            notes.append(f"{name}: learned from {len(shots)} shots{why}")
    return together, notes
