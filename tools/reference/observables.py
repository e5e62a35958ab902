"""Every number by which a diagnosis compares measurement and simulator, stage by stage."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from pyroshock.diagnosis.observable_families import family_of
from pyroshock.diagnosis.observables.base import Observable
from pyroshock.diagnosis.observables.contact import features as contact_features
from pyroshock.diagnosis.observables.contact.features import OBSERVABLES
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.observables.plate import stage as plate_columns
from pyroshock.diagnosis.observables.plate.signals import PlateSignals
from pyroshock.diagnosis.observables.plate.spectra import Spectra
from pyroshock.diagnosis.observables.plate.stage import Columns
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration
from pyroshock.twin.gun.bench import GunBench

from .markdown import code, escaped, joined, prose, table

_HEADER = ["observable", "channel", "family", "unit", "tolerance", "floor", "detail"]


def page() -> str:
    """A section a stage, and what the columns mean."""
    return joined(
        prose(Observable.__doc__),
        "## Gun",
        "One number a shot. The floor is the median stated uncertainty of "
        "the velocity; here that of none stated.",
        _table(of_gun()),
        "## Contact",
        prose(contact_features.features.__doc__),
        _table(OBSERVABLES),
        "## Plate",
        prose(plate_columns.__doc__),
        "Here of one mode at 1000 Hz, one accelerometer, one line of its spectrum and one window; "
        "a campaign has each of them for every mode that it shows, every channel, three lines an "
        "octave, and what follows the shock.",
        _table(of_plate()),
    )


def of_gun() -> tuple[Observable, ...]:
    """Of one shot."""
    shot = Run(0, 1, 1, 0, tank_pressure_pa=1e5, bullet_mass_kg=1.0, velocity_m_s=5.0)
    record = CampaignRecord("one shot", "gun", (RunConfiguration("1", {}),), (shot,), gun=_gun())
    return GunObservables(record).observables


def of_plate() -> tuple[Observable, ...]:
    """Of one mode and one channel, in the order of the stage; `Columns` asks its modes for no more
    than this."""
    signals = PlateSignals(
        acceleration=np.zeros((1, 1, 5000)),
        channels=("acceleration_1",),
        first_s=np.zeros(1),
        rate_hz=1e5,
        force=(None,),
        ringing=100,
        points=("#1",),
        assumptions=(),
    )
    spectra = Spectra(np.array([1000.0]), signals.rate_hz, ((4000, 5000),))
    modes: Any = SimpleNamespace(
        frequency_hz=np.array([1000.0]), clear=np.ones((1, 1), dtype=bool), weight=np.ones((1, 1))
    )
    return Columns(signals, spectra, modes).observables()


def _gun() -> GunBench:
    return GunBench(
        tank_volume_m3=0.01,
        bore_diameter_m=0.05,
        projectile_diameter_m=0.05,
        travel_m=1.0,
        friction_coefficient=0.5,
        heat_capacity_ratio=1.4,
        efficiency=0.5,
    )


def _table(observables: Sequence[Observable]) -> str:
    rows = [
        (
            code(each.name),
            escaped(each.channel),
            family_of(each),
            each.unit,
            f"{each.tolerance:g}",
            f"{each.floor:g}",
            "yes" if each.detail else "",
        )
        for each in observables
    ]
    return table(_HEADER, rows)
