"""What measured shots of a campaign teach a twin, stage by stage, what its bands then rest on, and
the registered model in use for a kind of bench."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from sqlalchemy import select

from ...schema.impacts import BEFORE_CONTACT, DatasetSnapshot, Impact, Shot, velocity_kind
from ...schema.listings import get_campaign_id
from ...twin.contact.prior import MOST_PULSES, PriorContact
from ...twin.coupled_contact import CoupledContact
from ...twin.gun.nominal import beyond_energy, escape_speed_m_s
from ...twin.gun.shot import ROOM_K
from ...twin.gun.stage import GunStage
from ...twin.measured_shots import MeasuredShots
from ...twin.prediction import RestsOn
from ...twin.spectrum_calibration import SpectrumCalibration

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...training.registry.records import Version
    from ...training.registry.registry import Registry
    from ...twin.chain import Twin
    from ...twin.contact_interface import ContactStage
    from ...twin.plate.modal import ModalPlate


#: Shots whose records a twin reads: evenly picked ones of more. That takes some seconds.
MOST_SHOTS = 400


@runtime_checkable
class PulseLearner(Protocol):
    """A contact stage that knows how many measured pulses it has learned from."""

    @property
    def shots(self) -> int: ...


def taught_gun(
    session: Session, campaign: str, gun: GunStage, without: Collection[int]
) -> tuple[GunStage, str]:
    """The gun after the campaign's measured velocities, but for those of configurations that are
    left out; and a note on those that the stated bench could not have given. Shots without a mount
    count, too: the gun knows none.

    A few of many shots beyond the energy of the gas are mistakes and left out. Where half of them
    are beyond it or more, the bench is stated wrong: then all are believed. A velocity before
    contact that only the impact has counts as one of the shot.
    """
    own, of_impact = Shot.measured_velocity_m_s, Impact.impact_velocity_m_s
    query = (
        select(
            Shot.tank_pressure_pa, Shot.bullet_mass_kg, own, Shot.measured_velocity_u_m_s,
            of_impact, Impact.impact_velocity_u_m_s, Impact.velocity_source,
        )
        .outerjoin(Impact, Shot.impact_id == Impact.id)
        .where(
            Shot.campaign_id == get_campaign_id(session, campaign),
            Shot.tank_pressure_pa > 0,
            Shot.bullet_mass_kg > 0,
            Shot.configuration_id.not_in(without),
        )
    )  # fmt: skip
    rows = [
        (
            pressure,
            mass,
            velocity or impact_velocity,
            (of_velocity if velocity else of_its_impact) or 0.0,
        )
        for (
            pressure,
            mass,
            velocity,
            of_velocity,
            impact_velocity,
            of_its_impact,
            source,
        ) in session.execute(query)
        if velocity or (impact_velocity and velocity_kind(source) == BEFORE_CONTACT)
    ]
    if not rows:
        return gun, ""
    pressure, mass, measured, uncertainty = np.array(rows, dtype=np.float64).T
    beyond = beyond_energy(gun.bench, pressure, mass, measured)
    faster_than_gas = measured > escape_speed_m_s(gun.bench.heat_capacity_ratio, ROOM_K)
    believed = ~faster_than_gas & (
        ~beyond if 2 * int(beyond.sum()) < beyond.size else np.ones_like(beyond)
    )
    if believed.any():
        gun = gun.updated(*(values[believed] for values in (pressure, mass, measured, uncertainty)))
    left_out, unlikely = int(np.sum(~believed)), int(np.sum(beyond & believed))
    more_energy = "more energy than the gas of the stated bench can give"
    notes = [
        f"; {left_out} of {believed.size} shots have {more_energy}: left out" if left_out else "",
        f"; {unlikely} of {believed.size} shots have {more_energy}: check the tank's volume and "
        "the travel of the bench and the unit of the pressures; the velocity follows the shots"
        if unlikely else "",
    ]  # fmt: skip
    return gun, "".join(notes)


def taught_contact(contact: ContactStage, shots: MeasuredShots) -> ContactStage:
    """A prior of the contact after measured pulses; a law and a registered model stay what they
    are."""
    if not isinstance(contact, PriorContact) or not len(shots):
        return contact
    return contact.updated(shots.evenly(MOST_PULSES))


def calibrated(
    twin: Twin, shots: MeasuredShots, plate: Callable[[str], ModalPlate] | None
) -> tuple[Twin, str]:
    """The twin with what shots teach of spectra, and a note.

    `plate` gives the modes of further materials that shots hit; None where modes were measured. Of
    a plate whose modes were measured, and that no shots are of, the spread of the plate's ensemble
    says what is not known.
    """
    if not twin.sensor_names:
        return twin, ""
    if not len(shots):
        untaught = SpectrumCalibration.untaught(twin.sensor_names, twin.frequency_hz)
        return (twin if plate is None else replace(twin, calibration=untaught)), ""
    if plate is not None:
        others = {setting.plate.name for setting in shots.settings} - set(twin.plate.plates)
        further_plates = {name: plate(name) for name in sorted(others)}
        twin = replace(
            twin, plate=replace(twin.plate, plates={**twin.plate.plates, **further_plates})
        )
    calibration = SpectrumCalibration.of(shots, twin.replayed_db(shots))
    return replace(
        twin, calibration=calibration
    ), f"spectra: learned from {calibration.shots} measured shots"


def basis(twin: Twin, campaign: str | None) -> RestsOn:
    """What the bands of a twin rest on, in one sentence."""
    contact = twin.contact.base if isinstance(twin.contact, CoupledContact) else twin.contact
    label = twin.contact.label
    of_gun = 0 if twin.gun is None or twin.gun.shots is None else len(twin.gun.shots)
    of_contact = contact.shots if isinstance(contact, PulseLearner) else 0
    of_spectra = twin.calibration.shots if twin.calibration is not None else 0
    most = max(of_gun, of_spectra, of_contact if isinstance(contact, PriorContact) else 0)
    together = " solved together with the plate" if contact is not twin.contact else ""
    if isinstance(contact, PriorContact):
        number = "them" if of_contact == most else f"{of_contact} of them"
        updated, ranges = (
            f"yield, loss and layer updated by {number}",
            "its documented ranges of yield, loss, plate and layer",
        )
        what = f"the law{together} with {updated if of_contact else ranges}"
    elif isinstance(contact, PulseLearner):
        what = (
            f"the registered model {label.removeprefix('models:/')}, trained on {of_contact} pulses"
        )
    else:
        what = f"the law {label}{together} with the error of its table"
    if not most and isinstance(contact, PriorContact):
        sentence = "they show the documented ranges of yield, loss, plate and layer"
        return RestsOn(0, label, f"The bands rest on no measured shot of this bench: {sentence}.")
    if not most:
        sentence = f"the contact is {what}, and all else has its documented range"
        return RestsOn(
            of_contact, label, f"The bands rest on no measured shot of this bench: {sentence}."
        )
    fewer = [
        f"{name} on {count}"
        for name, count in (("velocity", of_gun), ("spectra", of_spectra))
        if 0 < count < most
    ]
    besides = f" ({', '.join(fewer)})" if fewer else ""
    shots = f"{most} measured shot{'s' if most > 1 else ''} of campaign {campaign}"
    return RestsOn(
        max(most, of_contact), label, f"The bands rest on {shots}{besides}; the contact is {what}."
    )


def model_in_use(session: Session | None, registry: Registry, bench_kind: str) -> Version | None:
    """Of the champions of all predictor sets for campaigns of this kind ("gun", "hammer"...), the
    one promoted last."""
    champions = [version for version in registry.versions() if version.champion_of is not None]
    for_kind = [version for version in champions if bench_kind_of(session, version) == bench_kind]
    return max(for_kind, key=lambda version: version.promoted_at, default=None)


def bench_kind_of(session: Session | None, version: Version) -> str | None:
    """The kind of campaigns that a model's predictor set is for; None where neither model nor store
    tells."""
    from ...dataset.predictors import SHIPPED

    if version.dataset.bench_kind is not None:
        return version.dataset.bench_kind
    if version.dataset.predictor_set in SHIPPED:
        return version.dataset.predictor_set  # a shipped set has the name of its kind
    kind = _definition(session, version).get("kind")
    return None if kind is None else str(kind)


def velocity_kind_of(session: Session | None, version: Version) -> str:
    """The kind of velocity that a model takes; of an older model, that of most impacts of its
    dataset.

    Where the store has the dataset no more, before contact, as a prediction's is.
    """
    from ...dataset.velocities import kind_of_snapshot

    if version.dataset.velocity_kind is not None:
        return version.dataset.velocity_kind
    row = _snapshot(session, version)
    kind = (
        None
        if session is None or row is None
        else kind_of_snapshot(session, row.content_hash, row.definition)
    )
    return kind or BEFORE_CONTACT


def training_campaigns(session: Session | None, version: Version) -> tuple[str, ...]:
    """The campaigns whose pulses a model has learned from; none where the store has the dataset no
    more."""
    return tuple(_definition(session, version).get("campaigns", ()))


def _definition(session: Session | None, version: Version) -> dict[str, Any]:
    row = _snapshot(session, version)
    return {} if row is None else row.definition


def _snapshot(session: Session | None, version: Version) -> DatasetSnapshot | None:
    if session is None:
        return None
    query = select(DatasetSnapshot).where(DatasetSnapshot.content_hash == version.dataset.hash)
    return session.scalars(query).one_or_none()
