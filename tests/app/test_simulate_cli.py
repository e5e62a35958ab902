"""`simulate` refuses what it cannot play, before it plays anything."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyroshock.app.plan.rehearsal import trigger_of
from pyroshock.virtualbench.gun.fire import Trigger
from support.stores.stores import pyroshock


@pytest.fixture
def url(tmp_path: Path) -> str:
    """A store with a plan of one hammer configuration left."""
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    table = tmp_path / "one.csv"
    table.write_text(
        "run,impact_position,hammer_speed,tip_material,tip_radius_mm,anvil_material,insulator,boundary_conditions\n"
        "4,#1,low,delrin,30,steel,none,free\n"
    )
    made = pyroshock("plan", "import", "p", table, "--kind", "hammer", "--repetitions", "2", "--db", url)
    assert made.exit_code == 0, made.stderr
    return url


def refused(*words: str | Path) -> str:
    result = pyroshock("simulate", *words)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1, result.stderr
    return result.stderr


@pytest.mark.parametrize(
    ("plan", "effect", "said"),
    [
        ("q", "gun.blow_by=1", "no plan 'q' in the store; there: p"),
        ("p", "gun.ghosts=1", "unknown effect 'gun.ghosts'"),
        ("p", "gun.blow_by=much", "expected NAME=STRENGTH"),
        ("p", "gun.blow_by=-1", "no sign"),
        ("p", "gun.blow_by=nan", "finite"),
    ],
)
def test_plan_or_effect_that_there_is_none_of(url, tmp_path, plan, effect, said):
    assert said in refused(plan, "--out", tmp_path / "c", "--db", url, "--effect", effect)
    assert not (tmp_path / "c").exists()


def test_folder_that_holds_something_is_left_alone_and_discarded_runs_are_not_played(url, tmp_path):
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "theirs.txt").write_text("mine")
    assert "expected a new or empty folder" in refused("p", "--out", tmp_path / "c", "--db", url)
    assert [path.name for path in (tmp_path / "c").iterdir()] == ["theirs.txt"]
    assert pyroshock("plan", "discard", "p", "4", "--reason", "broke", "--db", url).exit_code == 0
    assert "no run that is not discarded" in refused("p", "--out", tmp_path / "d", "--db", url)


@pytest.mark.slow
def test_simulated_campaign_works_its_plan_off(url, tmp_path):
    out = tmp_path / "c"
    made = pyroshock("simulate", "p", "--out", out, "--db", url, "--jobs", "1")
    assert made.exit_code == 0, made.stderr
    assert (tmp_path / "c.sealed.json").is_file()
    done = pyroshock("ingest", out, "--db", url)
    assert "2 repetitions linked, 1 runs done" in done.stderr


def test_options_say_when_the_recorder_begins():
    assert trigger_of(None, None) is None
    assert trigger_of("10%", None) == Trigger(0.1, 0.3)
    assert trigger_of("none", "500ms") == Trigger(None, 0.5)
    assert trigger_of(None, "0.2s") == Trigger(0.05, 0.2)
    for share in ("10", "0%", "x%", "100%"):
        with pytest.raises(ValueError, match=r"--trigger is .* expected a share such as 5%, or none"):
            trigger_of(share, None)
