"""The stages that a campaign's record has something to say of."""

from __future__ import annotations

import numpy as np

from .observables.base import Stage
from .observables.contact.force_histories import sites_of
from .observables.contact.registered_model import RegisteredContactStage
from .observables.contact.stage import ContactObservables
from .observables.gun.stage import GunObservables
from .observables.plate.ringdown import PlateRingdownStage
from .observables.plate.stage import PlateObservables
from .options import Options
from .record import CampaignRecord


def stages_of(
    record: CampaignRecord, options: Options
) -> tuple[tuple[Stage, ...], tuple[str, ...]]:
    """Gun, contact and plate, as far as they were measured, and a sentence for each that was not.

    Parameters:
        record: The campaign.
        options: Options of the diagnosis, of which the stages take uncertain numbers, the
            registered contact model and the mass of the plate.

    Raises:
        ValueError: Where nothing was measured, where one configuration was, and for an uncertain
            number that cannot act.
    """
    stages: list[Stage] = []
    notes: list[str] = []
    for make in (_gun, _contact, _plate):
        stage = make(record, options)
        if not isinstance(stage, str) and not np.isfinite(stage.residuals()).any():
            stage = f"{stage.name}: no run has both a measured and a simulated value"
        if isinstance(stage, str):
            notes.append(stage)
        else:
            stages.append(stage)
            notes += stage.assumptions
    names = [stage.name for stage in stages]
    for name in options.uncertain:
        owner = name.partition(".")[0]
        if names and owner not in names:
            why = next((note for note in notes if note.startswith(owner)), f"{owner}: not measured")
            raise ValueError(f"uncertain {name} cannot act on this campaign: {why}")
    if not stages:
        raise ValueError(f"campaign {record.name}: nothing to compare: {'; '.join(notes)}")
    # effects differ in how their gap changes with the configuration
    compared = np.any([np.isfinite(stage.residuals()).any(axis=1) for stage in stages], axis=0)
    settings = np.unique(record.configuration_of[compared])
    if settings.size == 1:
        label = record.configurations[int(settings[0])].label
        raise ValueError(
            f"campaign {record.name}: all {int(compared.sum())} runs that can be compared are of "
            f"one configuration ({label}); effects are told apart by how the gap changes with the "
            "settings: record at least two"
        )
    return tuple(stages), tuple(notes)


def _gun(record: CampaignRecord, options: Options) -> Stage | str:
    if record.gun is None:
        return "gun: no [bench.gun] in the campaign"
    if not any(run.velocity_m_s for run in record.runs):
        return "gun: no run has a measured velocity"
    return GunObservables(record, options.uncertain_of("gun"))


def _contact(record: CampaignRecord, options: Options) -> Stage | str:
    if not any(run.force is not None for run in record.runs):
        return "contact: no run has a force record that shows a contact"
    if not any(run.force is not None and run.velocity_m_s for run in record.runs):
        return "contact: no run with a force record has an impact velocity"
    if record.kind == "hammer" and record.hammer_mass_kg is None:
        return "contact: no [bench.hammer] mass_kg in the campaign"
    try:
        sites_of(record)
    except ValueError as error:
        return f"contact: not diagnosed: {error}"
    uncertain = options.uncertain_of("contact")
    if options.contact is not None:
        return RegisteredContactStage(
            record, options.contact, uncertain, plate_mass_kg=options.plate_mass_kg
        )
    return ContactObservables(record, uncertain)


def _plate(record: CampaignRecord, options: Options) -> Stage | str:  # noqa: ARG001 - as the others
    if not any(run.accelerations for run in record.runs):
        return "plate: no run has an acceleration record that can be used"
    if record.plate is None:
        return (
            "plate: not diagnosed, since the campaign gives neither a modal table of it nor its "
            "outline: give --modes, or --bench for a drawing"
        )
    driven = any(run.force is not None and run.accelerations for run in record.runs)
    try:
        return (PlateObservables if driven and record.plate_points_known else PlateRingdownStage)(
            record
        )
    except ValueError as error:
        return f"plate: not diagnosed: {error}"
