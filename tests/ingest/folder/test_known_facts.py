"""`[known]` of campaign.toml: what the laboratory measured of its own bench, read, stored, carried
and given back."""

from __future__ import annotations

import datetime as dt
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.reading.campaign import read_campaign, read_folder
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from pyroshock.ingest.folder.known_facts import read_known_facts
from pyroshock.schema.known_facts import (
    KnownFact,
    are_facts,
    effect_parameters,
    facts_from_json,
    facts_to_json,
)
from support.records.campaigns import gun_campaign, replace_in
from support.stores.stores import content, ingest, ingested, opened, pyroshock, run_pyroshock

KNOWN = """
[known]
gun.valve_flow.opening_time_s = { value = 120, u = 10, unit = "ms", \
source = "data sheet", date = 2024-03-12 }
sensor.velocity_gain.gain = { value = 1.0, u = 0.002, source = "certificate 4711" }
"""
FACTS = (
    KnownFact("gun.valve_flow.opening_time_s", 0.12, 0.01, "data sheet", dt.date(2024, 3, 12)),
    KnownFact("sensor.velocity_gain.gain", 1.0, 0.002, "certificate 4711"),
)
GAIN = "sensor.velocity_gain.gain"
ENTRY = {"value": 1.0, "u": 0.01, "source": "a certificate"}


@pytest.fixture
def folder(tmp_path):
    """A gun campaign with two facts."""
    campaign = gun_campaign(tmp_path / "shots")
    with (campaign / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write(KNOWN)
    return campaign


def stored_facts(url):
    with opened(url) as store, store.reading() as session:
        return read_campaign(session, "gun").known_facts


def test_facts_are_read_in_si(folder):
    assert read_campaign_file(folder).known_facts == FACTS
    assert [fact.words for fact in FACTS] == [
        "0.12 ± 0.01 s (data sheet, 2024-03-12)",
        "1 ± 0.002 (certificate 4711)",
    ]
    assert (FACTS[0].effect, FACTS[0].parameter) == ("gun.valve_flow", "opening_time_s")
    assert read_folder(folder).known_facts == FACTS


@pytest.mark.parametrize(
    ("unit", "name", "value", "si"),
    [
        ("ms", "gun.valve_flow.opening_time_s", 50, 0.05),
        ("L", "gun.dead_volume.volume_m3", 0.3, 3e-4),
        ("cm3", "gun.dead_volume.volume_m3", 300, 3e-4),
        ("kPa", "gun.back_pressure.atmosphere_pa", 98.7, 98_700),
        ("um", "gun.blow_by.wear_m", 20, 2e-5),
        ("percent", "gun.heat_exchange.share", 30, 0.3),
        ("mm/N", "contact.layer_compliance.compliance_m_n", 1e-5, 1e-8),
    ],
)
def test_units_are_converted(unit, name, value, si):
    (fact,) = read_known_facts(
        {name: {"value": value, "u": value / 10, "source": "s", "unit": unit}}
    )
    assert (fact.value, fact.u) == (pytest.approx(si), pytest.approx(si / 10))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"gun": {"valve_flow": {"opening_s": ENTRY}}},
         "known.gun.valve_flow.opening_s is no parameter; known: gun.valve_flow.loss_coefficient, "
         "gun.valve_flow.opening_time_s, gun.valve_flow.steady_loss_coefficient"),
        ({"gun": {"valve": {"x": ENTRY}}},
         "is no parameter; known: gun.back_pressure.atmosphere_pa, "),
        ({"valve": ENTRY}, "known.valve is no parameter; known: gun.back_pressure"),
        ({"gun": {}}, "known.gun is no parameter"),
        ({GAIN: 1.0}, "is 1.0; expected { value = NUMBER, u = NUMBER, source = TEXT }"),
        ({GAIN: {}}, ".value is missing; expected a number"),
        ({GAIN: ENTRY | {"error": 1}}, ".error'; known: value, u, source, date, unit"),
        ({GAIN: ENTRY | {"value": "1"}}, ".value is '1'; expected a finite number"),
        ({GAIN: ENTRY | {"value": True}}, ".value is True; expected a finite number"),
        ({GAIN: ENTRY | {"value": float("nan")}}, ".value is nan; expected a finite number"),
        ({GAIN: ENTRY | {"value": 10**400}}, ".value is 1000"),
        ({GAIN: ENTRY | {"value": 7}}, ".value is 7; expected 0.5 to 2"),
        ({GAIN: ENTRY | {"u": 0}}, ".u is 0; expected a standard uncertainty above zero"),
        ({GAIN: ENTRY | {"u": -0.1}}, ".u is -0.1; expected a standard uncertainty above zero"),
        ({GAIN: {"value": 1, "source": "s"}}, ".u is missing"),
        ({GAIN: {"value": 1, "u": 0.1}}, ".source is missing; expected one line"),
        ({GAIN: ENTRY | {"source": " "}}, ".source is ' '; expected one line"),
        ({GAIN: ENTRY | {"source": "a\nb"}}, "expected one line"),
        ({GAIN: ENTRY | {"date": "last spring"}},
         ".date is 'last spring'; expected the day of the measurement"),
        ({GAIN: ENTRY | {"unit": "V"}}, ".unit is 'V'; expected no unit, for it is a pure number"),
        ({GAIN: ENTRY | {"unit": 3}}, ".unit is 3; expected no unit"),
        ({"gun.dead_volume.volume_m3": {**ENTRY, "unit": "mm"}},
         ".unit is 'mm'; expected a unit that converts to m3"),
        ({"gun.dead_volume.volume_m3": {**ENTRY, "unit": "hat"}},
         "expected a unit that converts to m3"),
        ({GAIN: ENTRY, "sensor": {"velocity_gain": {"gain": ENTRY}}},
         f"known.{GAIN} is given twice"),
    ],
)  # fmt: skip
def test_what_is_no_fact_is_refused_with_what_is(table, message):
    with pytest.raises(IngestError) as refused:
        read_known_facts(table)
    assert message in str(refused.value)


def test_all_faults_are_told_at_once():
    with pytest.raises(IngestError) as refused:
        read_known_facts({GAIN: {"value": "x", "u": "y", "date": 3}, "gun.leak": ENTRY})
    assert len(refused.value.faults) == 5


cells = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=5),
    st.dates(),
    st.lists(st.integers()),
)
keys = st.sampled_from(
    [
        "value",
        "u",
        "source",
        "date",
        "unit",
        "gun",
        "valve_flow",
        GAIN,
        *list(effect_parameters())[:3],
    ]
)


@given(st.recursive(cells, lambda inner: st.dictionaries(keys, inner, max_size=4), max_leaves=12))
def test_any_table_is_read_or_refused(value: Any):
    table = value if isinstance(value, dict) else {GAIN: value}
    try:
        facts = read_known_facts(table)
    except IngestError:  # refused, which is one of the two
        return
    assert facts_from_json(json.loads(json.dumps(facts_to_json(facts)))) == facts
    assert are_facts(facts_to_json(facts))


@pytest.mark.parametrize(
    "stored",
    [
        1,
        [],
        {GAIN: 1},
        {GAIN: {"value": 1.0}},
        {GAIN: {"value": 1.0, "u": 1.0, "source": "s", "date": "x"}},
    ],
)
def test_stored_json_of_another_form_is_told(stored):
    assert not are_facts(stored)


def test_facts_are_stored_shown_carried_and_given_back(database_url, folder, tmp_path):
    ingested(database_url, folder)
    assert stored_facts(database_url) == FACTS
    assert "nothing new" in ingested(database_url, folder).stderr
    shown = run_pyroshock("campaigns", "show", "gun", "--db", database_url).stdout
    assert all(fact.name in shown and fact.words in shown for fact in FACTS)
    overview = json.loads(
        run_pyroshock("campaigns", "show", "gun", "--db", database_url, "--json").stdout
    )
    assert overview["campaign"]["known"] == facts_to_json(FACTS)
    file, other = tmp_path / "gun.pyroshock", f"sqlite:///{tmp_path / 'other.db'}"
    run_pyroshock("db", "export", "gun", "--out", file, "--db", database_url)
    run_pyroshock("init", "--db", other)
    run_pyroshock("db", "import", file, "--db", other)
    assert stored_facts(other) == FACTS
    before = content(database_url)["campaigns"]
    archive = tmp_path / "archive.pyroshock"
    run_pyroshock(
        "campaigns", "archive", "gun", "--out", archive, "--reason", "full", "--db", database_url
    )
    run_pyroshock("campaigns", "restore", archive, "--db", database_url)
    assert content(database_url)["campaigns"] == before
    assert stored_facts(database_url) == FACTS
    for url in (database_url, other):
        assert pyroshock("db", "check", "--db", url).exit_code == 0


def test_a_fact_that_was_measured_later_is_added_and_one_that_changed_is_refused(
    database_url, folder
):
    card = folder / "campaign.toml"
    whole = card.read_text(encoding="utf-8")
    card.write_text(whole.replace(KNOWN, ""), encoding="utf-8")
    ingested(database_url, folder)
    assert stored_facts(database_url) == ()
    card.write_text(whole, encoding="utf-8")
    assert (
        "known.sensor.velocity_gain.gain = 1 ± 0.002 (certificate 4711)"
        in ingested(database_url, folder).stderr
    )
    assert stored_facts(database_url) == FACTS
    assert pyroshock("db", "check", "--db", database_url).exit_code == 0
    replace_in(card, "u = 0.002", "u = 0.004")
    refused = ingest(database_url, folder)
    assert refused.exit_code == 2
    assert (
        "gain is 1 ± 0.004 (certificate 4711), 1 ± 0.002 (certificate 4711) in the store"
        in refused.stderr
    )
    card.write_text(whole.replace(KNOWN, ""), encoding="utf-8")
    assert "known.sensor.velocity_gain.gain is not given" in ingest(database_url, folder).stderr
    assert stored_facts(database_url) == FACTS
