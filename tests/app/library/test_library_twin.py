"""The twin and its validation from Python: what the commands say, with units, tables and plots."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pyroshock as ps
import pytest
from click.testing import CliRunner
from pyroshock.app.common.errors import argument_names
from pyroshock.app.common.quantities import shown_in
from pyroshock.app.doors.command_line.operation_command import command_of
from pyroshock.app.library.laboratory_twin import LaboratoryTwin
from pyroshock.app.operations.predict.predict import PREDICT
from pyroshock.app.operations.predict.service import ShotPrediction
from support.stores.stores import pyroshock

predict = command_of(PREDICT)
LINES = "200:4000:3"
SHOT = {"tank_pressure": "0.5 bar", "bullet_mass": "0.5 kg", "tip": "steel"}
FEW = 8


@pytest.fixture(scope="module")
def url(examples_db: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    return f"sqlite:///{shutil.copy(examples_db, tmp_path_factory.mktemp('lab'))}"


pytestmark = pytest.mark.usefixtures("notebook")


@pytest.fixture
def store(url: str) -> Iterator[ps.ExperimentStore]:
    with ps.open(url, create=False) as store:
        yield store


@pytest.fixture
def twin(store: ps.ExperimentStore) -> LaboratoryTwin:
    return store.twin(campaign="first-shots", frequencies=LINES)


@pytest.fixture
def shot(twin: LaboratoryTwin) -> ShotPrediction:
    return twin.predict(tank_pressure="0.5 bar", bullet_mass="0.5 kg", draws=FEW)


def printed(*words: str) -> dict:  # JSON
    result = CliRunner().invoke(
        predict, [*words, "--frequencies", LINES, "--draws", str(FEW), "--json"]
    )
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def test_twin_without_a_store_is_that_of_the_command_line() -> None:
    twin = ps.shipped_twin(frequencies=LINES, effects="plate.damping:factor=2")
    found = twin.predict(velocity="8 m/s", tip="delrin", draws=FEW).to_json()
    assert found == printed(
        "--velocity", "8m/s", "--tip", "delrin", "--effect", "plate.damping:factor=2"
    )
    twin = ps.shipped_twin(
        frequencies=LINES, contact="hertz", coupled=True, sensors=[(0.3, 0.3), (0.6, 0.3)], q=25
    )
    words = "--contact hertz --coupled --sensor-at 0.3,0.3 --sensor-at 0.6,0.3 --q 25"
    shot = twin.predict(velocity=2.0, draws=FEW)
    assert shot.to_json() == printed("--velocity", "2m/s", *words.split())
    with pytest.raises(ps.NotFoundError, match="no sensor 'roof'"):
        shot.srs["roof"]


def test_numbers_and_series_have_bands_and_units(shot: ShotPrediction) -> None:
    units = {
        "velocity": "m/s",
        "peak_force": "N",
        "contact_time": "s",
        "compression_time": "s",
        "impulse": "N s",
    }
    for series in (shot.force, *shot.srs.values(), *shot.acceleration.values()):
        assert np.all(series.lower <= series.upper)
    for name, unit in units.items():
        number = getattr(shot, name)
        assert number.unit == unit and number.ci90 == (number.lower, number.upper)
        assert number.lower <= float(number) <= number.upper and unit in repr(number)
    frame = shot.to_frame()
    assert list(frame.loc["velocity", ["mean", "unit"]]) == [float(shot.velocity), "m/s"]
    shot_json, frame = shot.to_json(), shot.srs["acceleration_1"].to_frame()
    assert frame["mean"].tolist() == shot_json["srs"]["acceleration_1"]["mean"]
    assert frame.index.tolist() == shot_json["srs"]["frequency_hz"]
    assert frame.attrs["units"] == {
        "frequency_hz": "Hz",
        "mean": "m/s2",
        "lower": "m/s2",
        "upper": "m/s2",
    }
    assert shot.force.to_frame()["upper"].tolist() == shot_json["force"]["upper"]
    both = shot.srs.to_frame()
    assert list(both.columns.names) == ["sensor", "value"]
    assert list(both.columns.get_level_values("sensor").unique()) == list(shot.srs)
    np.testing.assert_array_equal(shot.srs.mean, frame["mean"])


def test_plots_name_their_axes_and_draw_on_given_ones(shot: ShotPrediction) -> None:
    spectrum, force = shot.srs.plot(), shot.force.plot()
    assert (spectrum.get_xscale(), spectrum.get_yscale()) == ("log", "log")
    assert spectrum.get_xlabel() == "frequency (Hz)" and spectrum.get_ylabel() == "maximax SRS (g)"
    assert len(spectrum.collections) == len(shot.srs)  # the bands
    assert force.get_xlabel() == "time (ms)" and force.get_ylabel() == "force (kN)"
    assert force.lines[0].get_ydata().max() == pytest.approx(1e-3 * shot.force.mean.max())
    with shown_in("si"):
        assert shot.srs.plot().get_ylabel() == "maximax SRS (m/s²)"
    panel = shot.plot()
    assert [axes.get_ylabel().rpartition(" ")[2] for axes in panel] == ["(kN)", "(g)", "(g)"]
    import matplotlib.pyplot as plt

    axes, count = plt.figure().subplots(), len(plt.get_fignums())
    assert shot.srs["acceleration_2"].plot(axes) is axes and shot.velocity.plot(axes) is axes
    assert len(plt.get_fignums()) == count


def test_notebook_shows_what_numbers_rest_on_and_what_lies_beyond_and_effects_are_added(twin, shot):
    assert "peak force" in shot._repr_html_() and shot.rests_on in shot._repr_html_()
    assert "first-shots" in twin._repr_html_() and twin.models["contact"] in twin._repr_html_()
    assert twin.rests_on == shot.rests_on
    found = twin.predict(tank_pressure="7 bar", bullet_mass="0.5 kg", draws=FEW)
    row = found.extrapolation.set_index("quantity").loc["tank_pressure_pa"]
    assert row["asked"] == 7e5 and row["high"] < 7e5
    assert any("Tank pressure 7 bar is above" in line for line in found.warnings)
    nominal = twin.predict(velocity=8.0, draws=0)
    damped = twin.with_effects("plate.damping:factor=10")
    twice = damped.with_effects(["plate.damping:factor=2"])
    assert damped.predict(velocity=8.0, draws=0).srs.mean.sum() < nominal.srs.mean.sum()
    assert [effect.as_json()["factor"] for effect in twice.request.effects] == [2.0]


ROWS = pd.DataFrame(
    {"run": [1, 2, 3], "tip": ["steel", "aluminum", "PLA"], "tank_pressure": ["0.5 bar", 1e5, None],
     "velocity": [None, None, "3 m/s"], "bullet_mass": [0.5, 1.0, 0.5]}
)  # fmt: skip


def test_many_shots_are_each_as_alone(twin: LaboratoryTwin) -> None:
    found = twin.predict_many(ROWS, draws=FEW, progress=False)
    assert found["tip"].tolist() == ROWS["tip"].tolist()
    for row, arguments in zip(
        found.to_dict("records"),
        ({"tank_pressure": "0.5 bar"},
         {"tank_pressure": 1e5, "tip": "aluminum", "bullet_mass": 1.0},
         {"velocity": 3.0, "tip": "PLA"}),
        strict=True,
    ):  # fmt: skip
        alone = twin.predict(**{"bullet_mass": 0.5, **arguments}, draws=FEW)
        assert row["predicted_peak_force_n"] == alone.peak_force.mean
        assert row["predicted_velocity_m_s_high"] == alone.velocity.upper
    assert found.attrs["units"]["predicted_peak_force_n"] == "N"


def test_table_of_runs_is_predicted_as_the_command_line_predicts_it(
    url: str, twin: LaboratoryTwin
) -> None:
    table = pd.DataFrame(
        {"run": [1, 2], "tank_pressure_bar": [0.5, 1.0], "bullet_mass_kg": [0.5, 1.0]}
    )
    table.assign(tip_material="steel", tip_radius_mm=45).to_csv("shots.csv", index=False)
    result = CliRunner().invoke(
        predict,
        ["--shots", "shots.csv", "--campaign", "first-shots", "--db", url, "--out", "out.csv",
        "--draws", str(FEW),
         "--frequencies", LINES],
    )  # fmt: skip
    assert result.exit_code == 0, result.stderr
    found, printed_table = (
        twin.predict_many(table, draws=FEW, progress=False),
        pd.read_csv("out.csv"),
    )
    columns = [name for name in printed_table if str(name).startswith("predicted_")]
    assert columns and (found[columns] == printed_table[columns]).all(axis=None)
    assert "no column tip_material: steel" in found.attrs["notes"]
    in_si = pd.DataFrame(
        {"tank_pressure_pa": [5e4, 1e5], "bullet_mass_kg": [0.5, 1.0], "tip_radius_m": 0.045}
    )
    assert (twin.predict_many(in_si, draws=FEW, progress=False)[columns] == found[columns]).all(
        axis=None
    )


@pytest.mark.parametrize(("function", "arguments", "message"), [
    ("predict", {"tank_pressure": "5 kg"},
     "tank_pressure is '5 kg'; expected a unit such as 'bar'"),
    ("predict", {"tank_pressure": "5"}, "tank_pressure is '5'; expected a number with a unit"),
    ("predict", {"bullet_mass": "1 bar"}, "bullet_mass is '1 bar'"),
    ("predict", {"tank_pressure": 1e5, "velocity": 2.0},
     "velocity and tank_pressure: expected one of them"),
    ("predict", {"tip": "cheese"}, "no material 'cheese'; there are: "),
    ("predict", {"draws": -1}, "draws is -1; expected a whole number from 0"),
    ("predict", {"factors": {"colour": "red"}},
     "colour = red: no stage of this twin uses it; the contact is the"),
    ("twin", {"q": 0.5}, "q is 0.5; expected"),
    ("twin", {"frequencies": [100.0, -1.0]},
     "frequencies is [100.0, -1.0]; expected positive numbers"),
    ("twin", {"effects": "plate.damping:factor=much"}, "effects 'plate.damping:factor=much'"),
    ("twin", {"effects": ["gun.gremlins"]}, "gun.gremlins"),
    ("twin", {"coupled": True, "contact": "hann"}, "coupled with the contact 'hann'"),
    ("twin", {"campaign": "autumn"}, "autumn"),
    ("twin", {"chain_height": "10 mm"}, "chain height 10 mm"),
])  # fmt: skip
def test_error_names_the_argument(
    store: ps.ExperimentStore, twin: LaboratoryTwin, function, arguments, message
):
    with pytest.raises(ps.PyroshockError) as caught:
        (twin.predict if function == "predict" else store.twin)(**arguments)
    assert message in str(caught.value) and "--" not in str(caught.value)


@pytest.mark.parametrize(("table", "message"), [
    ({"tank_pressure": [1e5], "colour": ["red"]},
     "column 'colour' of shots is no argument of predict"),
    (
        {"tank_pressure_pa": [1e5], "tip": ["steel"]},
        "predict; a table of runs has it, with 'tip_material' for 'tip': use the names of one form",
    ),
    ({"tank_pressure": [1e5, "5 kg"]}, "shots, row 2: tank_pressure is '5 kg'"),
    ({"run": [7], "bullet_mass_kg": [1.0]},
     "shots, run 7: expected tank_pressure_bar or impact_velocity_m_s"),
    ({"tank_pressure": []}, "shots has no row to predict"),
])  # fmt: skip
def test_error_of_a_table_names_row_and_column(
    twin: LaboratoryTwin, table: dict[str, list[object]], message: str
):
    with pytest.raises(ps.InvalidValueError) as caught:
        twin.predict_many(pd.DataFrame(table), progress=False)
    assert message in str(caught.value)


def test_commands_keep_their_options_and_no_public_name_is_a_package() -> None:
    text = "give --tank-pressure, or --impact-at; else: pyroshock promote hybrid@3 --force"
    assert (
        argument_names(text)
        == "give tank_pressure, or impact_points; else: pyroshock promote hybrid@3 --force"
    )
    root = Path(ps.__file__).parent
    assert not [
        name for name in ps.__all__ if (root / name).is_dir() or (root / f"{name}.py").is_file()
    ]


def test_plan_is_predicted_as_the_command_line_predicts_it(
    url: str, store: ps.ExperimentStore
) -> None:
    plan = store.plan.lhs("summer", runs=3, repetitions=1, seed=1).to_frame()
    twin = store.twin(campaign="first-shots", frequencies="200:400:3")
    words = "--plan summer --campaign first-shots --frequencies 200:400:3 --draws 4 --json --db"
    result = CliRunner().invoke(predict, [*words.split(), url])
    assert result.exit_code == 0, result.stderr
    expected = pd.DataFrame(json.loads(result.stdout))
    found = twin.predict_many(plan, draws=4, progress=False)
    columns = [name for name in expected if str(name).startswith("predicted_")]
    np.testing.assert_allclose(found[columns], expected[columns], rtol=1e-9)


# --- validation: the scores, sentence and plot of the command ---
def test_validation_is_that_of_the_command_line(store: ps.ExperimentStore) -> None:
    validation = store.validate("first-shots", draws=20, progress=False)
    result = pyroshock("validate", "first-shots", "--draws", "20", "--db", store.url, "--json")
    expected, data = json.loads(result.stdout), validation.to_json()
    assert {**data, "seconds": 0} == {**expected, "seconds": 0}
    assert (validation.sentence, validation.calibrated) == (
        expected["verdict"],
        expected["calibrated"],
    )

    (row,) = expected["quantities"]
    scores = validation.scores
    assert scores.loc["velocity", "coverage90"] == row["coverage90"]
    assert (
        list(scores.loc["velocity", ["coverage90_low", "coverage90_high"]])
        == row["coverage90_ci95"]
    )
    shots = validation.shots
    assert isinstance(shots, pd.DataFrame) and len(shots) == row["shots"]
    assert shots["measured"].tolist() == [
        shot["quantities"]["velocity"]["measured"] for shot in expected["shots"]
    ]
    assert validation.failures == tuple(failure["sentence"] for failure in expected["failures"])
    assert validation.sentence.partition(":")[0] in validation._repr_html_()

    axes = validation.plot()
    assert axes.get_xlabel() == "share of shots inside the 90 % band"
    assert [label.get_text() for label in axes.get_yticklabels()] == ["velocity"]


@pytest.mark.parametrize(("campaign", "options", "kind", "message"), [
    ("autumn", {}, ps.NotFoundError, "autumn"),
    ("first-shots", {"folds": 1}, ps.InvalidValueError, "folds is 1; expected a whole number"),
    ("first-shots", {"contact": "hybrid@3"}, ps.NotFoundError, "hybrid@3"),
])  # fmt: skip
def test_validation_says_what_there_is_not(
    store: ps.ExperimentStore, campaign, options, kind, message
):
    with pytest.raises(kind, match=message):
        store.validate(campaign, progress=False, **options)
