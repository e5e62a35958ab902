"""`plan discriminate`: the experiment of a diagnosis as a plan that can be fired, and recorded
against."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from pyroshock.app.operations.diagnose import diagnosing
from pyroshock.app.operations.diagnose.diagnosing import keep
from pyroshock.app.operations.diagnose.discriminating_plan import factors_toml
from pyroshock.diagnosis.verdict import NextRun
from pyroshock.doe.space import space_from_text
from support.records import verdicts
from support.records.campaigns import gun_campaign, gun_rows, hammer_campaign, write_runs
from support.stores.stores import ingested, opened, pyroshock, run_pyroshock

NEXT = NextRun("separates A from B", {"tank_pressure_bar": 0.45, "bullet_mass_kg": 0.1428}, 4)


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("filled")
    folder = gun_campaign(place / "spring", name="spring")
    ingested(f"sqlite:///{place / 'lab.db'}", folder, hammer_campaign(place / "hammer", 2, 1))
    return place / "lab.db"


@pytest.fixture
def lab(filled: Path, tmp_path: Path) -> str:
    return f"sqlite:///{shutil.copy(filled, tmp_path)}"


def diagnosed(url: str, *runs: NextRun, campaign: str = "spring") -> None:
    """A diagnosis in the store that names these runs."""
    with opened(url) as store:
        keep(store, verdicts.verdict(campaign=campaign, next_runs=runs))


def plan(*words: str | Path) -> Result:
    return pyroshock("plan", *words)


def discriminated(url: str, campaign: str = "spring", *words: str) -> list[dict[str, Any]]:
    """Runs of the plan that the experiment of the campaign's diagnosis gives."""
    result = plan("discriminate", campaign, "--db", url, *words, "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)["runs"]


def test_sheet_and_status_know_the_plan(lab: str, tmp_path: Path) -> None:
    diagnosed(lab, NEXT)
    result = plan("discriminate", "spring", "--db", lab)
    assert result.exit_code == 0, result.stderr
    assert "separates A from B" in result.stderr
    assert (
        plan("sheet", "spring-discriminate", "--db", lab, "--out", tmp_path / "sheet.csv").exit_code
        == 0
    )
    sheet = (tmp_path / "sheet.csv").read_text(encoding="utf-8-sig")
    assert "tank_pressure_bar" in sheet and "0.45" in sheet and "discriminate" not in sheet
    assert "1 to do" in plan("status", "spring-discriminate", "--db", lab).stdout
    again = plan("discriminate", "spring", "--db", lab)
    assert again.exit_code == 2 and "choose another name" in again.stderr
    assert plan("discriminate", "spring", "--db", lab, "--name", "again").exit_code == 0


@pytest.mark.parametrize(("campaign", "runs", "expected"), [
    ("spring", [NEXT], {"repetitions": 4, "tank_pressure_pa": 45_000.0, "bullet_mass_kg": 0.1428,
                        "tip_material": "PLA"}),
    ("spring", [NEXT, NextRun("separates A from C", dict(NEXT.settings), 7)], {"repetitions": 7}),
    ("spring",
     [NextRun("by their own names, in SI", {"tank_pressure": 45_000.0, "bullet_mass": 0.1428}, 3)],
     {"tank_pressure_pa": 45_000.0}),
    ("hammer", [NextRun("why", {"tip_material": "steel", "tip_radius_mm": 30.0}, 3)],
     {"tip_radius_m": 0.03, "hammer_speed": "low"}),
], ids=["needed", "same setting twice", "own names", "hammer"])  # fmt: skip
def test_run_has_the_shots_that_are_needed_and_the_rest_as_usual(
    lab: str, campaign, runs, expected
) -> None:
    diagnosed(lab, *runs, campaign=campaign)
    (run,) = discriminated(lab, campaign)
    assert {name: run[name] for name in expected} == expected


def test_each_setting_is_a_run_and_factors_are_the_rows(lab: str) -> None:
    other = NextRun(
        "separates A from C",
        {"tank_pressure_bar": 0.3, "bullet_mass_kg": 0.2, "tip_material": "steel"},
        2,
    )
    diagnosed(lab, NEXT, other)
    runs = discriminated(lab, "spring", "--name", "two")
    assert [(run["repetitions"], run["tip_material"]) for run in runs] == [(4, "PLA"), (2, "steel")]
    columns = ("tank_pressure_bar", "tip_material", "pad")
    rows = [
        dict(zip(columns, cells, strict=True))
        for cells in (("0.5", 'st"eel', "3"), ("0.25", "PLA", "10"))
    ]
    space = space_from_text(factors_toml("gun", rows))
    assert space.rows(space.treatments(rows)) == rows
    assert [factor.levels for factor in space.factors] == [
        ("0.25", "0.5"),
        ('st"eel', "PLA"),
        ("3", "10"),
    ]


def test_recorded_shots_are_linked_to_it(lab: str, tmp_path: Path) -> None:
    diagnosed(lab, NEXT)
    plan("discriminate", "spring", "--db", lab)
    folder = gun_campaign(tmp_path / "next", name="next")
    write_runs(
        folder,
        [{**gun_rows(1)[0], "repetition": i, "tank_pressure_bar": 0.45} for i in (1, 2, 3, 4)],
    )
    run_pyroshock("ingest", folder, "--plan", "spring-discriminate", "--db", lab, "--jobs", "1")
    assert "1 done" in plan("status", "spring-discriminate", "--db", lab).stdout


def test_shot_beyond_the_bench_is_refused_or_left_out_and_no_shot_is_a_negative_answer(
    lab: str,
) -> None:
    diagnosed(lab, NextRun("why", {"tank_pressure_bar": 30.0, "bullet_mass_kg": 1.0}, 3))
    result = plan("discriminate", "spring", "--db", lab)
    assert result.exit_code == 2 and "beyond the bench" in result.stderr
    assert plan("--db", lab, "--json").stdout.strip() == "[]"
    diagnosed(lab)
    result = plan("discriminate", "spring", "--db", lab)
    assert result.exit_code == 1
    assert (
        "names no setting that separates causes; its report says what to do next" in result.stderr
    )
    diagnosed(lab, NextRun("why", {"tank_pressure_bar": 0.45, "bullet_mass_kg": 1.5}, 3), NEXT)
    result = plan("discriminate", "spring", "--db", lab, "--json")
    assert len(json.loads(result.stdout)["runs"]) == 1
    assert "left out, beyond the bench: tank_pressure_bar 0.45, bullet_mass_kg 1.5" in result.stderr


def test_campaign_that_nobody_diagnosed_is(lab: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        diagnosing, "run_diagnosis", lambda *_, **__: verdicts.verdict(next_runs=(NEXT,))
    )
    assert plan("discriminate", "spring", "--db", lab).exit_code == 0
    assert (
        len(json.loads(pyroshock("diagnose", "spring", "--list", "--db", lab, "--json").stdout))
        == 1
    )
