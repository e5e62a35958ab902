"""What training needs and impacts lack is told in one message, at the ingest and where a dataset is
built."""

from __future__ import annotations

import json

from pyroshock.dataset.predictors import shipped
from pyroshock.dataset.rows import levels_of, materials_of, rows_of_campaigns
from pyroshock.dataset.selection import (
    MissingFacts,
    missing_facts,
    missing_in_campaigns,
    missing_words,
)
from pyroshock.schema.listings import get_campaign_id
from support.records.campaigns import hammer_campaign, hammer_rows, write_runs
from support.stores.stores import ingested, opened, pyroshock

PROPERTIES = tuple(
    f"plate_{name}" for name in ("youngs_modulus", "poisson_ratio", "density", "yield_strength")
)
WHOLE = {
    "plate_material": "steel",
    "anvil_material": "none",
    "insulator": "none",
    "boundary_conditions": "free",
    "impact_velocity_m_s": 1.5,
}


def missing(url):
    with opened(url) as store, store.reading() as session:
        return missing_in_campaigns(session, ["hammer"], shipped("hammer"))


def campaign(tmp_path, **columns):
    folder = hammer_campaign(tmp_path / "c")
    write_runs(folder, [{**row, **columns} for row in hammer_rows()])
    return folder


def test_each_missing_fact_is_counted_with_its_place(sqlite_url, tmp_path):
    ingested(sqlite_url, campaign(tmp_path))
    facts = {fact.predictors: (fact.impacts, fact.remedies) for fact in missing(sqlite_url)}
    plate = "plate_material in runs.csv, or material in [bench.plate]"
    assert facts[PROPERTIES] == (4, ("anvil_material in runs.csv", plate))
    assert facts[("boundary_conditions",)] == (4, ("boundary_conditions in runs.csv",))
    assert facts[("impact_velocity",)][0] == 4
    assert not any(name.startswith("tip") for names in facts for name in names)
    result = pyroshock("dataset", "build", "d", "--from", "hammer", "--db", sqlite_url)
    assert result.exit_code == 2
    assert "4 no boundary_conditions" in result.stderr
    assert "anvil_material in runs.csv; plate_material in runs.csv" in result.stderr


def test_impacts_alike_are_counted_together_as_one_by_one(tables_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c")
    rows = [{**row, **WHOLE} for row in hammer_rows()]
    rows[0]["impact_velocity_m_s"] = rows[1]["impact_velocity_m_s"] = ""
    write_runs(folder, [*rows[:3], {**rows[3], "boundary_conditions": "", "anvil_material": ""}])
    ingested(tables_url, folder)
    predictors = shipped("hammer")
    with opened(tables_url) as store, store.reading() as session:
        impacts = rows_of_campaigns(session, [get_campaign_id(session, "hammer")], None)
        levels = levels_of(session, (impact["configuration_id"] for impact in impacts))
        facts_one_by_one = missing_facts(
            ((impact, 1) for impact in impacts), levels, predictors, materials_of(session)
        )
        grouped_facts = missing_in_campaigns(session, ["hammer"], predictors)
    assert grouped_facts == facts_one_by_one
    counts = {name: fact.impacts for fact in grouped_facts for name in fact.predictors}
    assert (counts["impact_velocity"], counts["boundary_conditions"]) == (2, 1)


def test_one_message_at_the_ingest(sqlite_url, tmp_path):
    result = pyroshock("ingest", campaign(tmp_path), "--db", sqlite_url, "--jobs", "1", "--json")
    (finding,) = [
        each for each in json.loads(result.stdout)["findings"] if each["check"] == "missing-facts"
    ]
    assert finding["severity"] == "note"
    assert "4 no boundary_conditions" in finding["message"]
    assert "and ingest the folder again" in finding["message"]
    assert [line for line in result.stderr.splitlines() if finding["message"] in line] != []


def test_what_the_message_asks_for_makes_the_dataset(sqlite_url, tmp_path):
    known = {name: WHOLE[name] for name in ("impact_velocity_m_s", "insulator")}
    folder = campaign(tmp_path, **known)
    ingested(sqlite_url, folder)
    write_runs(folder, [{**row, **WHOLE} for row in hammer_rows()])
    notes = ingested(sqlite_url, folder).stderr
    assert "missing-facts" not in notes
    assert missing(sqlite_url) == []
    result = pyroshock("dataset", "build", "d", "--from", "hammer", "--db", sqlite_url, "--json")
    assert json.loads(result.stdout)["pulses"] == 4


def test_dataset_of_some_impacts_says_what_the_others_lack(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c")
    rows = [{**row, **WHOLE} for row in hammer_rows()]
    write_runs(folder, [*rows[:3], {**rows[3], "boundary_conditions": ""}])
    ingested(sqlite_url, folder)
    result = pyroshock("dataset", "build", "d", "--from", "hammer", "--db", sqlite_url)
    assert result.exit_code == 0
    assert "1 impact has no boundary_conditions: training leaves such impacts out" in result.stderr
    assert missing_words([]) == ""
    facts = [
        MissingFacts(2, ("a", "b"), ("x in runs.csv",)),
        MissingFacts(1, ("c",), ("x in runs.csv", "y")),
    ]
    assert missing_words(facts) == (
        "2 impacts have no a, b; 1 no c: training leaves such impacts out; add x in runs.csv; y; "
        "and ingest the folder again"
    )
