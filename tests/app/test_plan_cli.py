"""The commands of `plan`, as a laboratory uses them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from pyroshock.doe.plans import read_plan
from support.records.campaigns import gun_campaign, write_runs
from support.stores.stores import opened, pyroshock

COLUMNS = (
    "run", "plate_material", "anvil_material", "insulator", "tip_material", "tip_radius_mm", "bullet_mass_kg",
    "velocity_level",
)  # fmt: skip
ROWS = [
    dict(zip(COLUMNS, cells, strict=True))
    for cells in (
        (7, "aluminum", "none", "none", "steel", 30, 0.2, "low"),
        (3, "aluminum", "steel", "polymeric", "PLA", 45, 0.5, "high"),
        (9, "steel", "aluminum", "none", "aluminum", 60, 1, "medium"),
    )
]


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'lab.db'}"


def table(path: Path, rows=ROWS) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    return path


def plan(*words: str | Path):
    return pyroshock("plan", *words)


def done(*words: str | Path):
    result = plan(*words)
    assert result.exit_code == 0, result.stderr
    return result


def as_json(*words: str | Path):
    return json.loads(done(*words, "--json").stdout)


def test_imported_table_goes_out_as_it_came(url, tmp_path):
    given = table(tmp_path / "in.csv")
    done("import", "thesis", given, "--db", url, "--out", tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text() == given.read_text().replace("\r\n", "\n")


def test_velocity_levels_become_pressures_for_each_mass(url, tmp_path):
    runs = as_json("import", "p", table(tmp_path / "in.csv"), "--db", url)["runs"]
    pressures = {run["bullet_mass_kg"]: run["tank_pressure_pa"] for run in runs}
    from pyroshock.app.plan.planning import gun_bench
    from pyroshock.twin.gun.nominal import muzzle_velocity

    fired = {mass: float(muzzle_velocity(gun_bench(None), p, mass)) for mass, p in pressures.items()}
    assert fired == pytest.approx({0.2: 7.0, 0.5: 22.0, 1.0: 14.0}, rel=1e-3)


def test_json_is_in_si(url, tmp_path):
    run = as_json("import", "p", table(tmp_path / "in.csv"), "--db", url)["runs"][0]
    assert (run["run"], run["position"], run["status"], run["repetitions"]) == (7, 1, "planned", 10)
    assert run["tip_radius_m"] == 0.03


def test_run_beyond_the_bench_is_refused_with_its_number(url, tmp_path):
    factors = tmp_path / "factors.toml"
    from pyroshock.doe.space import shipped_factors

    factors.write_text(shipped_factors("gun").replace("values = [7, 14, 22]", "values = [7, 14, 90]"))
    result = plan("import", "p", table(tmp_path / "in.csv"), "--db", url, "--factors", factors)
    assert result.exit_code == 2
    assert "run 3" in result.stderr and "m/s" in result.stderr
    assert as_json("--db", url) == []


def test_lab_adds_its_own_factor(url, tmp_path):
    from pyroshock.doe.space import shipped_factors

    factors = tmp_path / "factors.toml"
    factors.write_text(shipped_factors("hammer") + '\n[[factors]]\nname = "operator"\nkind = "categorical"\n'
                       'levels = ["Ada", "Emil"]\n')  # fmt: skip
    runs = as_json("factorial", "p", "--db", url, "--factors", factors, "--seed", "1")["runs"]
    assert len(runs) == 360
    assert {run["operator"] for run in runs} == {"Ada", "Emil"}


def test_pressure_over_its_range_is_a_factor(url, tmp_path):
    made = as_json("lhs", "p", "--runs", "10", "--range", "tank_pressure_bar=1:6:0.1", "--seed", "1", "--db", url)
    pressures = sorted(run["tank_pressure_pa"] for run in made["runs"])
    assert [int(pressure // 5.001e4) for pressure in pressures] == sorted({int(p // 5.001e4) for p in pressures})
    assert 1e5 <= pressures[0] < 1.5e5 and 5.5e5 < pressures[-1] <= 6e5
    assert not any("velocity_level" in run for run in made["runs"])
    out = tmp_path / "out.csv"
    ranges = ("--range", "tank_pressure_bar=1:6:0.1")
    done("lhs", "q", "--runs", "10", *ranges, "--seed", "1", "--db", url, "--out", out)
    done("import", "r", out, *ranges, "--db", url)
    assert "better" in done("quality", "r", "--against", "q", "--db", url).stdout
    assert "1 to 2" in done("quality", "r", "--db", url).stdout


@pytest.mark.parametrize("text", ["tank_pressure_bar", "tank_pressure_bar=low:high", "tank_pressure_bar=1"])
def test_range_that_is_none_is_refused(url, text):
    result = plan("lhs", "p", "--runs", "10", "--range", text, "--db", url)
    assert result.exit_code == 2
    assert "tank_pressure_bar" in result.stderr


def test_aliases_of_a_screening_plan_are_told(url):
    given = ("--generators", "a b c d abc abd", "--categorical", "first-last", "--db", url)
    result = done("fractional-factorial", "p", *given)
    assert "aliased: plate_material*tip_radius = " in result.stderr
    assert "generators=a b c d abc abd" in result.stderr
    refused = plan("fractional-factorial", "q", "--db", url)
    assert refused.exit_code == 2
    assert "(anvil_material+insulator)" in result.stderr
    assert "categorical=first-last" in refused.stderr


def test_hammer_factorial_has_180_configurations(url):
    made = as_json("factorial", "h", "--db", url, "--kind", "hammer", "--seed", "3")
    treatments = {json.dumps({k: v for k, v in run.items() if k not in ("run", "position")}) for run in made["runs"]}
    assert (len(made["runs"]), len(treatments), made["seed"]) == (180, 180, 3)


def test_recorded_campaign_works_the_plan_off(url, tmp_path):
    done("import", "gun", table(tmp_path / "in.csv"), "--db", url, "--repetitions", "1")
    runs = as_json("status", "gun", "--db", url)["runs"]
    folder = gun_campaign(tmp_path / "g", 1)
    keys = ("run", "plate_material", "anvil_material", "insulator", "tip_material")
    rows = [
        {key: run[key] for key in keys}
        | {
            "repetition": 1,
            "tip_radius_mm": 1e3 * run["tip_radius_m"],
            "bullet_mass_kg": run["bullet_mass_kg"],
            "tank_pressure_bar": run["tank_pressure_pa"] * 1.01e-5,
            "measured_velocity_m_s": 9.0,
        }
        for run in runs
    ]
    rows[1]["tip_material"] = "steel"
    write_runs(folder, rows)
    result = pyroshock("ingest", folder, "--db", url, "--json")
    assert [f["message"] for f in json.loads(result.stdout)["findings"]] == [
        "run 3 of plan gun: tip_material is steel, planned PLA"
    ]
    state = {run["run"]: run["status"] for run in as_json("status", "gun", "--db", url)["runs"]}
    assert state == {7: "done", 3: "planned", 9: "done"}
    assert "2 done, 1 to do (0 begun), 0 discarded" in done("status", "gun", "--db", url).stdout


def test_unknown_plan_of_an_ingest_is_named(url, tmp_path):
    result = pyroshock("ingest", gun_campaign(tmp_path / "g", 1), "--db", url, "--plan", "spring")
    assert result.exit_code == 2
    assert "no plan 'spring'" in result.stderr


def test_discarded_run_leaves_the_table(url, tmp_path):
    done("import", "p", table(tmp_path / "in.csv"), "--db", url)
    done("discard", "p", "3", "--reason", "tip broke", "--db", url)
    done("sheet", "p", "--out", tmp_path / "s.html", "--db", url)
    assert "tip broke" in (tmp_path / "s.html").read_text(encoding="utf-8")
    assert as_json("--db", url)[0]["discarded"] == 1


def test_nothing_to_replace_is_said(url, tmp_path):
    done("import", "p", table(tmp_path / "in.csv"), "--db", url)
    result = plan("augment", "p", "--db", url)
    assert result.exit_code == 2 and "--runs N" in result.stderr


def test_added_runs_are_repeated_as_the_plans(url, tmp_path):
    done("import", "p", table(tmp_path / "in.csv"), "--repetitions", "4", "--db", url)
    done("augment", "p", "--runs", "1", "--db", url)
    done("augment", "p", "--runs", "1", "--repetitions", "2", "--db", url)
    with opened(url) as store, store.reading() as session:
        assert [run.repetitions for run in read_plan(session, "p").runs] == [4, 4, 4, 4, 2]


def test_plans_are_listed(url, tmp_path):
    done("import", "p", table(tmp_path / "in.csv"), "--db", url)
    (row,) = as_json("--db", url)
    assert (row["name"], row["kind"], row["method"], row["runs"], row["planned"]) == ("p", "gun", "import", 3, 3)
