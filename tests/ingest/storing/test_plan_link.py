"""Recorded runs find their planned ones, and say where they differ."""

from __future__ import annotations

import pytest
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.storing.plan_link import link_campaign
from pyroshock.schema.benches import material_names
from pyroshock.schema.campaigns import Plan, PlannedRun
from pyroshock.schema.configurations import configuration_id
from pyroshock.schema.impacts import Impact
from pyroshock.schema.known_factors import level_of
from pyroshock.schema.run_states import run_status
from sqlalchemy import select
from support.records.campaigns import gun_campaign, hammer_campaign, hammer_rows, with_cell

COLUMNS = ("tip_material", "tip_radius_mm", "hammer_speed")


def plan_of(store, rows, name="plan", kind="hammer", repetitions=2, columns=COLUMNS):
    """A plan of the runs in `rows`, which are those of a `runs.csv`."""
    with store.writing() as session:
        plan = Plan(name=name, kind=kind, factors="", method="lhs")
        session.add(plan)
        session.flush()
        names = material_names(session)
        for number, row in {row["run"]: row for row in rows}.items():
            levels = [level_of(column, str(row[column]), names) for column in columns]
            session.add(
                PlannedRun(
                    plan_id=plan.id, run=number, position=number, repetitions=repetitions,
                    treatment={}, settings={},
                    configuration_id=configuration_id(session, levels),
                )
            )  # fmt: skip


def statuses(store):
    with store.reading() as session:
        return dict(session.execute(select(PlannedRun.run, run_status())).all())


def ingested(store, folder):
    ingest_folder(store, folder, jobs=1)


def test_recorded_runs_become_done(any_store, tmp_path):
    plan_of(any_store, hammer_rows(3))
    ingested(any_store, hammer_campaign(tmp_path / "c", 2))
    links = link_campaign(any_store, "hammer", "plan")
    assert (links.linked, links.done, links.mismatches) == (4, 2, ())
    assert statuses(any_store) == {1: "done", 2: "done", 3: "planned"}
    again = link_campaign(any_store, "hammer", "plan")
    assert (again.linked, again.done, again.mismatches) == (0, 0, ())
    plan_of(any_store, hammer_rows(1), name="short")
    (mismatch,) = link_campaign(any_store, "hammer", "short").mismatches
    assert mismatch == {"run": 2, "reason": "the plan has no run of this number"}


def test_run_with_too_few_repetitions_stays_to_do(any_store, tmp_path):
    plan_of(any_store, hammer_rows(2), repetitions=3)
    ingested(any_store, hammer_campaign(tmp_path / "c", 2))
    assert link_campaign(any_store, "hammer", "plan").linked == 4
    assert set(statuses(any_store).values()) == {"planned"}


def test_other_setting_is_told_and_not_linked(any_store, tmp_path):
    plan_of(any_store, with_cell(hammer_rows(2, 1), "tip_material", "delrin"))
    ingested(any_store, hammer_campaign(tmp_path / "c", 2, 1))
    links = link_campaign(any_store, "hammer", "plan")
    assert links.mismatches == ({"run": 1, "reason": "tip_material is aluminum, planned delrin"},)
    with any_store.reading() as session:
        assert session.scalars(select(Impact.planned_run_id).where(Impact.run == 1)).all() == [None]


@pytest.mark.parametrize(("pressure", "matches"), [("0.257", True), ("0.3", False)])
def test_measured_pressure_is_near_the_planned_one(any_store, tmp_path, pressure, matches):
    rows = [
        {"run": 1, "bullet_mass_kg": 0.1428, "tank_pressure_bar": pressure, "velocity_level": "low"}
    ]
    columns = ("bullet_mass_kg", "tank_pressure_bar", "velocity_level")
    plan_of(any_store, rows, kind="gun", repetitions=1, columns=columns)
    ingested(any_store, gun_campaign(tmp_path / "g", 1))
    links = link_campaign(any_store, "gun", "plan")
    assert (links.linked == 1, not links.mismatches) == (matches, matches)


def test_setting_that_was_not_recorded_is_told(any_store, tmp_path):
    plan_of(
        any_store,
        with_cell(hammer_rows(1, 1), "boundary_conditions", "free"),
        columns=(*COLUMNS, "boundary_conditions"),
    )
    ingested(any_store, hammer_campaign(tmp_path / "c", 1, 1))
    (mismatch,) = link_campaign(any_store, "hammer", "plan").mismatches
    assert mismatch["reason"] == "boundary_conditions is not recorded, planned free"


@pytest.mark.parametrize(
    ("campaign", "plan", "said"),
    [
        ("none", "plan", "no campaign 'none'"),
        ("hammer", "none", r"no plan 'none'.*plan"),
        ("gun", "plan", "of a gun"),
    ],
)
def test_what_does_not_go_together_is_refused(any_store, tmp_path, campaign, plan, said):
    plan_of(any_store, hammer_rows(1, 1))
    ingested(any_store, hammer_campaign(tmp_path / "c", 1, 1))
    ingested(any_store, gun_campaign(tmp_path / "g", 1))
    with pytest.raises(IngestError, match=said):
        link_campaign(any_store, campaign, plan)
