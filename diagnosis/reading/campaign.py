"""An ingested campaign as a record: configurations, runs in their order, bench, and what was taken for granted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from sqlalchemy.orm import Session

from ...dataset.stored_bench import gun_bench, modal_plate, stored_materials
from ...schema.benches import ModalTable
from ...schema.campaigns import Campaign
from ...schema.listings import get_campaign_id
from ...schema.materials import Material as StoredMaterial
from ...twin.gun.bench import GunBench
from ...twin.materials import Material
from ...twin.plate.modal import ModalPlate
from ..record import CampaignRecord, Run
from .assumptions import assumptions
from .impacts import Hit, read_hits
from .quality_exclusions import count_set_aside, read_doubts, refuse_no_number
from .records import Records, read_records
from .settings import grouped_by_setting, travel_m

#: Where neither the campaign nor its caller says how thick the plate is: the thesis's.
THICKNESS_M = 0.010


def read_campaign(
    session: Session,
    name: str,
    *,
    plate: ModalPlate | None = None,
    gun: GunBench | None = None,
    hammer_mass_kg: float | None = None,
    most_runs_per_configuration: int = 10,
) -> CampaignRecord:
    """The campaign `name` of the store. `plate`, `gun` and `hammer_mass_kg` stand in for what it does not tell.

    Velocities are of all runs; series of at most `most_runs_per_configuration` of each configuration, evenly chosen.
    Raises `LookupError` for an unknown campaign, `ValueError` for one without any run, for a channel
    that holds no number, and for a projectile's travel that is no length.
    """
    campaign = session.get_one(Campaign, get_campaign_id(session, name))
    hits = read_hits(session, campaign)
    if not hits:
        raise ValueError(f"campaign {name!r} holds no run; ingest its folder first: pyroshock ingest FOLDER")
    refuse_no_number(session, campaign.id)
    grouped = grouped_by_setting(session, [hit.configuration_id for hit in hits])
    with_pulse = [row if hit.has_pulse else None for hit, row in zip(hits, grouped.rows, strict=True)]
    chosen = evenly_chosen(with_pulse, most_runs_per_configuration)
    alone = _first_without_pulse(hits)
    without = [row if i in alone else None for i, row in enumerate(grouped.rows)]
    ringing = evenly_chosen(without, most_runs_per_configuration)
    series = read_records(session, hits, chosen, ringing, read_doubts(session, campaign.id))
    record = CampaignRecord(
        name=campaign.name,
        kind=campaign.kind,
        configurations=grouped.configurations,
        runs=tuple(
            _run(hit, row, i, series, travel_m(grouped.configurations[row]))
            for i, (hit, row) in enumerate(zip(hits, grouped.rows, strict=True))
        ),
        gun=gun_bench(campaign.gun) if campaign.gun else gun,
        hammer_mass_kg=campaign.hammer.mass_kg if campaign.hammer else hammer_mass_kg,
        plate=_plate(session, campaign) or plate,
        plate_thickness_m=(campaign.plate.thickness_m if campaign.plate else None) or THICKNESS_M,
        plate_material=_plate_material(session, campaign),
        plate_outline_m=_outline(campaign),
        materials=_materials(session),
    )
    lost = count_set_aside(session, campaign.id)
    notes = (*grouped.notes, f"recordings that could not be read and are left out: {lost}") if lost else grouped.notes
    return replace(record, assumptions=(*notes, *assumptions(campaign, record, hits, series)))


def _first_without_pulse(hits: Sequence[Hit]) -> frozenset[int]:
    """Places of the first hits of recordings in which no pulse was found."""
    with_pulse = {hit.recording_id for hit in hits if hit.has_pulse}
    first: dict[int, int] = {}
    for place, hit in enumerate(hits):
        if hit.recording_id is not None and hit.recording_id not in with_pulse:
            first.setdefault(hit.recording_id, place)
    return frozenset(first.values())


def evenly_chosen(groups: Sequence[int | None], most: int) -> list[int]:
    """Places of at most `most` members of each group, evenly over its order; None is of no group."""
    members: dict[int, list[int]] = {}
    for i, group in enumerate(groups):
        if group is not None:
            members.setdefault(group, []).append(i)
    chosen: list[int] = []
    for mine in members.values():
        places = np.unique(np.linspace(0, len(mine) - 1, min(most, len(mine))).round().astype(int))
        chosen += [mine[place] for place in places]
    return sorted(chosen)


def _run(hit: Hit, configuration: int, order: int, series: Records, travel: float | None) -> Run:
    pressure = hit.recorded_pressure_pa
    return Run(
        configuration=configuration,
        run=hit.run,
        repetition=hit.repetition,
        order=order,
        tank_pressure_pa=hit.set_pressure_pa if pressure is None else pressure,
        bullet_mass_kg=hit.bullet_mass_kg,
        velocity_m_s=hit.velocity_m_s,
        velocity_u_m_s=hit.velocity_u_m_s,
        travel_m=travel,
        force=series.force.get(order),
        accelerations=series.accelerations.get(order, {}),
    )


def _plate(session: Session, campaign: Campaign) -> ModalPlate | None:
    if campaign.plate is None or campaign.plate.modal_table_id is None:
        return None
    return modal_plate(session.get_one(ModalTable, campaign.plate.modal_table_id))


def _plate_material(session: Session, campaign: Campaign) -> str | None:
    """Of `[bench.plate]`, by the store's name."""
    if campaign.plate is None or campaign.plate.material_id is None:
        return None
    return session.get_one(StoredMaterial, campaign.plate.material_id).name


def _outline(campaign: Campaign) -> tuple[tuple[float, float], ...]:
    corners = campaign.plate.outline_m if campaign.plate is not None else None
    return tuple((float(x), float(y)) for x, y in corners or ())


def _materials(session: Session) -> Mapping[str, Material]:
    """By the store's names, as factors have them, and by every spelling in lower case."""
    stored = stored_materials(session)
    return {**stored, **{material.name: material for material in stored.values()}}
