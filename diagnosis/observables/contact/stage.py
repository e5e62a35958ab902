"""The contact as a stage of a diagnosis: the elastic Hertz impact, given the recorded impact velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from ....twin.contact.effect import ContactEffect
from ....twin.effects import Effect, catalogue
from ....twin.sensors.chain import SensorChain
from ...record import CampaignRecord, Series
from ..base import Floats, Observable, Stage, Upstream
from ..batching import by_kinds, stacked
from .effect_relevance import acts, concerns
from .features import NAMES, OBSERVABLES, series_features
from .force_histories import Courses, law_courses
from .measured_features import seen_features
from .rows import Rows, split, taken, true_velocity
from .site import sites_of
from .uncertain_settings import contact_nuisances

#: Where nothing is recorded: as the thesis records its hammer (chapter 4).
_ASSUMED_RATE_HZ = 51_200.0


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
        return tuple(each for each, kind in catalogue().items() if acts(kind, nominal))

    def measured(self) -> Floats:
        if self._measured is None:
            nothing = np.full(len(NAMES), np.nan)
            each = [nothing if run.force is None else series_features(run.force) for run in self.record.runs]
            self._measured = np.array(each).reshape(-1, len(NAMES))
        return self._measured.copy()

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        return self.features_of(np.arange(len(self.sites)), effects, upstream)

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> list[Series | None]:
        contact, chain = split(effects)
        rows = np.arange(len(self.sites))
        courses = self.courses(rows, contact, self.entering_m_s(rows, chain, upstream))
        return [courses.series(int(row), float(self.step_s[row])) for row in rows]

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        runs = self.representatives()
        known = np.flatnonzero(runs >= 0)
        found = np.zeros((len(sets), len(runs), len(NAMES)))
        found[:, runs < 0] = np.nan
        mine = [[taken(each, known) for each in effects if concerns(type(each))] for effects in sets]
        nominal = self.features_of(runs[known])
        for places in by_kinds(mine):
            together = stacked([mine[place] for place in places], len(known))
            seen = self.features_of(np.tile(runs[known], len(places)), together)
            found[np.ix_(np.array(places), known)] = seen.reshape(len(places), len(known), -1) - nominal
        return found

    def nuisances(self) -> dict[str, Floats]:
        return dict(self._nuisances)

    def representatives(self) -> Rows:
        """(C,): the run of each configuration with its median velocity; -1 where there is none with a velocity."""
        chosen = np.full(len(self.record.configurations), -1)
        belongs = self.record.configuration_of
        for configuration in range(len(chosen)):
            rows = np.flatnonzero((belongs == configuration) & (self.recorded_m_s > 0))
            if len(rows):
                chosen[configuration] = rows[np.argsort(self.recorded_m_s[rows], kind="stable")[(len(rows) - 1) // 2]]
        return chosen

    def features_of(self, rows: Rows, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        """(k, d): what records of the runs `rows` (k,) would show; effects' parameters are numbers or (k,)."""
        contact, chain = split(effects)
        return seen_features(
            self.courses(rows, contact, self.entering_m_s(rows, chain, upstream)), self.step_s[rows], chain
        )

    def courses(self, rows: Rows, effects: tuple[ContactEffect, ...], velocity_m_s: Floats) -> Courses:
        """True forces of the runs `rows` (k,) at true velocities (k,)."""
        return law_courses(self.sites.take(rows), effects, velocity_m_s)

    def entering_m_s(self, rows: Rows, chain: SensorChain, upstream: Upstream | None = None) -> Floats:
        """True velocities (k,) of the runs `rows`: from the readings through the chain, or those of the gun."""
        if upstream is not None:
            return np.array(upstream, dtype=np.float64)[rows]
        return true_velocity(chain, self.recorded_m_s[rows])

    def _uncertain(self, uncertain: Mapping[str, float]) -> dict[str, Floats]:
        """NaN where a configuration has no run with a velocity."""
        runs = self.representatives()
        known = runs[runs >= 0]
        each = contact_nuisances(self.sites.take(known), self.recorded_m_s[known], self.step_s[known], uncertain)
        found = {name: np.full((len(runs), len(NAMES)), np.nan) for name in each}
        for name, values in each.items():
            found[name][runs >= 0] = values
        return found


def _rate_hz(record: CampaignRecord, run: int) -> float:
    """Of the run's force, else of what else it records, else as hammer campaigns are recorded."""
    of = record.runs[run]
    recorded = [of.force, *of.accelerations.values()]
    return next((series.sampling_rate_hz for series in recorded if series is not None), _ASSUMED_RATE_HZ)
