"""A campaign's page: what was planned, what became of it, what was found about it."""

from __future__ import annotations

import pytest
from pyroshock.app.operations.ingest.campaign_overview import campaign_overview, count_findings
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.storing.plan_link import link_campaign
from pyroshock.schema.benches import material_names
from pyroshock.schema.campaigns import Plan, PlannedRun
from pyroshock.schema.configurations import configuration_id
from pyroshock.schema.known_factors import level_of
from pyroshock.schema.listings import iter_impacts
from pyroshock.schema.recordings import QualityFinding, Recording
from pyroshock.schema.session import Writer, open_store
from sqlalchemy import select
from support.records.campaigns import gun_campaign, hammer_campaign, write_runs

FACTORS = (
    'name = "gun"\nkind = "gun"\n'
    '[[factors]]\nname = "bullet_mass"\ncolumn = "bullet_mass_kg"\nkind = "numeric"\nunit = "kg"\n'
    "levels = [0.1428, 0.2]\n"
    '[[factors]]\nname = "velocity_level"\nkind = "ordered"\nlevels = ["low", "high"]\nunit = '
    '"m/s"\n'
    "values = [10, 20]\n"
)
#: run -> tank pressure (bar), mass, velocity level, state
PLANNED = {
    1: ("0.25", "0.1428", "low", None),
    2: ("0.31", "0.1428", "low", None),
    3: ("0.35", "0.1428", "high", "discarded"),
    4: ("0.5", "0.2", "high", None),
}


@pytest.fixture
def store(tables_url):
    with open_store(tables_url, Writer("test", "0"), create=True) as store:
        yield store


#: run, repetition, pressure (bar), velocity (m/s)
SHOTS = ((1, 1, 0.25, 11.0), (1, 2, 0.25, 12.0), (2, 1, 0.3, 12.0), (3, 1, 0.35, 13.0))


def add_plan(store, name="plan", factors=FACTORS, kind="gun", rows=PLANNED):
    with store.writing() as session:
        plan = Plan(name=name, kind=kind, factors=factors, method="lhs")
        session.add(plan)
        session.flush()
        names = material_names(session)
        for run, (pressure, mass, velocity, state) in rows.items():
            cells = {"bullet_mass_kg": mass, "velocity_level": velocity}
            levels = [
                level_of(c, t, names) for c, t in {**cells, "tank_pressure_bar": pressure}.items()
            ]
            session.add(
                PlannedRun(
                    plan_id=plan.id, run=run, position=run, repetitions=2, treatment=cells,
                    settings={"tank_pressure_bar": float(pressure)},
                    configuration_id=configuration_id(session, levels),
                    status=state or "planned", reason="broken tip" if state else None,
                )
            )  # fmt: skip


@pytest.fixture
def gun(store, tmp_path):
    """Three shots (0.25, 0.3, 0.35 bar, 11 to 13 m/s) and a second one of run 1 at 0.25 bar, 12
    m/s."""
    add_plan(store)
    folder = gun_campaign(tmp_path / "g")
    rows = [
        {"run": run, "repetition": repetition, "bullet_mass_kg": 0.1428, "tank_pressure_bar": bar,
         "measured_velocity_m_s": velocity}
        for run, repetition, bar, velocity in SHOTS
    ]  # fmt: skip
    write_runs(folder, rows)
    ingest_folder(store, folder, jobs=1)
    link_campaign(store, "gun", "plan")
    return store


def overview(store, name):
    with store.reading() as session:
        return campaign_overview(session, name)


def test_page_has_bench_shots_and_runs_and_levels_by_state(gun):
    (plan,) = overview(gun, "gun")["plans"]
    assert plan == {
        "plan": "plan", "method": "lhs", "runs": 4, "planned": 2, "done": 1, "discarded": 1,
        "repetitions": 6,
        "recorded": 3,
    }  # fmt: skip
    rows = {(row["factor"], row["level"]): row for row in overview(gun, "gun")["levels"]}
    states = ("planned", "done", "discarded", "shots")
    told = {
        level: tuple(rows["velocity_level", level][state] for state in states)
        for level in ("low", "high")
    }
    assert told == {"low": (1, 1, 0, 0), "high": (1, 0, 1, 0)}
    masses = {
        level: tuple(row[s] for s in states)
        for (f, level), row in rows.items()
        if f == "bullet_mass_kg"
    }
    assert masses == {0.1428: (1, 1, 1, 4), 0.2: (1, 0, 0, 0)}
    assert [row["level"] for row in rows.values() if row["factor"] == "tank_pressure_pa"] == [
        pytest.approx(p) for p in (25e3, 30e3, 31e3, 35e3, 50e3)
    ]
    page = overview(gun, "gun")
    assert page["campaign"]["bench"]["gun"]["tank_volume_m3"] == 0.0095
    assert (page["campaign"]["kind"], page["campaign"]["date"]) == ("gun", "2026-03-03")
    assert [row["measured_velocity_m_s"] for row in page["first_shots"]] == [11, 12, 12, 13]
    assert all(row["predicted_velocity_m_s"] > 0 for row in page["first_shots"])


def test_achieved_settings_stand_beside_the_planned_ones(gun, tmp_path):
    page = overview(gun, "gun")
    rows = {(row["run"], row["quantity"]): row for row in page["achieved"]}
    assert set(rows) == {
        (run, q) for run in (1, 2) for q in ("tank_pressure_pa", "bullet_mass_kg", "velocity_m_s")
    }
    first = rows[1, "velocity_m_s"]
    assert (first["planned"], first["mean"], first["least"], first["largest"],
    first["recorded"]) == (
        10.0, 11.5, 11.0, 12.0, 2,
    )  # fmt: skip
    assert first["deviation"] == pytest.approx(0.15)
    assert rows[2, "tank_pressure_pa"]["deviation"] == pytest.approx(-1 / 31)
    worst = {row["quantity"]: row for row in page["achieved_summary"]}
    assert worst["tank_pressure_pa"]["worst_run"] == 2
    assert worst["velocity_m_s"]["mean_deviation"] == pytest.approx((0.15 + 0.2) / 2)
    assert (worst["velocity_m_s"]["runs"], worst["bullet_mass_kg"]["mean_magnitude"]) == (
        2,
        pytest.approx(0.0),
    )
    ingest_folder(gun, gun_campaign(tmp_path / "other", 1, "other"), jobs=1)
    page = overview(gun, "other")
    assert (page["counts"]["shots"], page["plans"], page["achieved"], page["achieved_summary"]) == (
        1,
        [],
        [],
        [],
    )
    assert overview(gun, "gun")["counts"]["shots"] == 4
    from pyroshock.schema.impacts import Shot

    with gun.writing() as session:
        for shot in session.scalars(select(Shot).where(Shot.run == 1)):
            shot.recorded_pressure_pa = 24e3 + 1e3 * shot.repetition
    (row,) = [
        row for row in overview(gun, "gun")["achieved"] if row["quantity"] == "recorded_pressure_pa"
    ]
    assert (row["run"], row["planned"], row["mean"], row["recorded"]) == (
        1,
        pytest.approx(25e3),
        25.5e3,
        2,
    )


def test_plan_without_its_factors_has_no_planned_velocity(store, tmp_path):
    add_plan(store, factors="")
    ingest_folder(store, gun_campaign(tmp_path / "g"), jobs=1)
    link_campaign(store, "gun", "plan")
    quantities = {row["quantity"] for row in overview(store, "gun")["achieved"]}
    assert quantities == {"tank_pressure_pa", "bullet_mass_kg"}


def test_hammer_s_page_has_its_impacts_and_what_was_set_aside(store, tmp_path):
    ingest_folder(store, hammer_campaign(tmp_path / "h", 2, 2), jobs=1)
    with store.writing() as session:
        session.add(
            Recording(campaign_id=1, path="bad.mat", sha256="0" * 64, size_bytes=1, format="mat",
                      status="set aside", reason="truncated")
        )  # fmt: skip
    page = overview(store, "hammer")
    assert page["counts"] == {"impacts": 4, "shots": 0, "recordings": 2, "recordings_set_aside": 1}
    assert page["set_aside"] == [{"recording": "bad.mat", "reason": "truncated"}]
    assert page["campaign"]["bench"] == {"hammer": {"mass_kg": 0.32}}
    with store.reading() as session:
        assert page["first_impacts"] == list(iter_impacts(session, "hammer"))
    tips = {
        row["level"]: row["impacts"] for row in page["levels"] if row["factor"] == "tip_material"
    }
    assert tips == {"aluminum": 2, "PLA": 2}


def test_findings_are_counted_by_check_the_worst_first(store, tmp_path):
    ingest_folder(store, hammer_campaign(tmp_path / "h", 2, 2), jobs=1)
    ingest_folder(store, hammer_campaign(tmp_path / "o", 1, 1, "other"), jobs=1)
    said = [
        (1, 1, "clipping", "reject"), (1, 1, "clipping", "reject"), (2, 3, "clipping", "reject"),
        (1, None, "clipping", "note"), (1, None, "drift", "warning"), (2, None, "drift", "warning"),
        (3, 5, "clipping", "reject"),
    ]  # fmt: skip
    with store.writing() as session:
        session.query(QualityFinding).delete()
        session.add_all(
            QualityFinding(
                recording_id=r,
                channel_id=r,
                impact_id=i,
                check=check,
                severity=severity,
                message="",
                evidence={},
            )
            for r, i, check, severity in said
        )
    with store.reading() as session:
        found = count_findings(session, 1)
    assert found == [
        {
            "check": "clipping",
            "severity": "reject",
            "findings": 3,
            "recordings": 2,
            "impacts": 2,
            "channels": "force",
        },
        {
            "check": "drift",
            "severity": "warning",
            "findings": 2,
            "recordings": 2,
            "impacts": 0,
            "channels": "force",
        },
        {
            "check": "clipping",
            "severity": "note",
            "findings": 1,
            "recordings": 1,
            "impacts": 0,
            "channels": "force",
        },
    ]


def test_plan_of_the_campaign_s_own_name_is_shown_before_the_first_shot(store, tmp_path):
    add_plan(store, name="gun")
    ingest_folder(store, gun_campaign(tmp_path / "g"), jobs=1)
    (plan,) = overview(store, "gun")["plans"]
    assert (plan["plan"], plan["planned"], plan["recorded"]) == ("gun", 3, 0)
    with pytest.raises(LookupError, match=r"no campaign 'z'.*gun"):
        overview(store, "z")
