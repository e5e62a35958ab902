"""`store.plan` as a notebook uses it: designs made, looked at and printed; a continuous one played
and ingested."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pyroshock as ps
import pytest
from matplotlib.figure import Figure
from pyroshock.doe.designs.methods import METHODS
from pyroshock.signals.units import registry

#: Categorical factors, a radius of two levels, and ranges of mass and pressure.
FEW = 'name = "few"\nkind = "gun"\n' + "".join(
    f"[[factors]]\n{factor}\n"
    for factor in (
        'name = "plate_material"\nkind = "categorical"\nlevels = ["aluminum", "steel"]\nchange = 3',
        'name = "anvil_material"\nkind = "categorical"\nlevels = ["none"]',
        'name = "insulator"\nkind = "categorical"\nlevels = ["none"]',
        'name = "tip_material"\nkind = "categorical"\nlevels = ["PLA", "steel"]',
        'name = "tip_radius"\ncolumn = "tip_radius_mm"\nkind = '
        '"numeric"\nunit = "mm"\nlevels = [30, 60]',
        'name = "bullet_mass"\ncolumn = "bullet_mass_kg"\nkind = '
        '"continuous"\nunit = "kg"\nlow = 0.2\nhigh = 1',
        'name = "tank_pressure"\ncolumn = "tank_pressure_bar"\nkind = '
        '"continuous"\nunit = "bar"\nlow = 2\nhigh = 6\n'
        "step = 0.05",
    )
)

RADII = {"tip_radius": ("30 mm", "60 mm")}
#: Limits of a range in the forms that a notebook may have.
ONE_BAR, SIX_BAR = registry().Quantity(1, "bar"), registry().Quantity(0.6, "MPa")


@pytest.fixture
def store(tmp_path: Path):
    with ps.open(tmp_path / "lab.db") as store:
        yield store


def test_plan_is_a_frame_in_si_with_units(store) -> None:
    plan = store.plan.lhs("summer", runs=24, seed=1, repetitions=3)
    frame = plan.to_frame()
    assert (plan.name, plan.method, plan.seed, len(plan), len(frame)) == (
        "summer",
        "lhs",
        1,
        24,
        24,
    )
    assert frame.attrs["units"] == {
        "tip_radius_m": "m",
        "bullet_mass_kg": "kg",
        "tank_pressure_pa": "Pa",
    }
    assert sorted(frame["tip_radius_m"].unique()) == [0.03, 0.045, 0.06]
    assert frame["tank_pressure_pa"].between(1e3, 8e5).all() and frame[
        "repetitions"
    ].unique().tolist() == [3]


def test_plan_comes_back_from_the_store(store) -> None:
    made = store.plan.lhs("summer", runs=12, seed=1)
    assert store.plan.open("summer").to_frame().equals(made.to_frame())
    assert store.plan.list()[["name", "method", "runs", "planned"]].values.tolist() == [
        ["summer", "lhs", 12, 12]
    ]
    with pytest.raises(ps.InvalidValueError, match="in the store already"):
        store.plan.lhs("summer", runs=12)
    with pytest.raises(ps.NotFoundError, match="no plan 'winter' in the store; there: summer"):
        store.plan.open("winter")


def test_quality_is_a_frame_and_a_picture(store) -> None:
    plan = store.plan.lhs("summer", runs=24, seed=1)
    quality = plan.quality()
    frame = quality.to_frame()
    assert (
        frame.loc["runs", "value"] == 24 and frame.loc["changeovers_plate_material", "value"] == 1
    )
    assert frame.loc["d_efficiency", "better"] == "more"
    axes = Figure().subplots(2)
    assert quality.plot(axes[0]) is axes[0] and plan.plot(axes[1]) is axes[1] and axes[0].images
    assert (
        axes[1].images
        and "<table" in quality._repr_html_()
        and "24 runs, lhs, seed 1" in plan._repr_html_()
    )


def test_sheet_is_text_or_a_file(store, tmp_path: Path) -> None:
    plan = store.plan.lhs("summer", runs=12, seed=1)
    rows = list(csv.DictReader(plan.sheet().splitlines()))
    assert [row["order"] for row in rows] == [str(number) for number in range(1, 13)]
    for suffix in (".csv", ".xlsx", ".html"):
        path = tmp_path / f"sheet{suffix}"
        assert plan.sheet(path) == path and path.stat().st_size > 500
    assert (tmp_path / "sheet.csv").read_text(encoding="utf-8-sig").split() == plan.sheet().split()
    with pytest.raises(ps.InvalidValueError, match=r"known: \.html, \.csv, \.xlsx"):
        plan.sheet(tmp_path / "sheet.pdf")


@pytest.mark.parametrize(
    ("low", "high"), [(1e5, 6e5), ("1 bar", "6 bar"), ("100 kPa", 6e5), (ONE_BAR, SIX_BAR)], ids=str
)
def test_limits_are_numbers_in_si_texts_and_quantities(store, low, high) -> None:
    plan = store.plan.sobol("s", runs=8, seed=1, ranges={"tank_pressure": (low, high)})
    assert (
        plan.stored.space.factors[-1].limits == pytest.approx((1, 6))
        and "velocity_level" not in plan.to_frame()
    )


def test_numbers_are_in_the_unit_of_their_column_and_aliases_are_told(store) -> None:
    ranges = {"tank_pressure_bar": (1, 6, 0.5), "tip_radius_mm": ("30 mm", "6 cm")}
    by_name = {
        f.name: f for f in store.plan.sobol("s", runs=8, seed=1, ranges=ranges).stored.space.factors
    }
    assert by_name["tank_pressure"].levels[:3] == ("1", "1.5", "2") and by_name[
        "tip_radius"
    ].limits == (30, 60)
    plan = store.plan.fractional_factorial("p", factors=FEW, generators="a b c ab ac")
    assert "bullet_mass = plate_material*tip_material" in plan.aliases()
    assert store.plan.lhs("l", runs=12, factors=FEW).aliases() == []


@pytest.mark.parametrize("value", ["5 apples", "5", "much", "nan Pa", registry().Quantity(1, "m")])
def test_limit_that_is_no_pressure_is_refused(store, value) -> None:
    with pytest.raises(ps.InvalidValueError, match=r"range of tank_pressure is .*; expected"):
        store.plan.sobol("s", runs=8, ranges={"tank_pressure": (value, "6 bar")})


@pytest.mark.parametrize(("function", "given", "method", "runs"), [
    ("lhs", {"runs": 12, "criterion": "maximin"}, "lhs criterion=maximin", 12),
    ("halton", {"runs": 10}, "halton", 10),
    ("factorial", {"levels": 2}, "factorial levels=2", 32),
    ("subset", {"reduction": 2, "levels": 2}, "subset levels=2", 16),
    ("fractional_factorial", {"resolution": 3}, "fractional-factorial resolution=3", 8),
    ("plackett_burman", {}, "plackett-burman", 8),
    ("central_composite", {"categorical": "cross", "centre": 1, "ranges": RADII}, None, 4 * 16),
    ("box_behnken", {"categorical": "cross", "ranges": RADII}, "box-behnken categorical=cross",
     4 * 15),
    ("optimal", {"runs": 8}, "optimal", 8),
])  # fmt: skip
def test_method_gives_its_design(store, function, given, method, runs) -> None:
    plan = getattr(store.plan, function)("p", factors=FEW, seed=1, **given)
    assert method in (None, plan.method) and len(plan.to_frame()) == runs


def test_table_is_a_file_or_a_frame(store, tmp_path: Path) -> None:
    import pandas as pd

    table = pd.DataFrame(
        {"run": [5, 2], "plate_material": "steel", "anvil_material": "none", "insulator": "none"}
        | {"tip_material": ["PLA", "steel"]}
        | {"tip_radius_mm": [30, 60], "bullet_mass_kg": [0.25, 0.5], "tank_pressure_bar": [2.05, 4]}
    )
    table.to_csv(tmp_path / "table.csv", index=False)
    first = store.plan.from_table("a", table=table, factors=FEW).to_frame()
    second = store.plan.from_table("b", table=tmp_path / "table.csv", factors=FEW).to_frame()
    assert first.equals(second) and first["run"].tolist() == [5, 2]
    assert first["tank_pressure_pa"].tolist() == [205_000, 400_000]


def test_contradictions_and_runs_beyond_the_bench_are_refused(store) -> None:
    both = (
        FEW + '[[factors]]\nname = "velocity_level"\nkind = "ordered"\nlevels = ["low", "high"]\n'
    )
    with pytest.raises(
        ps.InvalidValueError, match="and either tank_pressure_bar, or velocity_level"
    ):
        store.plan.lhs("p", runs=8, factors=both)
    with pytest.raises(ps.InvalidValueError, match="tank pressure 900,000 Pa, allowed 800,000"):
        store.plan.factorial("p", ranges={"tank_pressure_bar": (7, 9)}, levels=2)
    with pytest.raises(
        ps.InvalidValueError, match=r"tank_pressure_bar is 0\.001, which drives no .* out"
    ):
        store.plan.factorial("p", ranges={"tank_pressure_bar": (0.001, 5.001)}, levels=2)
    assert store.plan.list().empty
    functions = {"import": "from_table"} | {
        name: name.replace("-", "_") for name in METHODS if name != "import"
    }
    for name, function in functions.items():
        assert callable(getattr(store.plan, function)), name


def test_factors_are_a_text_or_a_file(store, tmp_path: Path) -> None:
    (tmp_path / "few.toml").write_text(FEW, encoding="utf-8")
    assert store.plan.lhs("p", runs=8, factors=tmp_path / "few.toml", seed=2).stored.factors == FEW


def test_plan_is_fired_with_the_options_of_the_command(store, tmp_path: Path, monkeypatch) -> None:
    from pyroshock.virtualbench.simulate import SimulatedCampaign
    from support.stores.stores import pyroshock

    calls = []

    def fake(rows, kind, out, *, progress, **options) -> SimulatedCampaign:
        calls.append((rows, kind, out, options))
        return SimulatedCampaign(out, out.with_suffix(".sealed.json"), 0, 0)

    monkeypatch.setattr("pyroshock.app.operations.plan.rehearsal.simulate", fake)
    plan = store.plan.lhs("summer", runs=2, seed=1, factors=FEW)
    effects = {"gun.blow_by": 3, "plate.damping": 0}
    more = {
        "echoes": True,
        "name": "b",
        "repetitions": 2,
        "trigger": 0.1,
        "pre_trigger": 0.5,
        "jobs": 2,
    }
    folder = plan.simulate(str(tmp_path / "a"), seed=3, effects=effects, **more)
    words = (
        "--effect gun.blow_by=3 --effect plate.damping=0 --echoes --name b --repetitions 2 "
        "--trigger 10% --pre-trigger 500ms --jobs 2 --seed 3"
    )
    result = pyroshock(
        "simulate", "summer", "--out", tmp_path / "a", "--db", store.url, *words.split()
    )
    assert result.exit_code == 0, result.output
    assert (
        folder == tmp_path / "a"
        and calls[0] == calls[1]
        and calls[0][3]["effects"]["gun.blow_by"] == 3
    )


@pytest.mark.slow
def test_fired_plan_is_ingested(store, tmp_path: Path) -> None:
    plan = store.plan.lhs("summer", kind="hammer", runs=2, repetitions=1, seed=1)
    folder = plan.simulate(tmp_path / "summer", seed=3, jobs=1, progress=False)
    assert (tmp_path / "summer.sealed.json").is_file() and store.ingest(
        folder, progress=False
    ).added["impacts"] == 2
    assert store.plan.open("summer").to_frame()["status"].tolist() == ["done"] * 2


@pytest.mark.parametrize(("options", "message"), [
    ({"effects": {"gun.tea": 1.0}}, "unknown effect 'gun.tea'"),
    ({"trigger": "much"}, r"^trigger is 'much'; expected a share such as 5%"),
    ({"pre_trigger": "5 kg"}, "^pre_trigger is '5 kg'; expected a unit such as 'ms'"),
    ({"repetitions": 0}, "repetitions = 0"),
])  # fmt: skip
def test_what_cannot_be_fired_is_refused(store, tmp_path: Path, options, message) -> None:
    plan = store.plan.lhs("summer", runs=2, seed=1, factors=FEW)
    with pytest.raises(ps.InvalidValueError, match=message):
        plan.simulate(tmp_path / "summer", progress=False, **options)
    assert not (tmp_path / "summer").exists()


@pytest.mark.slow
def test_continuous_plan_is_played_ingested_and_linked(store, tmp_path: Path) -> None:
    """From the factors file to recorded runs: pressures are set by hand, and still belong to their
    planned runs."""
    from pyroshock.ingest.load import ingest_folder
    from pyroshock.ingest.storing.plan_link import link_campaign

    plan = store.plan.lhs("summer", runs=3, repetitions=1, seed=1, factors=FEW)
    planned = plan.to_frame().set_index("run")
    folder = plan.simulate(tmp_path / "summer", seed=1, jobs=1, progress=False)
    with (folder / "runs.csv").open(newline="", encoding="utf-8") as file:
        played = list(csv.DictReader(file))
    set_pressures = np.array([float(row["tank_pressure_bar"]) for row in played])
    wanted = planned.loc[[int(row["run"]) for row in played], "tank_pressure_pa"].to_numpy() / 1e5
    np.testing.assert_allclose(set_pressures, wanted, rtol=0.05)
    ingest_folder(store.store, folder)
    links = link_campaign(store.store, "summer", "summer")
    recorded = store.plan.open("summer").to_frame()
    assert (
        links.mismatches == () and (recorded["recorded"] + recorded["rejected"]).tolist() == [1] * 3
    )
    assert (recorded["status"] == "done").tolist() == (recorded["recorded"] == 1).tolist()


def test_pressure_beyond_the_tolerance_is_not_linked(store, tmp_path: Path) -> None:
    from pyroshock.ingest.load import ingest_folder
    from pyroshock.ingest.storing.plan_link import link_campaign
    from support.records.campaigns import gun_campaign, write_runs

    plan = store.plan.lhs("gun", runs=4, repetitions=1, seed=1, factors=FEW)
    folder = gun_campaign(tmp_path / "gun", 1)
    rows = [
        {"run": run.run, "repetition": 1, **run.row, "measured_velocity_m_s": 9.0}
        | {"tank_pressure_bar": float(run.row["tank_pressure_bar"]) * factor}
        for run, factor in zip(plan.stored.runs, (1.0, 1.04, 0.96, 1.07), strict=True)
    ]
    write_runs(folder, rows)
    ingest_folder(store.store, folder)
    (mismatch,) = link_campaign(store.store, "gun", "gun").mismatches
    assert mismatch["run"] == plan.stored.runs[3].run and "tank_pressure is" in str(
        mismatch["reason"]
    )
    assert store.plan.open("gun").to_frame()["status"].tolist() == ["done"] * 3 + ["planned"]
