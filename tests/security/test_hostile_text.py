"""Text that would be a statement, a placeholder or a format elsewhere is text here: it is stored, found and shown."""

from __future__ import annotations

import json
from pathlib import Path

from pyroshock.doe.plans import list_plans
from pyroshock.schema.session import count_rows
from support.records.campaigns import hammer_campaign, hammer_rows, with_cell, write_runs
from support.stores.stores import ingested, opened, pyroshock
from support.stores.web_stores import FACTORS

HOSTILE = [
    "'; DROP TABLE impacts; --",
    "x\"); DELETE FROM campaigns; -- ' OR '1'='1",
    "%s %(name)s %% {0} {name} $1 ? \\'; SELECT pg_sleep(60); -- ї—🔨",
]


def filled(db: str, folder: Path) -> None:
    """A campaign for each text, called so, with one hit whose mood of the operator is called so, too."""
    for number, text in enumerate(HOSTILE):
        made = hammer_campaign(folder / str(number), recordings=1, hits=1, name="NAME")
        campaign = made / "campaign.toml"
        named = campaign.read_text("utf-8").replace('"NAME"', json.dumps(text, ensure_ascii=False))
        campaign.write_text(named, "utf-8")
        write_runs(made, with_cell(hammer_rows(1, 1), "operator_mood", text))
        ingested(db, made)


def asked(*words: str) -> list[dict[str, object]]:
    result = pyroshock(*words, "--json")
    assert result.exit_code == 0, result.stderr
    found: list[dict[str, object]] = json.loads(result.stdout)
    return found


def rows(db: str) -> dict[str, int]:
    with opened(db) as store:
        return count_rows(store)


def test_names_and_levels_are_data(database_url: str, tmp_path: Path) -> None:
    """Each is found by itself alone, nothing is lost, and what is asked for is not what is done."""
    filled(database_url, tmp_path)
    before = rows(database_url)
    assert before["impacts"] == len(HOSTILE)
    assert {row["name"] for row in asked("campaigns", "--db", database_url)} == set(HOSTILE)
    for text in HOSTILE:
        for words in (("--campaign", text), ("--where", f"operator_mood={text}")):
            assert [row["campaign"] for row in asked("impacts", *words, "--db", database_url)] == [text]
    for begun in (("impacts", "--campaign"), ("impacts", "--where"), ("shots", "--campaign"), ("diagnose",)):
        answer = pyroshock(*begun, "operator_mood=a\0b", "--db", database_url)
        assert answer.exit_code in (0, 2) and answer.output.count("\n") == 1, (begun, answer.output)
    assert rows(database_url) == before


def test_plans_are_called_as_they_are_called(database_url: str, tmp_path: Path) -> None:
    factors = tmp_path / "factors.toml"
    factors.write_text(FACTORS)
    with opened(database_url, create=True):
        pass
    for text in HOSTILE:
        made = pyroshock("plan", "factorial", text, "--factors", factors, "--repetitions", "1", "--db", database_url)
        assert made.exit_code == 0, made.stderr
    with opened(database_url) as store, store.reading() as session:
        assert {plan["name"] for plan in list_plans(session)} == set(HOSTILE)
