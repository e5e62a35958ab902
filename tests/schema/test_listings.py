"""Listings: every matching row once, in order, filtered in the database."""

from __future__ import annotations

import datetime as dt
from contextlib import contextmanager

import pytest
from pyroshock.schema import conditions
from pyroshock.schema.campaigns import Campaign, Plan, PlannedRun
from pyroshock.schema.conditions import span_of
from pyroshock.schema.configurations import configuration_id
from pyroshock.schema.impacts import Impact, Shot
from pyroshock.schema.known_factors import RunLevel
from pyroshock.schema.listings import (
    OPERATORS,
    Condition,
    UnknownFieldError,
    iter_impacts,
    iter_shots,
    list_campaigns,
    list_impacts_page,
    list_shots_page,
)
from pyroshock.schema.recordings import QualityFinding, Recording
from pyroshock.schema.session import Writer, open_store
from sqlalchemy import event

TIPS = ("steel", "delrin")
RADII = (0.03, 0.045)
NOTHING: dict[str, dict[str, object]] = {"treatment": {}, "settings": {}}


@pytest.fixture(scope="module")
def filled(new_database):
    """Two campaigns of twelve impacts over four configurations, which tests only read."""
    with _filled(new_database()) as store:
        yield store


@contextmanager
def _filled(url):
    with open_store(url, Writer("test", "0"), create=True) as store:
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
                    RunLevel("tip_material", tip, material=tip),
                    RunLevel("tip_radius", repr(radius), radius, "m"),
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
    assert (row["impact_velocity_m_s"], row["peak_force_n"], row["quality"]) == (1.0, None, "not judged")


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


@pytest.fixture(scope="module")
def doubted(new_database):
    """Impact 1 is warned of, 2 warned of and rejected, 3 shares a recording that is warned of with 4, whose own finding
    is a note; 5 has one of a note alone. The others have no recording.
    """
    warnings = [(1, 1, "warning"), (2, 2, "warning"), (3, None, "warning")]
    said = [*warnings, (2, 2, "reject"), (3, 4, "note"), (5, 5, "note")]
    with _filled(new_database()) as store:
        with store.writing() as session:
            for key, impacts in ((1, (1,)), (2, (2,)), (3, (3, 4)), (5, (5,))):
                session.add(Recording(id=key, campaign_id=1, path=str(key), sha256="0" * 64, size_bytes=1, format="csv",
                                      status="stored"))  # fmt: skip
                session.flush()
                for impact in impacts:
                    session.get_one(Impact, impact).recording_id = key
            for recording, impact, severity in said:
                session.add(QualityFinding(recording_id=recording, impact_id=impact, check="rest", severity=severity,
                                           message="m", evidence={}))  # fmt: skip
        yield store


@pytest.mark.parametrize(
    ("operator", "value", "expected"),
    [
        ("=", "ok", [5]),
        ("!=", "ok", [1, 2, 3, 4, 6]),
        ("=", "warning", [1, 3, 4]),
        ("=", "reject", [2]),
        ("!=", "reject", [1, 3, 4, 5, 6]),
        ("=", "not judged", [6]),
        ("!=", "not judged", [1, 2, 3, 4, 5]),
    ],
)
def test_quality_is_a_column_like_others(doubted, operator, value, expected):
    """What has no record is not judged: `ok` would be a verdict without evidence."""
    rows = listed(doubted, Condition("quality", operator, value), Condition("id", "<=", 6.0))
    assert [row["id"] for row in rows] == expected
    meets = OPERATORS[operator]
    assert rows == [row for row in listed(doubted) if row["id"] <= 6 and meets(row["quality"], value)]
    assert listed(doubted, Condition("quality", operator, value)) == [
        row for row in listed(doubted) if meets(row["quality"], value)
    ]


@pytest.mark.parametrize(
    ("condition", "kind", "message"),
    [
        *(
            (("quality", operator, value), ValueError, "expected quality= or quality!= one of ok, warning, reject, not")
            for operator, value in (("=", "good"), ("=", 1.0), (">", 1.0))
        ),
        (("campaign", ">", "a"), ValueError, "campaign>a; expected = or != and a name"),
        (("campaign", "=", "c"), LookupError, r"no campaign 'c' in the store; known: a, b"),
        (("colour", "=", "red"), UnknownFieldError, r"'colour'.*tip_material.*tip_radius"),
        (("run", "=", "three"), ValueError, "run is compared with 'three'; expected a number"),
    ],
)
def test_condition_that_is_none_is_refused(filled, condition, kind, message):
    with pytest.raises(kind, match=message):
        listed(filled, Condition(*condition))


@pytest.mark.parametrize(("operator", "expected"), [("=", {"b"}), ("!=", {"a"})])
def test_the_campaign_is_a_column_like_others(filled, operator, expected):
    steel, one = Condition("tip_material", "=", "steel"), Condition("campaign", operator, "b")
    rows = listed(filled, one, steel)
    assert rows == [row for row in listed(filled, steel) if row["campaign"] in expected]
    assert {row["campaign"] for row in rows} == expected
    with filled.reading() as session:
        shots = list(iter_shots(session, None, (one,)))
        assert shots == [shot for shot in iter_shots(session) if shot["campaign"] in expected]


def test_conditions_narrow_together(filled):
    rows = listed(filled, Condition("tip_material", "=", "steel"), Condition("run", ">", 5.0), campaign="a")
    assert [row["run"] for row in rows] == [6, 8, 10]


MANY = (
    (Condition("tip_material", "=", "steel"),),
    (Condition("tip_material", "!=", "gold"),),
    (Condition("tip_material", "=", "delrin"), Condition("tip_radius_m", "=", 0.03), Condition("run", ">", 3.0)),
    (Condition("tip_material", "=", "gold"), Condition("tip_radius_m", ">", 0.0)),
)


def test_many_configurations_are_no_values_of_a_statement(filled, monkeypatch):
    """A statement with a value for each of 65,536 configurations was refused by PostgreSQL, by SQLite half of that."""
    few = [listed(filled, *where, campaign=campaign) for where in MANY for campaign in (None, "b")]
    monkeypatch.setattr(conditions, "_MOST_KEYS", 0)
    monkeypatch.setattr(conditions, "span_of", _without_keys)
    many = [listed(filled, *where, campaign=campaign) for where in MANY for campaign in (None, "b")]
    assert many == few
    assert [len(rows) for rows in many] == [12, 6, 24, 12, 4, 2, 0, 0]


def _without_keys(session, table, campaign_id, keys):
    assert not keys
    return span_of(session, table, campaign_id, keys)


def test_number_by_another_road_still_matches(filled):
    assert len(listed(filled, Condition("tip_radius_m", "=", 45 * 1e-3 * (1 + 1e-12)))) == 12


def test_unknown_campaign_lists_the_known_and_shots_have_no_quality(filled):
    with pytest.raises(LookupError, match=r"'z'.*a, b"):
        listed(filled, campaign="z")
    with filled.reading() as session, pytest.raises(UnknownFieldError, match="'quality'"):
        list(iter_shots(session, None, (Condition("quality", "=", "ok"),)))


def test_campaigns_count_impacts_and_plans(filled):
    with filled.reading() as session:
        rows = list_campaigns(session)
    counts = [(r["name"], r["impacts"], r["shots"], r["planned"], r["done"]) for r in rows]
    assert counts == [("a", 12, 0, 0, 0), ("b", 12, 0, 13, 12)]


FILTERS = {
    "all": ((), None),
    "campaign": ((), "b"),
    "factor": ((Condition("tip_material", "=", "steel"),), None),
    "column": ((Condition("run", ">", 5.0),), "a"),
    "none": ((Condition("tip_material", "=", "gold"),), None),
}


def pages(store, where, campaign, limit):
    """Every page of a listing, each asked for by the key that the one before told."""
    with store.reading() as session:
        after, more = None, True
        while more:
            rows, after = list_impacts_page(session, campaign, where, after, limit)
            yield rows
            more = after is not None


@pytest.mark.parametrize("limit", [1, 5, 12, 24, 100])
@pytest.mark.parametrize("name", FILTERS)
def test_pages_by_key_are_the_whole_listing(filled, name, limit):
    where, campaign = FILTERS[name]
    found = list(pages(filled, where, campaign, limit))
    assert [row for rows in found for row in rows] == listed(filled, *where, campaign=campaign)
    assert all(len(rows) == limit for rows in found[:-1])
    assert len(found) == 1 or found[-1]


def test_page_goes_on_from_any_key_but_is_not_of_nothing(filled):
    with filled.reading() as session:
        last = list(iter_impacts(session))[-1]["id"]
        for after in (last, last + 1, 10**30):
            assert list_impacts_page(session, None, (), after, 10) == ([], None)
        rows, _ = list_impacts_page(session, None, (), -5, 3)  # a key that is gone
        assert rows == listed(filled)[:3]
        with pytest.raises(ValueError, match="limit is 0"):
            list_impacts_page(session, None, (), None, 0)


def test_page_asks_the_database_for_no_more_than_itself(filled):
    asked = []
    with filled.reading() as session:

        @event.listens_for(session.connection(), "before_cursor_execute")
        def _note(_connection, _cursor, statement, parameters, *_):
            if " LIMIT " in statement:
                asked.append(parameters)

        list_impacts_page(session, None, (), None, 4)
    (parameters,) = asked
    assert 5 in (parameters.values() if isinstance(parameters, dict) else parameters)


def test_shots_have_pages_too(new_database):
    with _filled(new_database()) as store:
        with store.writing() as session:
            campaign = Campaign(name="g", kind="gun", date=dt.date(2026, 1, 1), fingerprint="g")
            session.add(campaign)
            session.flush()
            own = {"campaign_id": campaign.id, "repetition": 1, "configuration_id": 1, "tank_pressure_pa": 1e5}
            session.add_all(Shot(run=run, bullet_mass_kg=0.1 + run, **own) for run in range(7))
        with store.reading() as session:
            whole = list(iter_shots(session, "g"))
            first, after = list_shots_page(session, "g", (), None, 4)
            rest, end = list_shots_page(session, "g", (), after, 4)
            assert (first + rest, after, end) == (whole, whole[3]["id"], None)
            heavy, _ = list_shots_page(session, None, (Condition("bullet_mass_kg", ">", 3.0),), after, 10)
            assert [row["run"] for row in heavy] == [4, 5, 6]
