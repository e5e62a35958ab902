"""`predict` of one shot and of many: the JSON that scripts rely on, and one line for what a user
can mend."""

from __future__ import annotations

import csv
import json
import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result
from pyroshock.app.demo.demo import ingest_examples
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.doors.command_line.operation_command import command_of
from pyroshock.app.operations.predict.batch import assumed, rows_of_file
from pyroshock.app.operations.predict.predict import PREDICT
from pyroshock.app.operations.predict.request import parse_effect
from pyroshock.app.twins import building as twins
from pyroshock.dataset.domain import Domain
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.registry.records import Cost, DatasetName, RegisteredModel, Version
from pyroshock.twin.gun.nominal import muzzle_velocity
from support.records.pulse_tables import PREDICTORS, pulse_table
from support.records.twin_parts import BENCH, unsolved
from support.stores.stores import opened

predict = command_of(PREDICT)
MODES = """mode,frequency_hz,damping_ratio,shape_impact,shape_impact_2,shape_a
1,400,0.01,0.3,0.1,0.4
2,1500,0.01,-0.2,0.3,0.3
"""


@pytest.fixture
def quick(quick_twins):
    return lambda *words: CliRunner().invoke(predict, [*words, *_FEW])


_FEW = ("--draws", "8", "--frequencies", "200:4000:3")


def told(result: Result) -> dict:  # JSON
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def test_json_of_the_shipped_bench_is_the_contract(quick):
    found = told(
        quick("--tank-pressure", "5bar", "--bullet-mass", "0.5kg", "--tip", "steel", "--json")
    )
    contract = {
        "velocity_m_s",
        "contact_time_s",
        "peak_force_n",
        "force",
        "srs",
        "models",
        "outside_domain",
    }
    assert contract <= found.keys()
    for name in ("velocity_m_s", "contact_time_s", "peak_force_n"):
        assert found[name].keys() == {"mean", "ci90"}
        assert found[name]["ci90"][0] <= found[name]["mean"] <= found[name]["ci90"][1]
    assert (
        found["force"].keys() == {"time_s", "mean", "lower", "upper"}
        and found["srs"]["frequency_hz"][0] == 200.0
    )
    assert found["srs"]["acceleration_2"].keys() == {"mean", "lower", "upper"}
    assert found["models"]["contact"] == "prior of 4 effects"
    for one in found["outside_domain"]:
        assert one.keys() == {"predictor", "value", "range"}
    found = told(quick("--tank-pressure", "5bar", "--json"))
    low, high = found["velocity_m_s"]["ci90"]
    assert low < float(muzzle_velocity(BENCH, 5e5, 0.5)) < high
    assert "shipped" in found["models"]["gun"] and "assumed outline" in found["models"]["plate"]


def test_given_velocity_needs_no_gun_and_words_and_plot_are_for_people(quick, tmp_path):
    prediction = told(quick("--velocity", "8m/s", "--json"))
    assert prediction["velocity_m_s"] == {
        "mean": pytest.approx(8.0),
        "ci90": pytest.approx([8.0, 8.0]),
    }
    assert (
        quick("--json").stdout
        == quick("--json", "--seed", "0").stdout
        != quick("--json", "--seed", "1").stdout
    )
    result = quick("--velocity", "8m/s", "--plot", "shot.png")
    assert result.exit_code == 0, result.stderr
    assert "impact velocity" in result.stdout and "acceleration_1 (g)" in result.stdout
    assert (tmp_path / "shot.png").read_bytes().startswith(b"\x89PNG")


def test_effects_change_the_answer_and_what_lies_outside_is_told(quick):
    nominal = told(quick("--tank-pressure", "5bar", "--json"))
    found = told(quick("--tank-pressure", "5bar", "--effect", "gun.back_pressure", "--effect",
                       "sensor.velocity_gain:gain=2", "--json"))  # fmt: skip
    assert found["velocity_m_s"]["mean"] != pytest.approx(
        2 * nominal["velocity_m_s"]["mean"], rel=1e-3
    )
    assert (
        "gun.back_pressure" in found["models"]["gun"]
        and "sensor.velocity_gain" in found["models"]["sensors"]
    )
    result = quick("--tank-pressure", "20bar", "--tip", "steel", "--contact", "hertz")
    assert result.exit_code == 0
    (line,) = [
        stderr_line
        for stderr_line in result.stderr.splitlines()
        if "outside of the domain" in stderr_line
    ]
    where = r"lies outside of the domain of the contact \(hertz\)"
    assert re.fullmatch(rf"Impact velocity \d{{2}}\.\d{{2}} m/s {where}: up to .*yield\.", line)


@pytest.mark.parametrize(
    ("law", "label"), [((), "prior of 4 effects"), (("--contact", "hertz"), "hertz")]
)
def test_effect_of_the_contact_acts_on_the_prior_and_on_hertz(quick, law, label):
    effect = "contact.effective_mass:mass_factor=2"
    found = told(quick("--velocity", "8m/s", "--effect", effect, "--json", *law))
    assert found["models"]["contact"] == f"{label} + contact.effective_mass"


@pytest.mark.parametrize("law", ["prior", "hertz"])
def test_coupled_contact_meets_the_plate(quick, law):
    """On both the plate takes force away that a rigid target, or one without edges, gives back."""
    words = ("--velocity", "8m/s", "--tip", "delrin", "--contact", law, "--json")
    alone, coupled = told(quick(*words)), told(quick(*words, "--coupled"))
    assert coupled["models"]["contact"] == alone["models"]["contact"] + " + modes of the plate"
    assert coupled["peak_force_n"]["mean"] != alone["peak_force_n"]["mean"]
    assert 0 < coupled["impulse_n_s"]["mean"] <= 2 * 0.5 * 8
    assert (told(quick(*words[:4], "--coupled", "--json")) == coupled) is (
        law == "prior"
    )  # without a law


def test_bench_points_and_modal_table_of_files_are_taken(quick, tmp_path):
    (tmp_path / "bench.toml").write_text(
        "[plate]\nmaterial = 'steel'\nthickness_m = 0.012\noutline_m = "
        "[[0,0],[0.6,0],[0.6,0.4],[0,0.4]]\n"
        "sensors = {left = [0.1, 0.1], right = [0.5, 0.3]}\n",
        encoding="utf-8",
    )
    found = told(quick("--velocity", "8m/s", "--bench", "bench.toml", "--json"))
    assert {"left", "right"} < found["srs"].keys() and "bench.toml" in found["models"]["plate"]
    places = "--sensor-at 0.2,0.2 --sensor-at 0.7,0.4 --impact-at 0.4,0.3"
    result = quick("--velocity", "8m/s", *places.split())
    assert "#1 (0.4, 0.3), acceleration_1 (0.2, 0.2)" in result.stderr
    (tmp_path / "plate_modes.csv").write_text(MODES, encoding="utf-8")
    found = told(
        quick(
            "--velocity", "8m/s", "--modes", "plate_modes.csv", "--impact-position", "#2", "--json"
        )
    )
    assert found["models"]["plate"] == "modal table plate_modes.csv" and "a" in found["srs"]


def test_campaign_gives_its_gun_and_the_scatter_of_its_shots(quick, tmp_path):
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    with opened(url, create=True) as store:
        ingest_examples(store)
    result = quick("--tank-pressure", "3bar", "--campaign", "first-shots", "--db", url)
    assert (
        "The velocity rests on 5 measured shots, 0.232 to 0.616 bar and 0.143 kg" in result.stderr
    )
    found = told(quick("--tank-pressure", "3bar", "--tip", "Aluminium", "--db", url, "--json"))
    assert "campaign first-shots" in found["models"]["gun"]


def test_scatter_is_that_of_the_five_shots_and_effects_are_parsed():
    with (Path(twins.__file__).parents[2] / "examples" / "first-shots" / "table_5_1.csv").open(
        encoding="utf-8"
    ) as file:
        errors = np.array([float(row["error_percent"]) for row in csv.DictReader(file)]) / 100
    assert np.sqrt(np.mean(np.log(1 - errors) ** 2)) == pytest.approx(
        twins.THESIS_VELOCITY_SPREAD, abs=6e-4
    )
    parsed = parse_effect("sensor.zero_shift:share=0.02,decay_time_s=0.1", "--effect")
    assert parsed.as_json() == {"id": "sensor.zero_shift", "share": 0.02, "decay_time_s": 0.1}
    result = CliRunner().invoke(predict, ["--frequencies", "1:2:3:4"])
    assert (
        result.exit_code == 2
        and "expected Hz as 100,200,500 or low:high:per_octave" in result.stderr
    )


def test_model_in_use_answers(quick, monkeypatch):
    table = pulse_table(np.random.default_rng(0), repetitions=2)
    dataset, when = (
        DatasetName("spring", "5" * 64, "hammer", "gun"),
        datetime(2026, 1, 1, tzinfo=UTC),
    )
    ids = ("key", "run", "0" * 64)
    version = Version(
        "hertz", 4, dataset, "repetitions", 0, {}, Cost(1.0, 1.0), *ids, when, "hammer"
    )
    model = Analytic("hertz").fit(table, np.random.default_rng(0))

    class Registry:
        def versions(self) -> list[Version]:
            return [version]

        def load(self, version: Version) -> RegisteredModel:
            return RegisteredModel(version, model, PREDICTORS, Domain.of(table), {})

    monkeypatch.setattr(twins, "_registry", lambda _: Registry())
    for asked in ((), ("--contact", "registered"), ("--contact", "hertz@4")):
        found = told(
            quick("--velocity", "9m/s", "--tip", "delrin", "--tip-radius", "30mm", *asked, "--json")
        )
        assert found["models"]["contact"] == "models:/hertz@champion"
    assert found["outside_domain"][0]["predictor"] == "impact_velocity"


def test_solved_plate_end_to_end(tmp_path, monkeypatch):
    """The finite element model itself, with its modes below 600 Hz; the second call finds it on
    disk."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(twins, "MAX_MODE_HZ", 600.0)
    first, again = (
        told(CliRunner().invoke(predict, ["--velocity", "8m/s", "--json", *_FEW])) for _ in range(2)
    )
    assert first == again and list(Path(tmp_path).rglob("*.npz"))


@pytest.mark.parametrize(("words", "message"), [
    (
        ("--coupled", "--contact", "hunter"),
        "--coupled with the contact 'hunter', which is not solved in time: expected --contact",
    ),
    (("--tank-pressure", "5"),
     "--tank-pressure is '5'; expected a number with a unit: did you mean 5bar?"),
    (("--tank-pressure", "5bar", "--velocity", "3m/s"),
     "--velocity and --tank-pressure: expected one of them"),
    (("--tip", "cheese"), "no material 'cheese'; there are: aluminum"),
    (("--insulator", "polymeric"), "without an anvil"),
    (("--contact", "magic"), "no law of contact 'magic'"),
    (("--contact", "registered"), "no model is in use for the gun; make one so: pyroshock promote"),
    (("--effect", "gun.magic"), "no effect 'gun.magic'"),
    (("--effect", "sensor.force_gain:gain=loud"), "expected NAME=VALUE in SI"),
    (("--effect", "sensor.force_gain:gain=99"),
     "sensor.force_gain: gain = 99.0; expected 0.2 to 5"),
    (("--sensor-at", "here"), "--sensor-at is 'here'; expected two numbers in m, such as"),
    (("--impact-position", "#7"), "no impact position '#7' on this plate"),
    (("--campaign", "spring"), "no campaign 'spring'"),
    (("--modes", "none.csv"), "none.csv"),
    (("--tank-pressure", "1Pa"), "does not leave the barrel"),
    (("--plot", "shot.xyz"), "cannot draw 'shot.xyz'"),
])  # fmt: skip
def test_what_a_user_can_mend_is_one_line(quick, words, message):
    result = quick(*words)
    assert result.exit_code == 2 and message in result.stderr.strip().splitlines()[-1]


@pytest.mark.parametrize(("words", "message"), [
    (("--tip", "cheese"), "no material 'cheese'"),
    (("--anvil", "cheese"), "no material 'cheese'"),
    (("--plate", "cheese"), "no material 'cheese'"),
    (("--insulator", "polymeric"), "--insulator is 'polymeric' without an anvil"),
    (("--impact-position", "#4"), "no impact position '#4' on this plate; there are: #1, #2, #3"),
    (("--impact-position", "#2", "--impact-at", "0.2,0.3"), "there are: #1"),
    (("--chain-height", "100mm"), "chain height 100 mm: expected a multiple of 56"),
    (("--plan", "none"), "no plan 'none' in the store"),
    (("--campaign", "spring"), "no campaign 'spring'"),
])  # fmt: skip
def test_what_there_is_not_is_refused_before_a_plate_is_solved(quick, monkeypatch, words, message):
    def solved(*_):
        raise AssertionError("a plate was solved")

    monkeypatch.setattr(twins, "solved", solved)
    result = quick(*words)
    assert result.exit_code == 2 and message in result.stderr.strip().splitlines()[-1]


def test_sensors_of_the_shipped_bench_feel_different_things(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = told(
        CliRunner().invoke(
            predict, ["--velocity", "8m/s", "--json", "--frequencies", "100:200:3", *_FEW[:2]]
        )
    )
    assert found["srs"]["acceleration_1"]["mean"] != pytest.approx(
        found["srs"]["acceleration_2"]["mean"], rel=0.01
    )


def test_valve_profile_is_the_gun_s_and_may_stand_in_a_file(quick, tmp_path):
    text, path = "0:0 0.04:0.4 0.05:0", tmp_path / "profile.csv"
    path.write_text("time_s,valve_position\n0,0\n0.04,0.4\n0.05,0\n", encoding="utf-8")
    words = ("--tank-pressure", "4bar", "--effect", "gun.valve_flow:loss_coefficient=20", "--json")
    closing, of_file, usual = (
        told(quick(*words, *more))["velocity_m_s"]["mean"]
        for more in (("--valve-profile", text), ("--valve-profile", str(path)), ())
    )
    assert of_file == closing and closing < usual - 1.0
    refused = quick("--tank-pressure", "4bar", "--valve-profile", "0:2")
    assert "valve profile: position 2.0 at 0 s; expected 0 (shut) to 1 (open)" in refused.output


def test_a_plate_that_hangs_higher_is_struck_lower(quick, monkeypatch):
    drawings = []

    def solved(drawing, *others):
        drawings.append(drawing)
        return unsolved(drawing, *others)

    monkeypatch.setattr(twins, "solved", solved)
    for words in ((), ("--chain-height", "112mm")):
        told(quick("--tank-pressure", "4bar", *words, "--json"))
    usual, raised = drawings
    assert raised.sensors == usual.sensors
    for name, (x, y) in usual.impact_points.items():
        assert raised.impact_points[name] == pytest.approx((x, y - 0.112))
    assert "expected a multiple of 56" in quick("--chain-height", "100mm").output
    assert "outside of the plate" in quick("--chain-height", "560mm").output


# --- many shots: each as it would be alone, and every slip in a table named with its row ---
TABLE = """run,repetition,tip_material,tip_radius_mm,bullet_mass_kg,tank_pressure_bar,anvil_material
1,1,steel,45,0.5,2,none
1,2,aluminum,30,0.5,1.5,steel
2,1,PLA,60,1,3,none
"""
#: The same shots, one by one.
ALONE = (
    "--tip steel --tip-radius 45mm --bullet-mass 0.5kg --tank-pressure 2bar",
    "--tip aluminum --tip-radius 30mm --bullet-mass 0.5kg --tank-pressure 1.5bar --anvil steel",
    "--tip PLA --tip-radius 60mm --bullet-mass 1kg --tank-pressure 3bar",
)


@pytest.fixture
def lab(quick_twins):
    (quick_twins / "shots.csv").write_text(TABLE, encoding="utf-8")
    return quick_twins


def run_table(*words, refused=False):
    result = CliRunner().invoke(main, ["predict", *words])
    assert result.exit_code == (2 if refused else 0), result.output
    return result.stderr if refused else result.stdout


def test_every_row_is_what_predict_says_of_it_alone_and_a_plan_has_its_plates(lab, tmp_path):
    many = json.loads(run_table("--shots", "shots.csv", "--json"))
    for row, words in zip(many, ALONE, strict=True):
        alone = json.loads(CliRunner().invoke(predict, [*words.split(), "--json"]).stdout)
        for name in ("velocity_m_s", "contact_time_s", "peak_force_n", "impulse_n_s"):
            assert row[f"predicted_{name}"] == alone[name]["mean"]
            assert [row[f"predicted_{name}_low"], row[f"predicted_{name}_high"]] == alone[name][
                "ci90"
            ]
        sensor = row["srs"][0]["sensor"]
        means = [line["mean_m_s2"] for line in row["srs"] if line["sensor"] == sensor]
        assert means == alone["srs"][sensor]["mean"]
    CliRunner().invoke(main, ["init"])
    made = CliRunner().invoke(main, ["plan", "lhs", "spring", "--runs", "4", "--seed", "1"])
    assert made.exit_code == 0, made.output
    rows = json.loads(run_table("--plan", "spring", "--draws", "2", "--json"))
    assert [row["run"] for row in rows] == [1, 2, 3, 4] and all(
        row["predicted_velocity_m_s"] > 0 for row in rows
    )


def test_two_processes_write_the_same_files_as_one_and_what_is_assumed_is_told(lab):
    for jobs in ("1", "2"):
        files = f"--out {jobs}.csv --spectra {jobs}s.csv"
        run_table(*f"--shots shots.csv --jobs {jobs} {files} --draws 8".split())
    assert (lab / "1.csv").read_bytes() == (lab / "2.csv").read_bytes()
    assert (lab / "1s.csv").read_bytes() == (lab / "2s.csv").read_bytes()
    rows = list(csv.DictReader((lab / "1.csv").read_text().splitlines()))
    assert [(row["run"], row["repetition"]) for row in rows] == [("1", "1"), ("1", "2"), ("2", "1")]
    run_table("--shots", "shots.csv", "--out", "shots.parquet", "--draws", "4")
    table = pd.read_parquet("shots.parquet")
    assert table["run"].tolist() == [1, 1, 2]
    assert (table["predicted_peak_force_n_low"] < table["predicted_peak_force_n_high"]).all()
    (lab / "short.csv").write_text("run,tank_pressure_bar\n1,2\n")
    assumptions = assumed(rows_of_file(lab / "short.csv"), 0.5)
    assert "no column bullet_mass_kg: 0.5" in assumptions and not any(
        "tank_pressure" in line for line in assumptions
    )


@pytest.mark.parametrize(("table", "message"), [
    ("run,tip_material\n1,steel\n", "run 1: expected tank_pressure_bar or impact_velocity_m_s"),
    ("run,tank_pressure_bar,impact_velocity_m_s\n7,2,3\n", "run 7: expected tank_pressure_bar or"),
    ("run,tank_pressure_bar\n3,much\n", "run 3: tank_pressure_bar is 'much'; expected a number"),
    ("run,tank_pressure_bar,tip_material\n1,2,steel\n2,2,butter\n", "run 2: no material 'butter'"),
    ("run,tank_pressure_bar\n", "has no row to predict"),
])  # fmt: skip
def test_slip_in_a_table_is_one_line_with_its_run(lab, table, message):
    (lab / "wrong.csv").write_text(table, encoding="utf-8")
    assert message in run_table("--shots", "wrong.csv", "--draws", "2", refused=True)


@pytest.mark.parametrize(("words", "message"), [
    (("--shots", "shots.csv", "--plan", "spring"), "--plan and --shots: expected one of them"),
    (("--plan", "spring"), "no plan 'spring'"),
    (("--shots", "shots.csv", "--tip", "steel"), "--tip: of one shot"),
    (("--out", "x.csv"), "--out and --spectra go with --plan or --shots"),
    (("--shots", "shots.csv", "--out", "x.txt", "--draws", "2"),
     "a name that ends in .csv or .parquet or .json"),
])  # fmt: skip
def test_options_that_do_not_go_together_are_refused(lab, words, message):
    assert message in run_table(*words, refused=True)
