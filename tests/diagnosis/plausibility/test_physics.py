"""No effect of the catalogue is taken for a mislabelled record, wherever in its likely range it
acts."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.diagnosis.observables.contact.stage import ContactObservables
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.plausibility.channels import channel_findings
from pyroshock.diagnosis.plausibility.units import unit_findings
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration, Series
from pyroshock.twin.contact.effects.effective_mass import EffectiveMass
from pyroshock.twin.effects import Effect, catalogue
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.plate.modal import PlateEffect
from pyroshock.twin.sensors.effect import SensorEffect
from support.records.contact_campaigns import hammer_record
from support.records.plate_folders import plate_record, small_plate

SETTINGS = [(p, m) for p in (0.6e5, 4.8e5) for m in (0.25, 1.0)]


class PlayedGun(GunObservables):
    """Measures what effects make of its own shots."""

    played: Sequence[Effect] = ()

    def measured(self) -> Floats:
        return self.simulated(self.played)


class PlayedContact(ContactObservables):
    """Measures what effects make of its own impacts."""

    played: Sequence[Effect] = ()

    def measured(self) -> Floats:
        return self.simulated(self.played)


def ends(kind: type[Effect]) -> list[Effect]:
    """Every corner of the likely ranges; what has none stays as it is."""
    ranges = [[(p.name, end) for end in p.likely or ()] or [None] for p in kind.parameters()]
    return [kind(**dict(pair for pair in corner if pair)) for corner in itertools.product(*ranges)]


def gun_record() -> CampaignRecord:
    configurations = tuple(
        RunConfiguration(f"shot {i}", {"tank_pressure": p}) for i, (p, _) in enumerate(SETTINGS)
    )
    runs = tuple(Run(i, i + 1, 1, i, p, m, 10.0) for i, (p, m) in enumerate(SETTINGS))
    bench = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
    return CampaignRecord("shots", "gun", configurations, runs, gun=bench)


@pytest.mark.parametrize("name", list(catalogue()))
def test_no_effect_on_gun_or_contact_is_refused(name: str) -> None:
    assert refusals(ends(catalogue()[name])[-1:]) == []


@pytest.mark.parametrize("factor", [4.93, 5.56, 6.27])
def test_mass_that_raises_the_force_by_the_factor_of_a_unit_is_not_refused(factor: float) -> None:
    """In feet per second, in kilometres per hour, in pounds: a wrong unit does not lengthen
    pulses."""
    assert refusals([EffectiveMass(mass_factor=factor)]) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", list(catalogue()))
def test_no_effect_on_gun_or_contact_is_refused_at_any_corner(name: str) -> None:
    assert refusals(ends(catalogue()[name])) == []


class SoftContact(ContactObservables):
    """Measures its own impacts as through a soft layer: a fifth of the peak, half of the impulse,
    twice the width."""

    def measured(self) -> Floats:
        factors = {"ln_peak": 0.2, "ln_impulse": 0.51, "ln_width_half": 2.2, "ln_width_tenth": 2.9}
        return self.simulated() + np.log([factors.get(item.name, 1.0) for item in self.observables])


def test_a_soft_contact_whose_impulse_is_right_is_not_named() -> None:
    """Peak and impulse together are .33 of the simulated ones, as a velocity in feet per second
    would make them; but the impulse alone is what momentum allows without restitution."""
    record = hammer_record(repetitions=1)
    assert unit_findings(record, [SoftContact(record)]) == []


def refusals(effects: Sequence[Effect]) -> list[str]:
    """What gun and contact are refused for where each effect acts alone."""
    gun, contact, findings = gun_record(), hammer_record(repetitions=1), []
    for effect in effects:
        fired, struck = PlayedGun(gun), PlayedContact(contact)
        fired.played = struck.played = (effect,)
        findings += [*unit_findings(gun, [fired]), *unit_findings(contact, [struck])]
    return [finding.message for finding in findings if finding.severity == "refuse"]


@pytest.mark.parametrize(
    "name", [n for n, kind in catalogue().items() if issubclass(kind, PlateEffect | SensorEffect)]
)
def test_no_effect_on_the_plate_is_refused(name: str) -> None:
    for effect in ends(catalogue()[name]):
        record = (
            plate_record(effect.apply(small_plate()))
            if isinstance(effect, PlateEffect)
            else plate_record()
        )
        if isinstance(effect, SensorEffect):
            record = replace(record, runs=tuple(shown(run, effect) for run in record.runs))
        assert [
            finding.message for finding in channel_findings(record) if finding.severity == "refuse"
        ] == []


def shown(run: Run, effect: SensorEffect) -> Run:
    """What the sensors show of a run."""

    def through(hook: str, series: Series) -> Series:
        return replace(
            series, values=getattr(effect, hook)(series.values, 1 / series.sampling_rate_hz)
        )

    accelerations = {
        n: through("measured_acceleration_m_s2", s) for n, s in run.accelerations.items()
    }
    return replace(run, force=through("measured_force_n", run.force), accelerations=accelerations)
