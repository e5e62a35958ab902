"""The contact as a stage of a diagnosis: the elastic Hertz impact, given the recorded impact
velocity.

Measured and simulated pulses side by side, in time and in frequency: where along a pulse the gap
lies.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from ....array_types import Floats, Rows
from ....twin.contact.bodies import Bodies, MissingQuantityError
from ....twin.contact.impacts import ContactEffect, Impacts
from ....twin.effects import Effect, catalogue
from ....twin.sensors.chain import SensorChain
from ...record import CampaignRecord, Run, Series
from ..base import Stage, Upstream, at_rows, batched_changes, sensor_chain
from .features import NAMES, OBSERVABLES, level_crossings, series_features, zeroed
from .force_histories import ForceHistories, law_histories, measured_features, sites_of

#: Where nothing is recorded: as the thesis records its hammer (chapter 4).
_ASSUMED_RATE_HZ = 51_200.0
_VELOCITY = "impact_velocity_m_s"
#: The quantities that may be uncertain: those that Hertz' impact on a rigid target is made of.
UNCERTAIN = (
    *(item.name for item in fields(Bodies) if "modulus" in item.name or "poisson" in item.name),
    "impactor_radius_m",
    "impactor_mass_kg",
    _VELOCITY,
)
#: Share of an uncertain quantity: small enough for a derivative, large enough for the digits of
#: features.
_STEP = 0.03


class ContactObservables(Stage):
    """A mass with the tip's radius on a rigid target of the first layer's material, without loss.

    The mass is the hammer's nominal one, or the bullet's. `uncertain` are relative standard
    deviations of nominal quantities, {"impactor_mass_kg": 0.02}. Raises `ValueError` naming what a
    record does not tell, and an uncertain quantity that the impact has not.
    """

    name = "contact"
    simulator = "contact:hertz"
    observables = OBSERVABLES
    effect_kind = ContactEffect
    sensor_hooks = ("measured_force_n", "measured_velocity_m_s")

    def __init__(
        self, record: CampaignRecord, uncertain: Mapping[str, float] | None = None
    ) -> None:
        super().__init__(record)
        self.sites = sites_of(record)
        self.recorded_m_s = record.run_values("velocity_m_s")
        self.step_s = np.array([1 / _rate_hz(run) for run in record.runs])
        self._measured: Floats | None = None
        self._nuisances = self._derivatives(uncertain or {})

    @property
    def shows(self) -> tuple[str, ...]:
        if not any(run.force is not None for run in self.record.runs):
            return ()
        nominal = Impacts.of(self.sites.bodies, self.sites.insulated, self.sites.impedance_n_s_m)
        return tuple(
            identity
            for identity in super().shows
            if _changes_impacts(catalogue()[identity], nominal)
        )

    def measured(self) -> Floats:
        if self._measured is None:
            nothing = np.full(len(NAMES), np.nan)
            rows = [
                nothing if run.force is None else series_features(run.force)
                for run in self.record.runs
            ]
            self._measured = np.array(rows).reshape(-1, len(NAMES))
        return self._measured.copy()

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        """Observables (R, d) that the force records would show; NaN where a run has no velocity.

        Parameters:
            effects: Effects that act, by default none. A parameter is one value or one for each run
                (R,).
            upstream: The true velocity of each run, m/s; by default the velocities as read.
        """
        return self._features(self._runs, effects, upstream)

    def output(
        self, effects: Sequence[Effect] = (), upstream: Upstream | None = None
    ) -> list[Series | None]:
        """The true force of each run on the plate, N; None where there is none.

        Parameters:
            effects: Effects that act, by default none. A parameter is one value or one for each run
                (R,).
            upstream: The true velocity of each run, m/s; by default the velocities as read.
        """
        histories = self.histories(self._runs, effects, upstream)
        return [histories.series(int(run), float(self.step_s[run])) for run in self._runs]

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        """(k, C, d): by how much each of k sets of effects moves the nominal observables, at the
        run of median velocity of each configuration; NaN where it has none with a velocity.

        Parameters:
            sets: The k sets of effects; effects of other stages in a set do nothing here. A
                parameter is one value or one for each configuration (C,).
        """
        runs, nominal = self._representative
        configurations = self.record.configuration_of[runs]
        changes = np.full((len(sets), len(self.record.configurations), len(NAMES)), np.nan)
        acting: list[Sequence[Effect]] = [self.acting(effects) for effects in sets]
        if len(configurations) < changes.shape[1]:
            acting = [at_rows(effects, configurations) for effects in acting]
        changes[:, configurations] = batched_changes(
            nominal,
            acting,
            lambda effects, count: self._features(np.tile(runs, count), effects),
        )
        return changes

    @cached_property
    def _representative(self) -> tuple[Rows, Floats]:
        """The representatives of the configurations that have one, and their nominal features."""
        runs = self.representatives()
        return runs[runs >= 0], self._features(runs[runs >= 0], ())

    def representatives(self) -> Rows:
        """(C,): the run of each configuration with its median velocity; -1 where there is none with
        a velocity."""
        return self.median_runs(np.where(self.recorded_m_s > 0, self.recorded_m_s, np.nan))

    @property
    def _runs(self) -> Rows:
        return np.arange(len(self.record.runs))

    def _features(
        self, runs: Rows, effects: Sequence[Effect], upstream: Upstream | None = None
    ) -> Floats:
        """(k, d): what records of the runs (k,) would show; effects' parameters are numbers or
        (k,)."""
        return measured_features(
            self.histories(runs, effects, upstream), self.step_s[runs], sensor_chain(effects)
        )

    def histories(
        self, runs: Rows, effects: Sequence[Effect] = (), upstream: Upstream | None = None
    ) -> ForceHistories:
        """True forces of some runs.

        Parameters:
            runs: The places (k,) of the runs in the record.
            effects: Effects that act, by default none. A parameter is one value or one for each of
                these runs (k,).
            upstream: The true velocity of every run (R,) of the record, m/s; by default the
                velocities as read.
        """
        if upstream is None:
            velocity = sensor_chain(effects).true_velocity_m_s(self.recorded_m_s[runs])
        else:
            velocity = np.array(upstream, dtype=np.float64)[runs]
        return self._contacts(
            runs, tuple(effect for effect in effects if isinstance(effect, ContactEffect)), velocity
        )

    def _contacts(
        self, runs: Rows, effects: tuple[ContactEffect, ...], velocity_m_s: Floats
    ) -> ForceHistories:
        """At true velocities (k,); `RegisteredContactStage` asks its model instead."""
        return law_histories(self.sites.take(runs), effects, velocity_m_s)

    def _derivatives(self, uncertain: Mapping[str, float]) -> dict[str, Floats]:
        """(C, d) by name: the features' derivative for a quantity's logarithm times its relative
        standard deviation.

        Of Hertz' impact, by central differences; NaN where a configuration has no run with a
        velocity.
        """
        for name, sd in uncertain.items():
            if name not in UNCERTAIN:
                raise ValueError(
                    f"no uncertain quantity {name!r} of the "
                    f"contact; there are: {', '.join(UNCERTAIN)}"
                )
            if not (np.isfinite(sd) and sd >= 0):
                raise ValueError(
                    f"uncertain {name} = {sd!r}: expected a "
                    f"relative standard deviation, not negative"
                )
        runs = self.representatives()
        chosen = runs[runs >= 0]
        sites = self.sites.take(chosen)

        def shown(name: str, factor: float) -> Floats:
            bodies, velocity = sites.bodies, self.recorded_m_s[chosen]
            if name == _VELOCITY:
                velocity = velocity * factor
            else:
                bodies = replace(bodies, **{name: getattr(bodies, name) * factor})
            histories = law_histories(replace(sites, bodies=bodies), (), velocity)
            return measured_features(histories, self.step_s[chosen], SensorChain())

        nuisances = {
            name: np.full((len(runs), len(NAMES)), np.nan)
            for name, sd in uncertain.items()
            if sd > 0
        }
        for name, values in nuisances.items():
            change = uncertain[name] * (shown(name, 1 + _STEP) - shown(name, 1 - _STEP))
            values[runs >= 0] = change / np.log((1 + _STEP) / (1 - _STEP))
        return nuisances


def _rate_hz(run: Run) -> float:
    """Of the run's force, else of what else it records, else as hammer campaigns are recorded."""
    recorded = (series for series in (run.force, *run.accelerations.values()) if series is not None)
    return next((series.sampling_rate_hz for series in recorded), _ASSUMED_RATE_HZ)


def _changes_impacts(kind: type[Effect], nominal: Impacts) -> bool:
    """Whether an effect changes anything of these impacts, or is one of their record."""
    if not issubclass(kind, ContactEffect):
        return True
    try:
        changed = kind().prepare(nominal)
    except MissingQuantityError:
        return False
    quantities = (name for name, value in vars(nominal).items() if isinstance(value, np.ndarray))
    return any(
        not np.array_equal(getattr(changed, name), getattr(nominal, name)) for name in quantities
    )


#: Room before the alignment and behind it, in the longest width at half the peak; and the most
#: samples for it.
_BEFORE, _AFTER, _MOST = 1.0, 2.0, 2048


@dataclass(frozen=True, eq=False)
class PulseResiduals:
    """Forces (N) of R runs at `time_s` (p,), 0 where each rises through half its peak; NaN rows
    where there is none."""

    time_s: Floats
    measured: Floats  # (R, p)
    simulated: Floats  # (R, p)

    @property
    def frequency_hz(self) -> Floats:
        """(q,): of the spectra."""
        return np.asarray(np.fft.rfftfreq(self.time_s.size, float(self.time_s[1] - self.time_s[0])))

    def spectrum_n_s(self, force_n: Floats) -> Floats:
        """(..., q) of forces: magnitude of the Fourier integral; its first value is the impulse.

        Parameters:
            force_n: Forces (..., p) at the times of `time_s`.
        """
        return np.asarray(np.abs(np.fft.rfft(force_n)) * float(self.time_s[1] - self.time_s[0]))


def pulse_residuals(stage: ContactObservables, effects: Sequence[Effect] = ()) -> PulseResiduals:
    """Every run's pulse, as recorded and as the stage simulates it.

    In steps of the finest record, or of 1/2048 of the whole where that is less.

    Parameters:
        stage: The contact of a campaign.
        effects: Effects that act in the simulation, by default none. A parameter is one value or
            one for each run (R,).

    Raises:
        ValueError: Where no run has both force and velocity.
    """
    chain = sensor_chain(effects)
    rows = np.arange(len(stage.sites))
    histories = stage.histories(rows, effects)
    recorded = [None if run.force is None else zeroed(run.force) for run in stage.record.runs]
    simulated = [_simulated(histories, int(row), chain) for row in rows]
    pairs = [
        (record, pulse)
        for record, pulse in zip(recorded, simulated, strict=True)
        if record and pulse
    ]
    widths = [_width(series) for pair in pairs for series in pair]
    if not widths:
        raise ValueError(f"{stage.record.name}: no run has both a recorded force and a velocity")
    step = max(float(stage.step_s.min()), (_BEFORE + _AFTER) * max(widths) / _MOST)
    time = _steps(_BEFORE * max(widths), _AFTER * max(widths), step)
    aligned = (
        np.array([_aligned(pulse, time) for pulse in pulses]) for pulses in (recorded, simulated)
    )
    return PulseResiduals(time, *aligned)


def _simulated(histories: ForceHistories, row: int, chain: SensorChain) -> Series | None:
    """As the force channel shows it, 24 steps to a compression, with room for what a sensor
    adds."""
    step = float(histories.compression_time_s[row]) / 24
    if np.isnan(step):
        return None
    time = _steps(12 * step, 191 * step, step)
    return Series(
        histories.measured(np.array([row]), time, step, chain)[0], 1 / step, float(time[0])
    )


def _steps(before_s: float, after_s: float, step_s: float) -> Floats:
    return (
        np.arange(-round(before_s / step_s), round(after_s / step_s) + 1, dtype=np.float64) * step_s
    )


def _width(series: Series) -> float:
    first, last = level_crossings(series.values[None], 0.5)
    return float(last[0] - first[0]) / series.sampling_rate_hz


def _aligned(series: Series | None, time_s: Floats) -> Floats:
    from scipy.interpolate import CubicSpline

    if series is None:
        return np.full(time_s.size, np.nan)
    first, _ = level_crossings(series.values[None], 0.5)
    place = first[0] + time_s * series.sampling_rate_hz
    inside = (place >= 0) & (place <= series.values.size - 1)
    curve = CubicSpline(np.arange(series.values.size), series.values)
    return np.where(inside, curve(np.where(inside, place, 0.0)), 0.0)
