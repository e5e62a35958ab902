"""Any contact model as the simulator of a diagnosis: effects correct its pulses by similarity.

What an effect does to Hertz' impact it is taken to do to the model's pulse: peak and compression
time by the same factors, and the shape, force over peak at times over the compression time, by the
same difference. For a mass that the model never saw these are Hertz' laws of similarity: peak ~
m^0.6, times ~ m^0.4, impulse ~ m.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ....array_types import Floats, Rows
from ....twin import contact_interface
from ....twin.contact.effects_on_pulses import changed_force
from ....twin.contact.impacts import ContactEffect
from ....twin.setting import Setting
from ...record import CampaignRecord, Run
from .force_histories import PLACES, ForceHistories, impactor_mass_kg, law_histories, layers
from .stage import ContactObservables

#: A predictor's name; and a mass for models that do not ask for it.
_PLATE_MASS, _UNASKED_KG = "plate_mass", 1.0


class RegisteredContactStage(ContactObservables):
    """A registered model, or any `twin.strikes.ContactStage`, at the campaign's settings and
    recorded velocities.

    `plate_mass_kg` is for models that ask for it, as the gun's do. Uncertain quantities act as in
    Hertz' impact. Raises `ValueError` for settings that the twin does not know, such as an
    insulator without an anvil, and for what a model asks in vain.
    """

    def __init__(
        self,
        record: CampaignRecord,
        contact: contact_interface.ContactStage,
        uncertain: Mapping[str, float] | None = None,
        *,
        plate_mass_kg: float | None = None,
    ) -> None:
        super().__init__(record, uncertain)
        # a law is not registered, and asks for nothing more
        predictors = getattr(getattr(contact, "registered", None), "predictors", ())
        if plate_mass_kg is None and any(predictor.name == _PLATE_MASS for predictor in predictors):
            raise ValueError(
                f"{contact.label} asks for the plate's mass, which a record "
                f"does not tell: give plate_mass_kg"
            )
        self.contact = contact
        self.simulator = (
            contact.label if contact.label.startswith("models:") else f"contact:{contact.label}"
        )
        self.settings = [_setting(record, run, plate_mass_kg or _UNASKED_KG) for run in record.runs]

    def _contacts(
        self, runs: Rows, effects: tuple[ContactEffect, ...], velocity_m_s: Floats
    ) -> ForceHistories:
        base = self._answers(runs, velocity_m_s)
        if not effects:
            return base
        sites = self.sites.take(runs)
        return corrected(
            base,
            law_histories(sites, (), velocity_m_s),
            law_histories(sites, effects, velocity_m_s),
        )

    def _answers(self, rows: Rows, velocity_m_s: Floats) -> ForceHistories:
        """The model's own answers; each setting and velocity is asked once."""
        histories = ForceHistories.none(len(rows))
        moving = np.flatnonzero(velocity_m_s > 0)
        cases, places = np.unique(
            np.stack([rows[moving], velocity_m_s[moving]]), axis=1, return_inverse=True
        )
        if not cases.shape[1]:
            return histories
        settings = [self.settings[int(row)] for row in cases[0]]
        compression, force = tabulated(
            self.contact.pulses(contact_interface.ImpactBatch(settings, cases[1]))
        )
        histories.compression_time_s[moving], histories.force_n[moving] = (
            compression[places],
            force[places],
        )
        return histories


def tabulated(pulses: contact_interface.ForcePulses) -> tuple[Floats, Floats]:
    """Compression times (n,) and forces (n, p) at `PLACES` times these.

    The compression is said to end at the peak, which Akima's curve may have between two phases.

    Parameters:
        pulses: Forces of n impacts at phases of the contact.
    """
    from scipy.interpolate import Akima1DInterpolator

    phase = np.linspace(0.0, 1.0, pulses.force_n.shape[1])
    dense = np.linspace(0.0, 1.0, 1001)
    force = Akima1DInterpolator(phase, pulses.force_n, axis=1)(dense)
    compression = dense[np.argmax(force, axis=1)] * pulses.contact_time_s
    phases = PLACES * (compression / pulses.contact_time_s)[:, None]
    rows = [
        np.interp(places, dense, values, right=0.0)
        for places, values in zip(phases, force, strict=True)
    ]
    return np.asarray(compression), np.maximum(np.array(rows), 0.0)


def corrected(
    base: ForceHistories, without: ForceHistories, with_effects: ForceHistories
) -> ForceHistories:
    """The pulses of n contacts, changed as effects change those of a law.

    Parameters:
        base: The pulses of the model, without effects.
        without: The pulses of the law for the same contacts, without effects.
        with_effects: The pulses of the law for the same contacts, with effects.
    """
    force = changed_force(base.force_n, without.force_n, with_effects.force_n)
    time = base.compression_time_s * with_effects.compression_time_s / without.compression_time_s
    return ForceHistories(force, time)


def _setting(record: CampaignRecord, run: Run, plate_mass_kg: float) -> Setting:
    configuration = record.configurations[run.configuration]
    tip, plate, anvil = layers(record, configuration)
    return Setting(
        impactor_mass_kg=impactor_mass_kg(record, run),
        tip=tip,
        tip_radius_m=float(configuration.factors["tip_radius"]),
        plate=plate,
        plate_thickness_m=record.plate_thickness_m,
        plate_mass_kg=plate_mass_kg,
        impact_velocity_m_s=1.0,
        anvil=anvil,
        insulator=str(configuration.factors.get("insulator", "none")),
        impact_position=str(configuration.factors.get("impact_position", "#1")),
        boundary_conditions=str(configuration.factors.get("boundary_conditions", "free")),
    )
