"""An ingested campaign as a record: configurations, runs in their order, bench, and what was taken for granted.

A campaign folder as a record, by an ingest into a store that is gone afterwards.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ...dataset.rows import gun_bench, modal_plate, stored_materials
from ...schema.benches import Material as StoredMaterial
from ...schema.benches import ModalTable
from ...schema.campaigns import Campaign
from ...schema.listings import get_campaign_id
from ...schema.recordings import SET_ASIDE, Recording
from ...schema.session import Writer, open_store
from ..record import CampaignRecord, Run
from .impacts import StoredImpact, read_hits
from .series import read_exclusions, read_series
from .settings import assumptions, read_settings, travel_m

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
    configurations, rows, notes = read_settings(session, [hit.configuration_id for hit in hits])
    travels = [travel_m(configuration) for configuration in configurations]
    with_series = _hits_with_series(hits, rows, most_runs_per_configuration)
    series = read_series(session, hits, with_series, exclusions)
    materials, bench = stored_materials(session), campaign.plate
    modes = session.get_one(ModalTable, bench.modal_table_id) if bench and bench.modal_table_id is not None else None
    material = session.get_one(StoredMaterial, bench.material_id) if bench and bench.material_id is not None else None
    record = CampaignRecord(
        name=campaign.name,
        kind=campaign.kind,
        configurations=configurations,
        runs=tuple(
            Run(
                configuration=row,
                run=hit.run,
                repetition=hit.repetition,
                order=order,
                tank_pressure_pa=hit.set_pressure_pa if hit.recorded_pressure_pa is None else hit.recorded_pressure_pa,
                bullet_mass_kg=hit.bullet_mass_kg,
                velocity_m_s=hit.velocity_m_s,
                velocity_u_m_s=hit.velocity_u_m_s,
                travel_m=travels[row],
                force=series.force.get(order),
                accelerations=series.accelerations.get(order, {}),
            )
            for order, (hit, row) in enumerate(zip(hits, rows, strict=True))
        ),
        gun=gun_bench(campaign.gun) if campaign.gun else None,
        hammer_mass_kg=campaign.hammer.mass_kg if campaign.hammer else None,
        plate=modal_plate(modes) if modes else None,
        plate_thickness_m=(bench.thickness_m if bench else None) or _THICKNESS_M,
        plate_material=material.name if material else None,
        plate_outline_m=tuple((float(x), float(y)) for x, y in (bench.outline_m if bench else None) or ()),
        # By the store's names, as factors have them, and by every spelling in lower case.
        materials={**materials, **{item.name: item for item in materials.values()}},
    )
    set_aside = (Recording.campaign_id == campaign.id, Recording.status == SET_ASIDE)
    if unread := session.scalar(select(func.count()).select_from(Recording).where(*set_aside)):
        notes = (*notes, f"recordings that could not be read and are left out: {unread}")
    return replace(record, assumptions=(*notes, *assumptions(campaign, record, hits, series)))


def _hits_with_series(hits: Sequence[StoredImpact], rows: Sequence[int], most: int) -> list[int]:
    """Places of some hits with a pulse of each configuration, then of some first hits of recordings without any."""
    with_pulse = [row if hit.has_pulse else None for hit, row in zip(hits, rows, strict=True)]
    recordings = {None, *(hit.recording_id for hit in hits if hit.has_pulse)}
    silent: list[int | None] = []
    for hit, row in zip(hits, rows, strict=True):
        silent.append(None if hit.recording_id in recordings else row)
        recordings.add(hit.recording_id)
    return [*evenly_chosen(with_pulse, most), *evenly_chosen(silent, most)]


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


#: Folders above this are ingested into a file of a temporary folder, not into memory.
IN_MEMORY_BYTES = 256 * 2**20


def read_folder(path: Path) -> CampaignRecord:
    """The campaign in the folder `path`, as `read_campaign` gives it. Leaves nothing behind.

    Raises `IngestError` for a folder that the ingest refuses.
    """
    from ...ingest.load import ingest_folder

    path = Path(path)
    large = sum(file.stat().st_size for file in path.rglob("*") if file.is_file()) > IN_MEMORY_BYTES
    with tempfile.TemporaryDirectory(prefix="pyroshock-") as scratch:
        url = f"sqlite:///{scratch}/campaign.db" if large else "sqlite:///:memory:"
        with open_store(url, Writer("diagnose", "temporary"), create=True) as store:
            report = ingest_folder(store, path, jobs=None if large else 1)
            with store.reading() as session:
                return read_campaign(session, report.campaign)
