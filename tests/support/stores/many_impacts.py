"""A store of a hundred thousand impacts with all that pages read of them: curves, shots, plans,
diagnoses, a record."""

from __future__ import annotations

import datetime as dt
from pathlib import Path
from typing import Any

import numpy as np
from pyroshock.app.operations.diagnose.stored import verdict_to_json
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.benches import Gun
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.impacts import Pulse, Shot
from pyroshock.schema.series import encode
from pyroshock.schema.session import Store
from sqlalchemy import insert, select, update

from support.records import verdicts
from support.records.campaigns import hammer_campaign
from support.stores.large_store import campaign_name, fill
from support.stores.stores import opened
from support.stores.web_stores import FACTORS

IMPACTS, SHOTS, DIAGNOSES, PLANS = 100_000, 20_000, 300, 30
_WHEN = dt.datetime(2026, 11, 1, tzinfo=dt.UTC)


def fill_many(folder: Path, impacts: int = IMPACTS) -> str:
    """A store in `folder`; its address. The last impact has a record."""
    url = f"sqlite:///{folder}/lab.db"
    fill(url, impacts)
    with opened(url) as store:
        with store.writing() as session:
            signed = store.written_by(session)
            force = (
                1500.0 * np.sin(np.pi * np.linspace(0, 1, 250)) ** 1.5
            )  # as long as a pulse of half a millisecond
            force += np.random.default_rng(1).normal(0, 1, 250)  # and as badly packed
            points = np.interp(np.linspace(0, 1, 20), np.linspace(0, 1, 250), force).tolist()
            session.execute(update(Pulse).values(fine_force_n=encode(force), force_points_n=points))
            session.execute(insert(Campaign), [_gun_campaign(session, signed)])
        _shots_and_diagnoses(store, signed)
        for number in range(PLANS):
            make_plan(
                store,
                "factorial",
                f"plan {number:02d}",
                kind="hammer",
                factors=FACTORS,
                seed=number,
            )
        make_plan(store, "lhs", "a hundred runs", runs=105, seed=1)
        ingest_folder(store, hammer_campaign(folder / "recorded", 1, 2, "recorded"), jobs=1)
    return url


def _gun_campaign(session: Any, signed: int) -> dict[str, Any]:
    gun = Gun(
        fingerprint="gun", tank_volume_m3=0.0095, bore_diameter_m=0.049,
        projectile_diameter_m=0.048, travel_m=0.9,
        friction_coefficient=1.464, heat_capacity_ratio=1.4, efficiency=0.5,
    )  # fmt: skip
    session.add(gun)
    session.flush()
    day = _WHEN.date()
    return {
        "name": "shots",
        "kind": "gun",
        "date": day,
        "gun_id": gun.id,
        "fingerprint": "s",
        "written_by_id": signed,
    }


def _shots_and_diagnoses(store: Store, signed: int) -> None:
    made = verdicts.verdict(campaign="shots")
    report, details = verdict_to_json(made)
    with store.writing() as session:
        gun = session.scalars(select(Campaign.id).where(Campaign.name == "shots")).one()
        common = {"campaign_id": gun, "written_by_id": signed}
        session.execute(
            insert(Shot),
            [
                {
                    **common, "run": key // 10 + 1, "repetition": key % 10 + 1,
                    "configuration_id": key % 180 + 1,
                    "tank_pressure_pa": 1e5 + key, "bullet_mass_kg": 0.2,
                    "measured_velocity_m_s": 12.0,
                    "velocity_source": "reported",
                }
                for key in range(SHOTS)
            ],
        )  # fmt: skip
        kept = {
            **common,
            "simulator": made.simulator,
            "diagnosed_at": _WHEN,
            "report": report,
            "details": details,
        }
        session.execute(insert(Diagnosis), [kept] * DIAGNOSES)


__all__ = ["DIAGNOSES", "IMPACTS", "PLANS", "SHOTS", "campaign_name", "fill_many"]
