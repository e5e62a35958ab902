"""Facts of a campaign as they were when a dataset was frozen, kept with it when facts are added
later.

A dataset's pulses are rows of the store, and what they were made with is read from their
configuration and their bench. Before either is changed, `freeze_facts` writes the old ones into the
definition of each dataset that has such pulses:

"facts": {CAMPAIGN: {"bench": {...}, "configurations": {"RUN/REPETITION": FINGERPRINT}}}
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from .benches import Hammer, Material, Plate
from .campaigns import Campaign, Configuration
from .impacts import DatasetSnapshot, Impact, Pulse, SnapshotPulse

FACTS = "facts"


def freeze_facts(
    session: Session, campaign: Campaign, hits: Collection[tuple[int, int]], *, bench: bool
) -> None:
    """Keep what the datasets with pulses of `campaign` know of it: the configurations of `hits`
    (run, repetition), and with `bench` the bench. What a dataset has kept already is older, and
    stays."""
    query = (
        select(SnapshotPulse.snapshot_id, Impact.run, Impact.repetition, Configuration.fingerprint)
        .join(Pulse, SnapshotPulse.pulse_id == Pulse.id)
        .join(Impact, Pulse.impact_id == Impact.id)
        .join(Configuration, Impact.configuration_id == Configuration.id)
        .where(Impact.campaign_id == campaign.id)
    )
    configurations: dict[int, dict[str, str]] = {}
    for snapshot, run, repetition, fingerprint in session.execute(query):
        of_snapshot = configurations.setdefault(snapshot, {})
        if (run, repetition) in hits:
            of_snapshot[hit_key(run, repetition)] = fingerprint
    for snapshot, of_snapshot in configurations.items():
        definition = session.scalars(
            select(DatasetSnapshot.definition).where(DatasetSnapshot.id == snapshot)
        ).one()
        facts = dict(definition.get(FACTS, {}))
        own = {"bench": _bench(session, campaign)} if bench else {}
        kept = facts.get(campaign.name, {})
        facts[campaign.name] = {
            **own,
            **kept,
            "configurations": {**of_snapshot, **kept.get("configurations", {})},
        }
        values = {"definition": {**definition, FACTS: facts}}
        session.execute(
            update(DatasetSnapshot).where(DatasetSnapshot.id == snapshot).values(**values)
        )


def read_frozen_facts(
    definition: Mapping[str, Any], campaign: str
) -> tuple[Mapping[str, Any], Mapping[str, str]]:
    """What a dataset has kept of a campaign: values of its bench by name, and fingerprints by
    `hit_key`."""
    facts = definition.get(FACTS, {}).get(campaign, {})
    return facts.get("bench", {}), facts.get("configurations", {})


def hit_key(run: int, repetition: int) -> str:
    return f"{run}/{repetition}"


def _bench(session: Session, campaign: Campaign) -> dict[str, Any]:
    """By the names that a dataset's rows have for them (`dataset.rows`)."""
    query = (
        select(
            Hammer.mass_kg.label("hammer_mass_kg"),
            Plate.thickness_m.label("plate_thickness_m"),
            Plate.outline_m.label("plate_outline_m"),
            Material.name.label("bench_plate_material"),
        )
        .select_from(Campaign)
        .outerjoin(Hammer, Campaign.hammer_id == Hammer.id)
        .outerjoin(Plate, Campaign.plate_id == Plate.id)
        .outerjoin(Material, Plate.material_id == Material.id)
        .where(Campaign.id == campaign.id)
    )
    return dict(session.execute(query).mappings().one())
