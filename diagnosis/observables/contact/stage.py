"""The contact as a stage of a diagnosis: the elastic Hertz impact, given the recorded impact velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import ClassVar

import numpy as np

from ....twin.contact.bodies import Bodies, MissingQuantityError
from ....twin.contact.effect import ContactEffect
from ....twin.contact.impacts import Impacts
from ....twin.effects import Effect, catalogue
from ....twin.sensors.chain import SensorChain
from ...record import CampaignRecord, Series
from ..base import Floats, Observable, Stage, Upstream, changes_reading, sensor_chain
from ..batching import Rows, at_rows, by_kinds, stacked
from .features import NAMES, OBSERVABLES, series_features
from .force_histories import ForceHistories, law_histories, measured_features
from .site import sites_of

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
#: Share of an uncertain quantity: small enough for a derivative, large enough for the digits of features.
_STEP = 0.03


class ContactStage(Stage):
    """A mass with the tip's radius on a rigid target of the first layer's material, without loss.

    The mass is the hammer's nominal one, or the bullet's. `uncertain` are relative standard deviations of nominal
    quantities, {"impactor_mass_kg": 0.02}. Raises `ValueError` naming what a record does not tell, and an uncertain
    quantity that the impact has not.
    """

    name: ClassVar[str] = "contact"

    def __init__(self, record: CampaignRecord, uncertain: Mapping[str, float] | None = None) -> None:
        super().__init__(record)
        self.sites = sites_of(record)
        self.recorded_m_s = np.array(
            [np.nan if run.velocity_m_s is None else run.velocity_m_s for run in record.runs], dtype=np.float64
        )
        self.step_s = np.array([1 / _rate_hz(record, run) for run in range(len(record.runs))])
        self._measured: Floats | None = None
        self._nuisances = self._uncertain(uncertain or {})

    @property
    def simulator(self) -> str:
        return "contact:hertz"

    @property
    def observables(self) -> tuple[Observable, ...]:
        return OBSERVABLES

    @property
    def shows(self) -> tuple[str, ...]:
        if not any(run.force is not None for run in self.record.runs):
            return ()
        nominal = self.sites.impacts(np.ones(len(self.sites)))
        return tuple(identity for identity, kind in catalogue().items() if is_active(kind, nominal))

    def measured(self) -> Floats:
        if self._measured is None:
            nothing = np.full(len(NAMES), np.nan)
            rows = [nothing if run.force is None else series_features(run.force) for run in self.record.runs]
            self._measured = np.array(rows).reshape(-1, len(NAMES))
        return self._measured.copy()

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        return self.features_of(np.arange(len(self.sites)), effects, upstream)

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> list[Series | None]:
        contact, chain = split_effects(effects)
        rows = np.arange(len(self.sites))
        histories = self.histories(rows, contact, self.entering_m_s(rows, chain, upstream))
        return [histories.series(int(row), float(self.step_s[row])) for row in rows]

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        runs = self.representatives()
        known = np.flatnonzero(runs >= 0)
        changes = np.zeros((len(sets), len(runs), len(NAMES)))
        changes[:, runs < 0] = np.nan
        acting = [at_rows([e for e in effects if applies_to_contact(type(e))], known) for effects in sets]
        nominal = self.features_of(runs[known])
        for places in by_kinds(acting):
            together = stacked([acting[place] for place in places], len(known))
            features = self.features_of(np.tile(runs[known], len(places)), together)
            changes[np.ix_(np.array(places), known)] = features.reshape(len(places), len(known), -1) - nominal
        return changes

    def representatives(self) -> Rows:
        """(C,): the run of each configuration with its median velocity; -1 where there is none with a velocity."""
        return self.median_runs(np.where(self.recorded_m_s > 0, self.recorded_m_s, np.nan))

    def features_of(self, rows: Rows, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        """(k, d): what records of the runs `rows` (k,) would show; effects' parameters are numbers or (k,)."""
        contact, chain = split_effects(effects)
        histories = self.histories(rows, contact, self.entering_m_s(rows, chain, upstream))
        return measured_features(histories, self.step_s[rows], chain)

    def histories(self, rows: Rows, effects: tuple[ContactEffect, ...], velocity_m_s: Floats) -> ForceHistories:
        """True forces of the runs `rows` (k,) at true velocities (k,)."""
        return law_histories(self.sites.take(rows), effects, velocity_m_s)

    def entering_m_s(self, rows: Rows, chain: SensorChain, upstream: Upstream | None = None) -> Floats:
        """True velocities (k,) of the runs `rows`: from the readings through the chain, or those of the gun."""
        if upstream is not None:
            return np.array(upstream, dtype=np.float64)[rows]
        return true_velocity(chain, self.recorded_m_s[rows])

    def _uncertain(self, uncertain: Mapping[str, float]) -> dict[str, Floats]:
        """(C, d) by name: the features' derivative for a quantity's logarithm times its relative standard deviation.

        Of Hertz' impact, by central differences; NaN where a configuration has no run with a velocity.
        """
        for name, sd in uncertain.items():
            if name not in UNCERTAIN:
                raise ValueError(f"no uncertain quantity {name!r} of the contact; there are: {', '.join(UNCERTAIN)}")
            if not (np.isfinite(sd) and sd >= 0):
                raise ValueError(f"uncertain {name} = {sd!r}: expected a relative standard deviation, not negative")
        runs = self.representatives()
        known = runs[runs >= 0]
        sites = self.sites.take(known)

        def shown(name: str, factor: float) -> Floats:
            bodies, velocity = sites.bodies, self.recorded_m_s[known]
            if name == _VELOCITY:
                velocity = velocity * factor
            else:
                bodies = replace(bodies, **{name: getattr(bodies, name) * factor})
            histories = law_histories(replace(sites, bodies=bodies), (), velocity)
            return measured_features(histories, self.step_s[known], SensorChain())

        nuisances = {name: np.full((len(runs), len(NAMES)), np.nan) for name, sd in uncertain.items() if sd > 0}
        for name, values in nuisances.items():
            change = uncertain[name] * (shown(name, 1 + _STEP) - shown(name, 1 - _STEP))
            values[runs >= 0] = change / np.log((1 + _STEP) / (1 - _STEP))
        return nuisances


def _rate_hz(record: CampaignRecord, run: int) -> float:
    """Of the run's force, else of what else it records, else as hammer campaigns are recorded."""
    recorded = [record.runs[run].force, *record.runs[run].accelerations.values()]
    return next((series.sampling_rate_hz for series in recorded if series is not None), _ASSUMED_RATE_HZ)


def applies_to_contact(kind: type[Effect]) -> bool:
    """Whether it is an effect of the contact, or of the sensors on either side of it."""
    return issubclass(kind, ContactEffect) or changes_reading(kind, "measured_force_n", "measured_velocity_m_s")


def is_active(kind: type[Effect], nominal: Impacts) -> bool:
    """Whether it changes anything of these impacts or of their record."""
    if not issubclass(kind, ContactEffect):
        return applies_to_contact(kind)
    try:
        changed = kind().prepare(nominal)
    except MissingQuantityError:
        return False
    quantities = (name for name, value in vars(nominal).items() if isinstance(value, np.ndarray))
    return any(not np.array_equal(getattr(changed, name), getattr(nominal, name)) for name in quantities)


def split_effects(effects: Sequence[Effect]) -> tuple[tuple[ContactEffect, ...], SensorChain]:
    """Those of the contact in their order, and those of the sensors as a chain; of other stages none."""
    return tuple(effect for effect in effects if isinstance(effect, ContactEffect)), sensor_chain(effects)


def true_velocity(chain: SensorChain, reading_m_s: Floats) -> Floats:
    """Velocities (n,) from readings: the chain walked backwards, exact for gains and offsets."""
    low, high = chain.measured_velocity_m_s(reading_m_s), chain.measured_velocity_m_s(2 * reading_m_s)
    slope = (high - low) / reading_m_s
    return np.asarray(reading_m_s + (reading_m_s - low) / slope)
