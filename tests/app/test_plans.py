"""Plans made by one function for the command line and the web, the commands of `plan`, and
`simulate`."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.app.operations.plan.quality import plan_page
from pyroshock.app.operations.plan.rehearsal import trigger_of
from pyroshock.doe.designs.methods import METHODS
from pyroshock.doe.plans import PlanExistsError, add_plan, discard_run, read_plan
from pyroshock.doe.space import gun_space, shipped_factors
from pyroshock.virtualbench.gun.fire import Trigger
from support.records.campaigns import gun_campaign, write_runs
from support.stores.planned_runs import record_run
from support.stores.stores import opened, pyroshock, refusal, run_pyroshock


# --- plans made by one function for the command line and the web, and what a page shows of their
# quality ------------
@pytest.fixture
def store(tmp_path):
    with opened(f"sqlite:///{tmp_path / 'lab.db'}", create=True) as store:
        yield store


def read(store, name):
    with store.reading() as session:
        return read_plan(session, name)


def test_same_seed_makes_the_same_plan_and_a_factorial_has_every_treatment(store):
    first, second = (
        make_plan(store, "lhs", name, runs=12, repetitions=2, seed=7) for name in ("a", "b")
    )
    assert [run.row for run in first.runs] == [run.row for run in second.runs]
    assert (len(first.runs), first.method, first.seed, first.runs[0].repetitions) == (
        12,
        "lhs",
        7,
        2,
    )
    assert all(run.settings["tank_pressure_bar"] > 0 for run in first.runs)
    drawn = make_plan(store, "lhs", "drawn", runs=12)
    again = make_plan(store, "lhs", "again", runs=12, seed=drawn.seed)
    assert [run.row for run in drawn.runs] == [run.row for run in again.runs]
    made = make_plan(store, "factorial", "h", kind="hammer", seed=1)
    assert (
        len({json.dumps(dict(run.row)) for run in made.runs})
        == len(made.runs)
        == made.space.size
        == 180
    )


@pytest.mark.parametrize(("method", "own", "said"), [
    ("magic", {}, f"method is 'magic'; expected one of {', '.join(METHODS)}"),
    ("lhs", {}, "runs is None; expected 1 or more"),
    ("lhs", {"runs": 3, "seed": -1}, "seed is -1; expected 0 or more"),
    ("lhs", {"runs": 3, "repetitions": 0}, "repetitions is 0; expected 1 or more"),
    ("lhs", {"runs": 3, "kind": "sling"}, "kind is 'sling'; expected one of hammer, gun"),
    ("import", {}, "no table to import"),
    ("lhs", {"runs": 3, "options": {"face": "ccf"}},
     "unknown option 'face'; the method has: criterion"),
    ("lhs", {"runs": 3, "ranges": {"humidity": (1, 2)}}, "no factor 'humidity'"),
    ("plackett-burman", {}, "anvil_material\\+insulator has 5 levels without order"),
])  # fmt: skip
def test_what_cannot_be_planned_stores_nothing(store, method, own, said):
    with pytest.raises(ValueError, match=said):
        make_plan(store, method, "a", **own)
    with pytest.raises(ValueError, match="the plan has no name"):
        make_plan(store, "lhs", " ", runs=3)
    with pytest.raises(LookupError, match="no plan 'a'"):
        read(store, "a")


def test_page_counts_levels_changes_and_states_or_is_empty(store):
    """Two treatments that differ in the tip alone, fired a a b: one change of tip, no other."""
    space = gun_space()
    treatments = space.all_treatments()
    tips = [axis.name for axis in space.axes].index("tip_material")
    alike = treatments[
        (treatments == treatments[0])[:, [i for i in range(treatments.shape[1]) if i != tips]].all(
            1
        )
    ]
    from pyroshock.doe.designs.base import Design

    add_plan(
        store, "p", shipped_factors("gun"), Design(space, alike[[0, 0, 1]], "lhs", 1), repetitions=1
    )
    record_run(store, "p", 1)
    page = plan_page(read(store, "p"))
    assert page["counts"] == {"planned": 2, "done": 1, "discarded": 0, "begun": 0, "repeat": 0}
    assert {
        changes["factor"]: changes["changes"] for changes in page["changes"] if changes["changes"]
    } == {"tip_material": 1}
    levels = next(
        axis_levels for axis_levels in page["levels"] if axis_levels["axis"] == "tip_material"
    )
    assert [level["runs"] for level in levels["levels"]] == [2, 1, 0] and levels["share"] == 1.0
    # of positions -1, 0, 1 the levels' means are -0.5 and 1: between groups 2 * 0.25 + 1 of 2
    assert next(
        share_row["share"] for share_row in page["time"] if share_row["axis"] == "tip_material"
    ) == pytest.approx(0.75)
    runs = next(figure for figure in page["figures"] if figure["name"] == "runs")
    assert (runs["value"], runs["text"], runs["better"]) == (3, "3", "neither")
    json.dumps(page, allow_nan=False)
    make_plan(store, "lhs", "a", runs=1, seed=1)
    with pytest.raises(PlanExistsError, match="'a' is in the store already"):
        make_plan(store, "lhs", "a", runs=4, seed=1)
    assert len(read(store, "a").runs) == 1
    json.dumps(plan_page(read(store, "a")), allow_nan=False)
    discard_run(store, "a", 1, "tip broke")
    page = plan_page(read(store, "a"))
    assert page["counts"] == {"planned": 0, "done": 0, "discarded": 1, "begun": 0, "repeat": 0}
    assert page["verdict"] is None and not any(
        value for name, value in page.items() if name != "counts"
    )


# --- the commands of `plan`, as a laboratory uses them ---
COLUMNS = (
    "run", "plate_material", "anvil_material", "insulator", "tip_material", "tip_radius_mm",
    "bullet_mass_kg",
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
    return run_pyroshock("plan", *words)


def as_json(*words: str | Path):
    return json.loads(done(*words, "--json").stdout)


def test_imported_table_goes_out_as_it_came_with_pressures_for_velocity_levels(url, tmp_path):
    given = table(tmp_path / "in.csv")
    done("import", "thesis", given, "--db", url, "--out", tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text() == given.read_text().replace("\r\n", "\n")
    runs = as_json("import", "p", table(tmp_path / "in.csv"), "--db", url)["runs"]
    first = runs[0]
    assert (first["run"], first["position"], first["status"], first["repetitions"]) == (
        7,
        1,
        "planned",
        10,
    )
    assert first["tip_radius_m"] == 0.03
    pressures = {run["bullet_mass_kg"]: run["tank_pressure_pa"] for run in runs}
    from pyroshock.app.operations.plan.planning import gun_bench
    from pyroshock.twin.gun.nominal import muzzle_velocity

    fired = {
        mass: float(muzzle_velocity(gun_bench(None), p, mass)) for mass, p in pressures.items()
    }
    assert fired == pytest.approx({0.2: 7.0, 0.5: 22.0, 1.0: 14.0}, rel=1e-3)


def test_run_beyond_the_bench_is_refused_and_a_lab_adds_its_own_factor(url, tmp_path):
    factors = tmp_path / "factors.toml"
    from pyroshock.doe.space import shipped_factors

    factors.write_text(
        shipped_factors("gun").replace("values = [7, 14, 22]", "values = [7, 14, 90]")
    )
    result = plan("import", "p", table(tmp_path / "in.csv"), "--db", url, "--factors", factors)
    assert result.exit_code == 2 and "run 3" in result.stderr and "m/s" in result.stderr
    assert as_json("--db", url) == []
    from pyroshock.doe.space import shipped_factors

    factors = tmp_path / "factors.toml"
    operator = 'name = "operator"\nkind = "categorical"\nlevels = ["Ada", "Emil"]\n'
    factors.write_text(f"{shipped_factors('hammer')}\n[[factors]]\n{operator}")
    runs = as_json("factorial", "p", "--db", url, "--factors", factors, "--seed", "1")["runs"]
    assert len(runs) == 360 and {run["operator"] for run in runs} == {"Ada", "Emil"}
    assert "no plan 'spring'" in refusal(
        "ingest", gun_campaign(tmp_path / "g", 1), "--db", url, "--plan", "spring"
    )


def test_pressure_over_its_range_is_a_factor(url, tmp_path):
    made = as_json(
        "lhs",
        "p",
        "--runs",
        "10",
        "--range",
        "tank_pressure_bar=1:6:0.1",
        "--seed",
        "1",
        "--db",
        url,
    )
    pressures = sorted(run["tank_pressure_pa"] for run in made["runs"])
    assert [int(pressure // 5.001e4) for pressure in pressures] == sorted(
        {int(p // 5.001e4) for p in pressures}
    )
    assert 1e5 <= pressures[0] < 1.5e5 and 5.5e5 < pressures[-1] <= 6e5
    assert not any("velocity_level" in run for run in made["runs"])
    out = tmp_path / "out.csv"
    ranges = ("--range", "tank_pressure_bar=1:6:0.1")
    done("lhs", "q", "--runs", "10", *ranges, "--seed", "1", "--db", url, "--out", out)
    done("import", "r", out, *ranges, "--db", url)
    assert "better" in done("quality", "r", "--against", "q", "--db", url).stdout
    assert "1 to 2" in done("quality", "r", "--db", url).stdout


@pytest.mark.parametrize(
    "text", ["tank_pressure_bar", "tank_pressure_bar=low:high", "tank_pressure_bar=1"]
)
def test_range_that_is_none_is_refused(url, text):
    result = plan("lhs", "p", "--runs", "10", "--range", text, "--db", url)
    assert result.exit_code == 2 and "tank_pressure_bar" in result.stderr


def test_aliases_of_a_screening_plan_are_told(url):
    given = ("--generators", "a b c d abc abd", "--categorical", "first-last", "--db", url)
    result = done("fractional-factorial", "p", *given)
    assert (
        "aliased: plate_material*tip_radius = " in result.stderr
        and "generators=a b c d abc abd" in result.stderr
    )
    refused = plan("fractional-factorial", "q", "--db", url)
    assert refused.exit_code == 2 and "(anvil_material+insulator)" in result.stderr
    assert "categorical=first-last" in refused.stderr


def test_recorded_campaign_works_the_plan_off(url, tmp_path):
    done("import", "gun", table(tmp_path / "in.csv"), "--db", url, "--repetitions", "1")
    runs, folder = as_json("status", "gun", "--db", url)["runs"], gun_campaign(tmp_path / "g", 1)
    keys = (
        "run",
        "plate_material",
        "anvil_material",
        "insulator",
        "tip_material",
        "bullet_mass_kg",
    )
    rows = [
        {key: run[key] for key in keys} | {"repetition": 1,
        "tip_radius_mm": 1e3 * run["tip_radius_m"]}
        | {"tank_pressure_bar": run["tank_pressure_pa"] * 1.01e-5, "measured_velocity_m_s": 9.0}
        for run in runs
    ]  # fmt: skip
    rows[1]["tip_material"] = "steel"
    write_runs(folder, rows)
    result = pyroshock("ingest", folder, "--db", url, "--json")
    assert [f["message"] for f in json.loads(result.stdout)["findings"]] == [
        "run 3 of plan gun: tip_material is steel, planned PLA"
    ]
    state = {run["run"]: run["status"] for run in as_json("status", "gun", "--db", url)["runs"]}
    assert state == {7: "done", 3: "planned", 9: "done"}
    assert "2 done, 1 to do (0 begun), 0 discarded" in done("status", "gun", "--db", url).stdout


def test_added_runs_are_repeated_as_the_plans(url, tmp_path):
    done("import", "p", table(tmp_path / "in.csv"), "--repetitions", "4", "--db", url)
    result = plan("augment", "p", "--db", url)
    assert result.exit_code == 2 and "--runs is missing, and" in result.stderr
    done("augment", "p", "--runs", "1", "--db", url)
    done("augment", "p", "--runs", "1", "--repetitions", "2", "--db", url)
    with opened(url) as store, store.reading() as session:
        assert [run.repetitions for run in read_plan(session, "p").runs] == [4, 4, 4, 4, 2]


def test_plans_are_listed_and_a_discarded_run_leaves_the_table(url, tmp_path):
    done("import", "p", table(tmp_path / "in.csv"), "--db", url)
    (row,) = as_json("--db", url)
    assert (row["name"], row["kind"], row["method"], row["runs"], row["planned"]) == (
        "p",
        "gun",
        "import",
        3,
        3,
    )
    done("discard", "p", "3", "--reason", "tip broke", "--db", url)
    done("sheet", "p", "--out", tmp_path / "s.html", "--db", url)
    assert "tip broke" in (tmp_path / "s.html").read_text(encoding="utf-8")
    cell = as_json("status", "p", "--db", url)["runs"][0]["tip_radius_m"]
    for unit, scale in (("mm", 1e3), ("m", 1.0)):
        words = ("status", "p", "--db", url, *(() if unit == "mm" else ("--units", "si")))
        _, header, first, *_ = (re.split(r"  +", line) for line in done(*words).stdout.splitlines())
        assert float(first[header.index(f"tip radius ({unit})")]) == pytest.approx(scale * cell)
    assert as_json("--db", url)[0]["discarded"] == 1


# --- `simulate` refuses what it cannot play, before it plays anything ---
@pytest.fixture
def planned_url(tmp_path: Path) -> str:
    """A store with a plan of one hammer configuration left."""
    planned_url, table = f"sqlite:///{tmp_path / 'lab.db'}", tmp_path / "one.csv"
    table.write_text(
        "run,impact_position,hammer_speed,tip_material,tip_radius_mm,anvil_material,insulator,"
        "boundary_conditions\n"
        "4,#1,low,delrin,30,steel,none,free\n"
    )
    run_pyroshock(
        "plan", "import", "p", table, "--kind", "hammer", "--repetitions", "2", "--db", planned_url
    )
    return planned_url


def refused_simulation(*words: str | Path) -> str:
    result = pyroshock("simulate", *words)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1, result.stderr
    return result.stderr


@pytest.mark.parametrize(("plan", "effect", "said"), [
    ("q", "gun.blow_by=1", "no plan 'q' in the store; there: p"),
    ("p", "gun.ghosts=1", "unknown effect 'gun.ghosts'"),
    ("p", "gun.blow_by=much", "expected NAME=STRENGTH"),
    ("p", "gun.blow_by=-1", "no sign"),
    ("p", "gun.blow_by=nan", "finite"),
])  # fmt: skip
def test_plan_or_effect_that_there_is_none_of(planned_url, tmp_path, plan, effect, said):
    assert said in refused_simulation(
        plan, "--out", tmp_path / "c", "--db", planned_url, "--effect", effect
    )
    assert not (tmp_path / "c").exists()


def test_folder_that_holds_something_is_left_alone_and_options_say_when_the_recorder_begins(
    planned_url, tmp_path
):
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "theirs.txt").write_text("mine")
    assert "expected a new or empty folder" in refused_simulation(
        "p", "--out", tmp_path / "c", "--db", planned_url
    )
    assert [path.name for path in (tmp_path / "c").iterdir()] == ["theirs.txt"]
    assert (
        pyroshock("plan", "discard", "p", "4", "--reason", "broke", "--db", planned_url).exit_code
        == 0
    )
    assert "no run that is not discarded" in refused_simulation(
        "p", "--out", tmp_path / "d", "--db", planned_url
    )
    assert trigger_of(None, None) is None and trigger_of("10%", None) == Trigger(0.1, 0.3)
    assert trigger_of("none", "500ms") == Trigger(None, 0.5) and trigger_of(
        None, "0.2s"
    ) == Trigger(0.05, 0.2)
    for share in ("10", "0%", "x%", "100%"):
        with pytest.raises(
            ValueError, match=r"--trigger is .* expected a share such as 5%, or none"
        ):
            trigger_of(share, None)


@pytest.mark.slow
def test_simulated_campaign_works_its_plan_off(planned_url, tmp_path):
    out = tmp_path / "c"
    run_pyroshock("simulate", "p", "--out", out, "--db", planned_url, "--jobs", "1")
    assert (tmp_path / "c.sealed.json").is_file()
    assert (
        "2 repetitions linked, 1 runs done" in pyroshock("ingest", out, "--db", planned_url).stderr
    )
