"""An ingested campaign as a record: configurations, runs in their order, bench, and what was taken for granted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from sqlalchemy.orm import Session

from ...dataset.stored_bench import gun_bench, modal_plate, stored_materials
from ...schema.benches import ModalTable
from ...schema.campaigns import Campaign
from ...schema.listings import get_campaign_id
from ...schema.materials import Material as StoredMaterial
from ..record import CampaignRecord, Run
from .assumptions import assumptions
from .impacts import Hit, read_hits
from .quality_exclusions import count_set_aside, read_exclusions
from .series import HitSeries, read_series
from .settings import read_settings, travel_m

#: Where neither the campaign nor its caller says how thick the plate is: the thesis's.
_THICKNESS_M = 0.010


def read_campaign(session: Session, name: str, *, most_runs_per_configuration: int = 10) -> CampaignRecord:
    """The campaign `name` of the store.

    Velocities are of all runs; series of at most `most_runs_per_configuration` of each configuration, evenly chosen.
    Raises `LookupError` for an unknown campaign, `ValueError` for one without any run, for a channel
    that holds no number, and for a projectile's travel that is no length.
    """
    campaign = session.get_one(Campaign, get_campaign_id(session, name))
    hits = read_hits(session, campaign)
    if not hits:
        raise ValueError(f"campaign {name!r} holds no run; ingest its folder first: pyroshock ingest FOLDER")
    exclusions = read_exclusions(session, campaign.id)
    settings = read_settings(session, [hit.configuration_id for hit in hits])
    materials, bench = stored_materials(session), campaign.plate
    travels = [travel_m(configuration) for configuration in settings.configurations]
    chosen, ringing = _chosen(hits, settings.rows, most_runs_per_configuration)
    series = read_series(session, hits, chosen, ringing, exclusions)
    modes = session.get_one(ModalTable, bench.modal_table_id) if bench and bench.modal_table_id is not None else None
    material = session.get_one(StoredMaterial, bench.material_id) if bench and bench.material_id is not None else None
    record = CampaignRecord(
        name=campaign.name,
        kind=campaign.kind,
        configurations=settings.configurations,
        runs=tuple(_run(hit, settings.rows[i], i, series, travels[settings.rows[i]]) for i, hit in enumerate(hits)),
        gun=gun_bench(campaign.gun) if campaign.gun else None,
        hammer_mass_kg=campaign.hammer.mass_kg if campaign.hammer else None,
        plate=modal_plate(modes) if modes else None,
        plate_thickness_m=(bench.thickness_m if bench else None) or _THICKNESS_M,
        plate_material=material.name if material else None,
        plate_outline_m=tuple((float(x), float(y)) for x, y in (bench.outline_m if bench else None) or ()),
        # By the store's names, as factors have them, and by every spelling in lower case.
        materials={**materials, **{item.name: item for item in materials.values()}},
    )
    unread = count_set_aside(session, campaign.id)
    notes = [f"recordings that could not be read and are left out: {unread}"] if unread else []
    return replace(record, assumptions=(*settings.notes, *notes, *assumptions(campaign, record, hits, series)))


def _chosen(hits: Sequence[Hit], rows: Sequence[int], most: int) -> tuple[list[int], list[int]]:
    """Places of some hits with a pulse of each configuration, and of some first hits of recordings without any."""
    used = {None, *(hit.recording_id for hit in hits if hit.has_pulse)}
    first = {hit.recording_id: i for i, hit in reversed([*enumerate(hits)]) if hit.recording_id not in used}
    alone = set(first.values())
    chosen = evenly_chosen([row if hit.has_pulse else None for hit, row in zip(hits, rows, strict=True)], most)
    return chosen, evenly_chosen([row if i in alone else None for i, row in enumerate(rows)], most)


def evenly_chosen(groups: Sequence[int | None], most: int) -> list[int]:
    """Places of at most `most` members of each group, evenly over its order; None is of no group."""
    members_of: dict[int, list[int]] = {}
    for i, group in enumerate(groups):
        if group is not None:
            members_of.setdefault(group, []).append(i)
    chosen: list[int] = []
    for members in members_of.values():
        places = np.unique(np.linspace(0, len(members) - 1, min(most, len(members))).round().astype(int))
        chosen += [members[place] for place in places]
    return sorted(chosen)


def _run(hit: Hit, configuration: int, order: int, series: HitSeries, travel: float | None) -> Run:
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
