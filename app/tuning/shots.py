"""Spectra of shots that are in the store, as the tuner learns from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...ingest.stored import list_channels, read_channel
from ...schema.configurations import configuration_factors
from ...schema.listings import get_campaign_id
from ...schema.recordings import RecordedChannel
from ...schema.shots import Shot
from ...twin.materials import Material
from ...twin.setting import Setting
from ...twin.tune.forward import level_db
from ...twin.tune.tuner import Measured

Floats = NDArray[np.float64]

NONE = "none"
#: From this share of the sensor's range on, a record is taken for clipped.
CLIPPED = 0.99
#: A peak below so many standard deviations of what the sensor shows before the trigger is no shock.
SILENT = 10.0


@dataclass(frozen=True)
class PlateFigures:
    """A plate as a setting names it."""

    thickness_m: float
    mass_kg: float


@dataclass(frozen=True, eq=False)
class ShotReader:
    """Reads a campaign's shots as `Measured` at `frequency_hz` (f,), Q `q`, one sensor.

    `material` knows them by name; `plates` go by their material. `position` is where shots hit that do not say.
    """

    session: Session
    frequency_hz: Floats
    q: float
    sensor: str
    material: Callable[[str], Material]
    plates: Mapping[str, PlateFigures]
    position: str = "#1"

    def measured(self, campaign: str) -> tuple[Measured, list[str]]:
        """Its shots, and why some are left out. Raises `LookupError` for an unknown campaign."""
        key = get_campaign_id(self.session, campaign)
        settings, levels, left_out = [], [], []
        for shot in self.session.scalars(select(Shot).where(Shot.campaign_id == key).order_by(Shot.id)):
            try:
                setting, level = self._setting(shot), self._level_db(shot)
            except (ValueError, LookupError) as error:
                left_out.append(f"run {shot.run}, repetition {shot.repetition}: {error}")
                continue
            settings.append(setting)
            levels.append(level)
        return Measured(tuple(settings), np.array(levels)) if settings else Measured(), left_out

    def _setting(self, shot: Shot) -> Setting:
        words = configuration_factors(self.session, [shot.configuration_id])[shot.configuration_id]
        plate = self.material(str(words.get("plate_material", next(iter(self.plates)))))
        if plate.name not in self.plates:
            raise ValueError(f"no modes of its plate of {plate.name}")
        if "tip_material" not in words or "tip_radius" not in words:
            raise ValueError("no tip_material, or no tip_radius")
        anvil = str(words.get("anvil_material", NONE))
        return Setting(
            impactor_mass_kg=shot.bullet_mass_kg,
            tip=self.material(str(words["tip_material"])),
            tip_radius_m=float(words["tip_radius"]),
            plate=plate,
            plate_thickness_m=self.plates[plate.name].thickness_m,
            plate_mass_kg=self.plates[plate.name].mass_kg,
            tank_pressure_pa=shot.tank_pressure_pa,
            anvil=None if anvil == NONE else self.material(anvil),
            insulator=str(words.get("insulator", NONE)),
            impact_position=str(words.get("impact_position", self.position)),
        )

    def _level_db(self, shot: Shot) -> Floats:
        """(f,) dB re 1 m/s2 of the sensor's whole record, less its level before the trigger."""
        from ...signals.srs.spectrum import shock_response_spectrum

        row = self._channel(shot)
        channel = read_channel(self.session, row)
        record, full_scale = np.asarray(channel.si, dtype=np.float64), channel.sensor.range_si
        if full_scale is not None and np.abs(record).max() >= CLIPPED * full_scale:
            raise ValueError(f"{self.sensor} reached its full scale")
        quiet = record[: max(1, record.size // 10)]
        if np.abs(record - np.median(quiet)).max() < SILENT * quiet.std():
            raise ValueError(f"{self.sensor} shows no shock: the bullet did not hit")
        spectrum = shock_response_spectrum(record - np.median(quiet), row.sampling_rate_hz, self.frequency_hz, q=self.q)
        return level_db(spectrum.maximax)

    def _channel(self, shot: Shot) -> RecordedChannel:
        rows = list_channels(self.session, shot.recording_id) if shot.recording_id is not None else []
        for row in rows:
            if row.name == self.sensor:
                return row
        raise ValueError(f"no channel {self.sensor}" if rows else "no recording")
