"""Listings: every matching row once, in order, filtered in the database."""

from __future__ import annotations

import datetime as dt

import pytest
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.configurations import configuration_id
from pyroshock.schema.impacts import Impact
from pyroshock.schema.levels import Level
from pyroshock.schema.listings import Condition, UnknownFieldError, iter_impacts, list_campaigns
from pyroshock.schema.plans import Plan, PlannedRun
from pyroshock.schema.session import Writer, open_store

TIPS = ("steel", "delrin")
RADII = (0.03, 0.045)
NOTHING = {"treatment": {}, "settings": {}}


@pytest.fixture
def filled(database_url):
    """Two campaigns of twelve impacts over four configurations."""
    with open_store(database_url, Writer("test", "0"), create=True) as store:
        _fill(store)
        yield store


def _fill(store):
    with store.writing() as session:
        plan = Plan(name="p", kind="hammer", factors="", method="lhs")
        session.add(plan)
        for name in ("a", "b"):
            campaign = Campaign(name=name, kind="hammer", date=dt.date(2026, 1, 1), fingerprint=name)
            session.add(campaign)
            session.flush()
            for i in range(12):
                tip, radius = TIPS[i % 2], RADII[i // 2 % 2]
                levels = (
                    Level("tip_material", tip, material=tip),
                    Level("tip_radius", repr(radius), radius, "m"),
                )
                key = configuration_id(session, levels)
                impact = Impact(campaign_id=campaign.id, run=i, repetition=1, configuration_id=key)
                impact.impact_velocity_m_s, impact.velocity_source = float(i), "reported"
                if name == "b":
                    planned = PlannedRun(plan=plan, run=i, position=i, configuration_id=key, status="done", **NOTHING)
                    session.add(planned)
                    session.flush()
                    impact.planned_run_id = planned.id
                session.add(impact)
        session.add(PlannedRun(plan=plan, run=99, position=99, configuration_id=key, **NOTHING))


def listed(store, *conditions, campaign=None, page=2000):
    with store.reading() as session:
        return list(iter_impacts(session, campaign, tuple(conditions), page))


def test_pages_join_without_loss_or_double(filled):
    whole = listed(filled)
    assert len(whole) == 24
    for page in (1, 5, 12, 23, 24, 25):
        assert listed(filled, page=page) == whole


def test_row_carries_campaign_factors_and_si_keys(filled):
    row = listed(filled, campaign="b")[1]
    assert row["campaign"] == "b"
    assert (row["tip_material"], row["tip_radius_m"]) == ("delrin", 0.03)
    assert (row["impact_velocity_m_s"], row["peak_force_n"], row["quality"]) == (1.0, None, "ok")


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        (Condition("tip_material", "=", "steel"), lambda r: r["tip_material"] == "steel"),
        (Condition("tip_material", "!=", "steel"), lambda r: r["tip_material"] != "steel"),
        (Condition("tip_radius_m", "=", 0.045), lambda r: r["tip_radius_m"] == 0.045),
        (Condition("tip_radius", "<", 0.04), lambda r: r["tip_radius_m"] < 0.04),
        (Condition("impact_velocity_m_s", ">=", 7.0), lambda r: r["impact_velocity_m_s"] >= 7),
        (Condition("run", "=", 3.0), lambda r: r["run"] == 3),
        (Condition("tip_material", "=", "gold"), lambda _: False),
    ],
    ids=["word", "other word", "number", "below", "column", "integer", "none"],
)
def test_condition_keeps_just_what_it_says(filled, condition, expected):
    assert listed(filled, condition) == [row for row in listed(filled) if expected(row)]


def test_conditions_narrow_together(filled):
    rows = listed(filled, Condition("tip_material", "=", "steel"), Condition("run", ">", 5.0), campaign="a")
    assert [row["run"] for row in rows] == [6, 8, 10]


def test_number_by_another_road_still_matches(filled):
    assert len(listed(filled, Condition("tip_radius_m", "=", 45 * 1e-3 * (1 + 1e-12)))) == 12


def test_unknown_field_lists_the_known(filled):
    with pytest.raises(UnknownFieldError, match=r"'colour'.*tip_material.*tip_radius"):
        listed(filled, Condition("colour", "=", "red"))


def test_unknown_campaign_lists_the_known(filled):
    with pytest.raises(LookupError, match=r"'z'.*a, b"):
        listed(filled, campaign="z")


def test_campaigns_count_impacts_and_plans(filled):
    with filled.reading() as session:
        rows = list_campaigns(session)
    assert [(r["name"], r["impacts"], r["shots"], r["planned"], r["done"]) for r in rows] == [
        ("a", 12, 0, 0, 0),
        ("b", 12, 0, 13, 12),
    ]
