"""Listings: every matching row once, in order, filtered and thinned in the database, and how often
it is asked."""

from __future__ import annotations

import datetime as dt
from contextlib import contextmanager
from itertools import pairwise

import pytest
from pyroshock.schema import conditions
from pyroshock.schema.campaigns import Campaign, Configuration, Plan, PlannedRun
from pyroshock.schema.conditions import KeySpan, iter_pages, span_of
from pyroshock.schema.configurations import configuration_id, configuration_ids
from pyroshock.schema.impacts import ExtractionSettingsRow, Impact, Pulse, Shot
from pyroshock.schema.known_factors import RunLevel
from pyroshock.schema.listings import (
    OPERATORS,
    Condition,
    UnknownFieldError,
    iter_impacts,
    iter_shots,
    list_campaigns,
    list_impacts_page,
    list_pulses,
    list_shots_page,
)
from pyroshock.schema.recordings import QualityFinding, Recording
from pyroshock.schema.session import Writer, open_store
from sqlalchemy import event, select
from support.stores.recorded import WHEN, pulse_row
from support.stores.stores import statements

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
            campaign = Campaign(
                name=name, kind="hammer", date=dt.date(2026, 1, 1), fingerprint=name
            )
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
                    planned = PlannedRun(
                        plan=plan, run=i, position=i, configuration_id=key, repetitions=1, **NOTHING
                    )
                    session.add(planned)
                    session.flush()
                    impact.planned_run_id = planned.id
                session.add(impact)
        session.add(PlannedRun(plan=plan, run=99, position=99, configuration_id=key, **NOTHING))


def listed(store, *conditions, campaign=None, page=2000):
    with store.reading() as session:
        return list(iter_impacts(session, campaign, tuple(conditions), page))


def test_pages_join_and_rows_carry_campaign_factors_and_si_keys(filled):
    whole = listed(filled)
    assert len(whole) == 24
    for page in (1, 5, 12, 23, 24, 25):
        assert listed(filled, page=page) == whole
    row = listed(filled, campaign="b")[1]
    assert row["campaign"] == "b"
    assert (row["tip_material"], row["tip_radius_m"]) == ("delrin", 0.03)
    assert (row["impact_velocity_m_s"], row["peak_force_n"], row["quality"]) == (
        1.0,
        None,
        "not judged",
    )
    with filled.reading() as session:
        rows = list_campaigns(session)
    counts = [(r["name"], r["impacts"], r["shots"], r["planned"], r["done"]) for r in rows]
    assert counts == [("a", 12, 0, 0, 0), ("b", 12, 0, 13, 12)]


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
    """Impact 1 is warned of, 2 warned of and rejected, 3 shares a recording that is warned of with
    4, whose own finding is a note; 5 has one of a note alone. The others have no recording.
    """
    warnings = [(1, 1, "warning"), (2, 2, "warning"), (3, None, "warning")]
    said = [*warnings, (2, 2, "reject"), (3, 4, "note"), (5, 5, "note")]
    with _filled(new_database()) as store:
        with store.writing() as session:
            for key, impacts in ((1, (1,)), (2, (2,)), (3, (3, 4)), (5, (5,))):
                session.add(Recording(id=key, campaign_id=1, path=str(key), sha256="0" * 64,
                size_bytes=1, format="csv",
                                      status="stored"))  # fmt: skip
                session.flush()
                for impact in impacts:
                    session.get_one(Impact, impact).recording_id = key
            for recording, impact, severity in said:
                session.add(QualityFinding(recording_id=recording, impact_id=impact, check="rest",
                severity=severity,
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
    assert rows == [
        row for row in listed(doubted) if row["id"] <= 6 and meets(row["quality"], value)
    ]
    assert listed(doubted, Condition("quality", operator, value)) == [
        row for row in listed(doubted) if meets(row["quality"], value)
    ]


@pytest.mark.parametrize(
    ("condition", "kind", "message"),
    [
        *(
            (
                ("quality", operator, value),
                ValueError,
                "expected quality= or quality!= one of ok, warning, reject, not",
            )
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


def test_conditions_narrow_together_and_match_a_number_by_another_road(filled):
    rows = listed(
        filled, Condition("tip_material", "=", "steel"), Condition("run", ">", 5.0), campaign="a"
    )
    assert [row["run"] for row in rows] == [6, 8, 10]
    assert len(listed(filled, Condition("tip_radius_m", "=", 45 * 1e-3 * (1 + 1e-12)))) == 12
    with pytest.raises(LookupError, match=r"'z'.*a, b"):
        listed(filled, campaign="z")
    with filled.reading() as session, pytest.raises(UnknownFieldError, match="'quality'"):
        list(iter_shots(session, None, (Condition("quality", "=", "ok"),)))


MANY = (
    (Condition("tip_material", "=", "steel"),),
    (Condition("tip_material", "!=", "gold"),),
    (
        Condition("tip_material", "=", "delrin"),
        Condition("tip_radius_m", "=", 0.03),
        Condition("run", ">", 3.0),
    ),
    (Condition("tip_material", "=", "gold"), Condition("tip_radius_m", ">", 0.0)),
)


def test_many_configurations_are_no_values_of_a_statement(filled, monkeypatch):
    """A statement with a value for each of 65,536 configurations was refused by PostgreSQL, by
    SQLite half of that."""
    few = [listed(filled, *where, campaign=campaign) for where in MANY for campaign in (None, "b")]
    monkeypatch.setattr(conditions, "_MOST_KEYS", 0)
    monkeypatch.setattr(conditions, "span_of", _without_keys)
    many = [listed(filled, *where, campaign=campaign) for where in MANY for campaign in (None, "b")]
    assert many == few
    assert [len(rows) for rows in many] == [12, 6, 24, 12, 4, 2, 0, 0]


def _without_keys(session, table, campaign_id, keys):
    assert not keys
    return span_of(session, table, campaign_id, keys)


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
            own = {
                "campaign_id": campaign.id,
                "repetition": 1,
                "configuration_id": 1,
                "tank_pressure_pa": 1e5,
            }
            session.add_all(Shot(run=run, bullet_mass_kg=0.1 + run, **own) for run in range(7))
        with store.reading() as session:
            whole = list(iter_shots(session, "g"))
            first, after = list_shots_page(session, "g", (), None, 4)
            rest, end = list_shots_page(session, "g", (), after, 4)
            assert (first + rest, after, end) == (whole, whole[3]["id"], None)
            heavy, _ = list_shots_page(
                session, None, (Condition("bullet_mass_kg", ">", 3.0),), after, 10
            )
            assert [row["run"] for row in heavy] == [4, 5, 6]


#: Key of the impact -> its configuration: two clusters far apart, a stray, and a dense stretch.
PLACES = {
    **dict.fromkeys(range(10, 300), 1),
    **dict.fromkeys(range(1000000, 1000040), 2),
    5_000: 2,
    **dict.fromkeys(range(2000, 4000, 7), 3),
}


@pytest.fixture(scope="module")
def scattered(new_database):
    with open_store(new_database(), Writer("test", "0"), create=True) as store:
        with store.writing() as session:
            for key in (1, 2, 3):
                session.add(
                    Campaign(
                        id=key,
                        name=str(key),
                        kind="hammer",
                        date=dt.date(2026, 1, 1),
                        fingerprint="x",
                    )
                )
                session.add(Configuration(id=key, fingerprint=str(key)))
            session.flush()
            session.add_all(
                Impact(
                    id=key,
                    campaign_id=configuration,
                    run=key,
                    repetition=1,
                    configuration_id=configuration,
                )
                for key, configuration in PLACES.items()
            )
        yield store


@pytest.mark.parametrize("page", [1, 50, 2000])
@pytest.mark.parametrize("wanted", [[1], [2], [3], [1, 2], [1, 2, 3]])
def test_every_match_comes_once_and_in_order(scattered, wanted, page):
    with scattered.reading() as session:
        query = select(Impact.id).where(Impact.configuration_id.in_(wanted))
        pages = list(
            iter_pages(session, query, Impact.id, span_of(session, Impact, None, wanted), page)
        )
    listed_ids = [row["id"] for rows in pages for row in rows]
    assert listed_ids == sorted(
        key for key, configuration in PLACES.items() if configuration in wanted
    )
    assert all(0 < len(rows) <= page for rows in pages)


def test_span_is_where_the_rows_lie(scattered):
    with scattered.reading() as session:
        assert span_of(session, Impact, None, None) == KeySpan(10, 1_000_039)
        assert span_of(session, Impact, 3, None) == KeySpan(2_000, 3_995)
        assert span_of(session, Impact, None, [2]) == KeySpan(5_000, 1_000_039)
        assert span_of(session, Impact, 1, [2]).first > span_of(session, Impact, 1, [2]).last
        nothing = span_of(session, Impact, None, [99])
        assert list(iter_pages(session, select(Impact.id), Impact.id, nothing, 10)) == []


IMPACTS = 97


@pytest.fixture(scope="module")
def thinned(new_database):
    """97 impacts with an earlier and a current pulse each, one in three of steel; a last one
    without a pulse."""
    with open_store(new_database(), Writer("test", "0"), create=True) as thinned:
        with thinned.writing() as session:
            session.add(Campaign(id=1, name="c", kind="hammer", date=WHEN.date(), fingerprint="c"))
            session.add_all(
                ExtractionSettingsRow(id=i, fingerprint=str(i), code_version=1, settings={})
                for i in (1, 2)
            )
            keys = [
                configuration_id(session, [RunLevel("tip_material", tip)])
                for tip in ("steel", "delrin")
            ]
            for i in range(1, IMPACTS + 2):
                key = keys[i % 3 > 0]
                session.add(Impact(id=i, campaign_id=1, run=i, repetition=1, configuration_id=key))
            session.flush()
            for settings in (1, 2):
                own = {"settings_id": settings, "current": settings == 2}
                keys_of = ((i, 1000 * settings + i) for i in range(1, IMPACTS + 1))
                session.add_all(
                    pulse_row(i, id=key, peak_force_n=float(i), **own) for i, key in keys_of
                )
        yield thinned


def keys(thinned, most, *where, campaign="c"):
    with thinned.reading() as session:
        return pulse_keys(session, campaign, where, most)


def pulse_keys(session, campaign, where, most):
    rows, total = list_pulses(session, campaign, where, most, (Pulse.id,))
    return [key for (key,) in rows], total


@pytest.mark.parametrize("most", [1, 2, 10, 50, 96])
def test_as_many_as_asked_for_in_even_steps(thinned, most):
    thinned_ids, total = keys(thinned, most)
    assert (len(thinned_ids), total, thinned_ids[0]) == (most, IMPACTS, 2001)
    steps = {b - a for a, b in pairwise(thinned_ids)}
    assert steps <= {IMPACTS // most, IMPACTS // most + 1}


@pytest.mark.parametrize("most", [97, 98, 5000])
def test_all_where_they_fit(thinned, most):
    assert keys(thinned, most) == ([2000 + i for i in range(1, IMPACTS + 1)], IMPACTS)


def test_filter_is_taken_before_the_thinning(thinned):
    thinned_ids, total = keys(
        thinned, 8, Condition("tip_material", "=", "steel"), Condition("peak_force_n", ">", 30.0)
    )
    assert (len(thinned_ids), total) == (8, 22)
    assert all(key % 1000 % 3 == 0 and key % 1000 > 30 for key in thinned_ids)
    assert keys(thinned, 8, Condition("tip_material", "=", "gold")) == ([], 0)
    with pytest.raises(ValueError, match="most is 0"):
        keys(thinned, 0)


THREE_TIPS = ("steel", "delrin", "PLA")


@pytest.fixture
def store(tables_url):
    with open_store(tables_url, Writer("test", "0"), create=True) as store:
        yield store


def combinations(radii):
    """As many configurations as radii, of six factors each."""
    rest = [RunLevel(f"factor {i}", "1.0", 1.0) for i in range(4)]
    return [
        [RunLevel("tip", THREE_TIPS[i % 3]), RunLevel("radius", f"{i}.0", float(i)), *rest]
        for i in range(radii)
    ]


def configurations(store, radii):
    with statements(store) as sql:
        keys = store.write(lambda session: configuration_ids(session, combinations(radii)))
    return keys, len(sql)


def test_known_configurations_are_asked_for_at_once(store):
    keys, _ = configurations(store, 30)
    again, few = configurations(store, 3)
    everyone, many = configurations(store, 30)
    assert (again, everyone, few) == (keys[:3], keys, many)


def test_new_configuration_takes_few_statements_for_all_its_levels(store):
    """The configuration: looked for, within a savepoint, its levels; of the levels only the new
    radius costs more."""
    configurations(store, 10)
    _, of_one = configurations(store, 11)
    _, of_four = configurations(store, 15)
    assert of_four - of_one <= 3 * 10


def test_pulses_of_a_small_store_are_not_counted_first(store):
    with store.writing() as session:
        session.add(
            Campaign(id=1, name="c", kind="hammer", date=dt.date(2026, 1, 1), fingerprint="c")
        )
        session.add(ExtractionSettingsRow(id=1, fingerprint="1", code_version=1, settings={}))
        (key,) = configuration_ids(session, [[RunLevel("tip", "steel")]])
        session.add_all(
            Impact(id=i, campaign_id=1, run=i, repetition=1, configuration_id=key)
            for i in range(1, 9)
        )
        session.flush()
        session.add_all(pulse_row(i, id=i) for i in range(1, 9))
    where = (Condition("tip", "=", "steel"),)
    with store.reading() as session:
        with statements(store) as of_all:
            assert pulse_keys(session, None, where, 8) == ([*range(1, 9)], 8)
        with statements(store) as of_some:
            assert pulse_keys(session, None, where, 4) == ([1, 3, 5, 7], 8)
    assert [sum("count(" in statement for statement in sql) for sql in (of_all, of_some)] == [0, 1]
    assert sum(statement.startswith("SELECT") for statement in of_all) == 3


@pytest.mark.parametrize(("most", "expected"), [(None, 97), (97, 97), (8, 8)])
def test_pulses_hold_the_columns_that_are_asked_for(thinned, most, expected):
    """Of all pulses, and of those that are left of a thinning."""
    columns = (Pulse.id, Impact.run, Pulse.peak_force_n)
    with thinned.reading() as session:
        rows, total = list_pulses(session, "c", (), most, columns)
    assert (len(rows), total) == (expected, 97)
    assert all(row.id == 2000 + row.run and row.peak_force_n == row.run for row in rows)
