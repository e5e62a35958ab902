"""The measured shots of the twin's bench whose settings are nearest to a shot, which its bands are
compared with."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from sqlalchemy import and_, select

from ....schema.benches import Hammer
from ....schema.campaigns import Campaign
from ....schema.configurations import configuration_factors
from ....schema.impacts import ChannelFigures, Impact, Pulse, Shot
from ....schema.listings import get_campaign_id
from ....schema.recordings import RecordedChannel
from ...common.quantities import cell, display_of
from ..sentence import BEYOND, INSIDE, NOT_ENOUGH, Number, Sentence, first_allowed, sentence
from .validity import beyond_rows

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ....schema.session import Store
    from ....twin.prediction import Prediction
    from ....twin.setting import Setting
    from ...twins.building import BuiltTwin

#: Shots that are shown, and shots that are read of a campaign.
SHOWN, _MOST = 5, 5000
#: Numbers of a setting that are compared; a factor of two in one counts as much as another
#: material.
_NUMBERS = ("tank_pressure_pa", "impact_velocity_m_s", "bullet_mass_kg", "tip_radius_m")
_WORDS = ("tip_material", "plate_material", "anvil_material", "insulator", "impact_position")
_MORE_AND_LESS = {
    "bullet_mass_kg": ("heavier", "lighter"),
    "impact_velocity_m_s": ("faster", "slower"),
}


@dataclass(frozen=True, eq=False)
class MeasuredShot:
    """A shot of the store.

    `setting`: its numbers in SI and its words, as far as they are known; `impact`: its key, None
    where no impact was extracted; `force_n`: equidistant points of the contact.
    """

    impact: int | None
    run: int
    repetition: int
    setting: Mapping[str, str | float]
    velocity_m_s: float | None
    contact_time_s: float | None
    peak_force_n: float | None
    force_n: Sequence[float]

    @property
    def name(self) -> str:
        return f"run {self.run}, repetition {self.repetition}"


#: Of twins that stay ready: reading takes longer than the answer to a slider.
_read: WeakKeyDictionary[BuiltTwin, tuple[MeasuredShot, ...]] = WeakKeyDictionary()


def shots_of(store: Store, built: BuiltTwin) -> tuple[MeasuredShot, ...]:
    """Of the campaign whose bench the twin has; none for the shipped bench."""
    if built not in _read:
        with store.reading() as session:
            campaign = built.bench.campaign
            _read[built] = () if campaign is None else tuple(_of_campaign(session, campaign))
    return _read[built]


def _of_campaign(session: Session, campaign: str) -> Iterator[MeasuredShot]:
    key = get_campaign_id(session, campaign)
    pulse = (Pulse.contact_time_s, Pulse.spline_peak_force_n, Pulse.force_points_n)
    in_use = and_(Pulse.impact_id == Impact.id, Pulse.current)
    of_gun = (
        select(Impact.id, Shot.run, Shot.repetition, Shot.configuration_id, Shot.tank_pressure_pa,
        Shot.bullet_mass_kg,
               Shot.measured_velocity_m_s, *pulse)
        .outerjoin(Impact, Shot.impact_id == Impact.id).outerjoin(Pulse, in_use)
        .where(Shot.campaign_id == key).order_by(Shot.run, Shot.repetition).limit(_MOST)
    )  # fmt: skip
    rows = [tuple(row) for row in session.execute(of_gun)]
    if not rows:
        hammer = (
            select(Hammer.mass_kg)
            .join(Campaign, Campaign.hammer_id == Hammer.id)
            .where(Campaign.id == key)
        )
        mass = session.scalar(hammer)
        of_hammer = (
            select(Impact.id, Impact.run, Impact.repetition, Impact.configuration_id,
            Impact.impact_velocity_m_s,
                   *pulse)
            .outerjoin(Pulse, in_use)
            .where(Impact.campaign_id == key).order_by(Impact.run, Impact.repetition).limit(_MOST)
        )  # fmt: skip
        rows = [(*row[:4], None, mass, *row[4:]) for row in session.execute(of_hammer)]
    factors = configuration_factors(session, list({row[3] for row in rows}))
    for impact, run, repetition, configuration, pressure, mass, velocity, time, peak, force in rows:
        own = factors[configuration]
        values = {
            "tank_pressure_pa": pressure,
            "bullet_mass_kg": mass,
            "tip_radius_m": own.get("tip_radius"),
        }
        if pressure is None:
            values["impact_velocity_m_s"] = velocity
        values |= {name: own.get(name) for name in _WORDS}
        setting = {name: value for name, value in values.items() if value is not None}
        yield MeasuredShot(impact, run, repetition, setting, velocity, time, peak, force or ())


def setting_values(setting: Setting) -> dict[str, str | float]:
    """The numbers and words of a setting under the names of `MeasuredShot.setting`."""
    values: dict[str, str | float | None] = {
        "tank_pressure_pa": setting.tank_pressure_pa,
        "impact_velocity_m_s": setting.impact_velocity_m_s,
        "bullet_mass_kg": setting.impactor_mass_kg,
        "tip_radius_m": setting.tip_radius_m,
        "tip_material": setting.tip.name,
        "plate_material": setting.plate.name,
        "anvil_material": setting.anvil.name if setting.anvil else "none",
        "insulator": setting.insulator,
        "impact_position": setting.impact_position,
    }
    return {name: value for name, value in values.items() if value is not None}


def distance(wanted: Mapping[str, str | float], shot: MeasuredShot) -> float:
    """Between two settings: each number by its logarithm to base 2, each word 1 where it differs.

    A gun's shot that is asked for by its velocity is compared with the measured velocity; what the
    shot does not state counts nothing.
    """
    return math.sqrt(sum(_steps(name, wanted, shot) ** 2 for name in (*_NUMBERS, *_WORDS)))


def _steps(name: str, wanted: Mapping[str, str | float], shot: MeasuredShot) -> float:
    wanted_value, measured = wanted.get(name), _value(name, shot)
    if wanted_value is None or measured is None:
        return 0.0
    if isinstance(wanted_value, str) or isinstance(measured, str):
        return float(str(wanted_value).lower() != str(measured).lower())
    return math.log2(measured / wanted_value) if measured > 0 and wanted_value > 0 else 1.0


def _value(name: str, shot: MeasuredShot) -> str | float | None:
    return shot.velocity_m_s if name == "impact_velocity_m_s" else shot.setting.get(name)


def difference_text(wanted: Mapping[str, str | float], shot: MeasuredShot) -> str:
    """How the measured shot differs: `3.35 bar less, 0.1 kg lighter, tip material PLA`."""
    return ", ".join(_difference_words(wanted, shot)) or "the same settings"


def _difference_words(wanted: Mapping[str, str | float], shot: MeasuredShot) -> Iterator[str]:
    for name in (*_NUMBERS, *_WORDS):
        if abs(_steps(name, wanted, shot)) < 0.005:
            continue
        wanted_value, measured = wanted[name], _value(name, shot)
        if isinstance(wanted_value, str) or isinstance(measured, str) or measured is None:
            yield f"{name.replace('_', ' ')} {measured}"
        else:
            more, less = _MORE_AND_LESS.get(name, ("more", "less"))
            size = f"{cell(name, abs(measured - wanted_value))} {display_of(name).unit}"
            quantity = {"tank_pressure_pa": " pressure", "tip_radius_m": " tip radius"}.get(
                name, ""
            )
            yield f"{size} {more if measured > wanted_value else less}{quantity}"


def nearest(wanted: Mapping[str, str | float], shots: Sequence[MeasuredShot]) -> list[MeasuredShot]:
    """The nearest first, at most `SHOWN`; shots of which nothing was measured are left out."""
    measured = [
        shot for shot in shots if shot.velocity_m_s is not None or shot.peak_force_n is not None
    ]
    return sorted(measured, key=lambda shot: distance(wanted, shot))[:SHOWN]


def nearest_rows(
    wanted: Mapping[str, str | float], shots: Sequence[MeasuredShot]
) -> list[dict[str, Any]]:
    """Rows of the table, in the shown units, with the address of the impact where there is one."""
    return [
        {
            "shot": shot.name,
            "address": None if shot.impact is None else f"/impacts/{shot.impact}",
            "difference": difference_text(wanted, shot),
            "velocity": cell("velocity_m_s", shot.velocity_m_s),
            "peak_force": cell("peak_force_n", shot.peak_force_n),
            "contact_time": cell("contact_time_s", shot.contact_time_s),
        }
        for shot in shots
    ]


def measured_spectra(
    store: Store, shots: Sequence[MeasuredShot]
) -> dict[int, dict[str, tuple[Any, Any]]]:
    """Frequencies (Hz) and maximax (m/s2) at Q = 10 of each sensor, by the key of the impact."""
    keys = [shot.impact for shot in shots if shot.impact is not None]
    rows = (
        select(ChannelFigures.impact_id, RecordedChannel.name, ChannelFigures.srs_frequency_hz,
               ChannelFigures.srs_maximax_m_s2)
        .join(RecordedChannel, ChannelFigures.channel_id == RecordedChannel.id)
        .where(ChannelFigures.impact_id.in_(keys))
    )  # fmt: skip
    spectra: dict[int, dict[str, tuple[Any, Any]]] = {}
    with store.reading() as session:
        for impact, sensor, frequency, maximax in session.execute(rows):
            spectra.setdefault(impact, {})[sensor] = np.asarray(frequency), np.asarray(maximax)
    return spectra


def velocity_basis(built: BuiltTwin, pressure_pa: float | None) -> Sentence | None:
    """What the band of the velocity stands on; None where the velocity is given."""
    gun = built.twin.gun
    if gun is None or pressure_pa is None:
        return None
    if gun.shots is None:
        return sentence(
            "No measured shot tells the velocity: its band stands on what is assumed of the gun.",
            NOT_ENOUGH,
            {"count": 0, "needed": 1},
        )
    readings = gun.shots.tank_pressure_pa
    ends = {"low": float(readings.min()), "high": float(readings.max())}
    shown: dict[str, Any] = {
        name: Number("tank_pressure_pa", pressure)
        for name, pressure in {**ends, "at": float(pressure_pa)}.items()
    }
    count = len(gun.shots)
    one_pressure = shown["low"].cell == shown["high"].cell
    text = (
        f"The velocity band stands on {{count}} measured shot{'s' if count > 1 else ''} "
        f"{'at {high}' if one_pressure else 'between {low.cell} and {high}'}"
    )
    return first_allowed(
        {"value": pressure_pa, **ends},
        (INSIDE, f"{text}."),
        (BEYOND, f"{text}; at {{at}} it is an extrapolation."),
        count=Number("shots", count, "count"),
        **shown,
    )


def known_rows(built: BuiltTwin, prediction: Prediction) -> list[dict[str, str]]:
    """What the bands stand on, and where the shot lies beyond it, as rows of one table: `asked`,
    `low` and `high` in `unit`, and the number of `shots`."""
    rows = []
    pressure, gun = prediction.setting.tank_pressure_pa, built.twin.gun
    if gun is not None and gun.shots is not None and pressure is not None:
        readings, shown = gun.shots.tank_pressure_pa, display_of("tank_pressure_pa")
        rows.append(
            {
                "quantity": f"{shown.label} of the shots that the velocity band stands on",
                "asked": cell("tank_pressure_pa", float(pressure)),
                "low": cell("tank_pressure_pa", float(readings.min())),
                "high": cell("tank_pressure_pa", float(readings.max())),
                "unit": shown.unit,
                "shots": str(len(gun.shots)),
            }
        )
    if prediction.rests_on.shots:
        rows.append(_known("shots that the bands rest on", shots=str(prediction.rests_on.shots)))
    for row in beyond_rows(prediction):
        low, high = str(row["known from"]), str(row["known to"])
        rows.append(
            _known(
                f"{row['quantity']}, beyond what is known",
                asked=str(row["asked for"]),
                low=low,
                high=high,
                unit=str(row["unit"]),
            )
        )
    return rows


def _known(quantity: str, **cells: str) -> dict[str, str]:
    empty = dict.fromkeys(("asked", "low", "high", "unit", "shots"), "")
    return {"quantity": quantity, **empty, **cells}
