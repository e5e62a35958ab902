"""Twin, prediction, tuning, validation and diagnosis of the library: the same answers as the command line."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
import pint
import pyroshock as ps
import pytest
from click.testing import CliRunner
from pyroshock.app.diagnose.cli import diagnose
from pyroshock.app.predict.cli import predict
from pyroshock.app.tune.service import target_of
from pyroshock.app.twins import building
from pyroshock.app.validate.cli import validate
from support.records.twin_parts import unsolved

mpl.use("Agg")

_FIRST_SHOTS = str(files("pyroshock") / "examples" / "first-shots")


@pytest.fixture(scope="module", autouse=True)
def _elsewhere(tmp_path_factory):
    """The shipped twin keeps its solved plates beside the current folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("here"))
        yield


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    with ps.open(tmp_path_factory.mktemp("gun") / "lab.db") as store:
        store.ingest(_FIRST_SHOTS, progress=False)
        yield store


@pytest.fixture(scope="module")
def twin(store):
    return store.twin(campaign="first-shots")


@pytest.fixture(scope="module")
def shot(twin):
    return twin.predict(tank_pressure="2 bar", bullet_mass="1 kg", tip="steel", draws=24)


def _printed(command, *arguments, codes=(0,)):
    result = CliRunner().invoke(command, list(arguments))
    assert result.exit_code in codes, result.output
    return json.loads(result.stdout)


def test_a_prediction_is_that_of_the_command(store, shot):
    printed = _printed(
        predict, "--db", store.url, "--json", "--campaign", "first-shots", "--tank-pressure", "2bar",
        "--bullet-mass", "1kg", "--draws", "24",
    )  # fmt: skip
    assert json.loads(json.dumps(shot.to_json())) == printed
    assert float(shot.velocity) == printed["velocity_m_s"]["mean"]
    assert list(shot.velocity.ci90) == printed["velocity_m_s"]["ci90"]
    sensor = next(iter(shot.srs))
    np.testing.assert_array_equal(shot.srs[sensor].mean, printed["srs"][sensor]["mean"])
    np.testing.assert_array_equal(shot.srs.x, printed["srs"]["frequency_hz"])


def test_quantities_are_given_three_ways(twin, shot):
    unit: Any = pint.UnitRegistry()
    for pressure, mass in ((2e5, 1.0), (unit.Quantity(2, "bar"), unit.Quantity(1000, "g"))):
        same = twin.predict(tank_pressure=pressure, bullet_mass=mass, draws=24)
        assert float(same.velocity) == pytest.approx(float(shot.velocity), rel=1e-12)


def test_bands_hold_their_means(shot):
    for number in (shot.velocity, shot.peak_force, shot.contact_time, shot.impulse):
        assert number.lower <= number.mean <= number.upper
        assert number.unit in repr(number)
    for series in (shot.force, *shot.srs.values(), *shot.acceleration.values()):
        assert np.all(series.lower <= series.upper)
        frame = series.to_frame()
        assert list(frame.columns) == ["mean", "lower", "upper"] and len(frame) == len(series)
        assert frame.attrs["units"]["mean"] == series.unit


def test_a_prediction_as_a_table(shot):
    frame = shot.to_frame()
    assert frame.loc["velocity", "mean"] == float(shot.velocity) and frame.loc["peak force", "unit"] == "N"
    assert "velocity" in shot._repr_html_() and shot.rests_on
    assert list(shot.srs.to_frame().columns.names) == ["sensor", "value"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"tank_pressure": "2"}, "tank_pressure is '2'; expected a number with a unit"),
        ({"bullet_mass": "1 bar"}, "bullet_mass is '1 bar'"),
        ({"tip": "cheese"}, "no material 'cheese'"),
        ({"velocity": 2.0, "tank_pressure": 1e5}, "velocity and tank_pressure: expected one of them"),
        ({"factors": {"moon": "full"}}, "moon = full: no stage"),
    ],
)
def test_mistakes_are_named_as_python_spells_them(twin, arguments, words):
    with pytest.raises(ps.PyroshockError, match=words) as caught:
        twin.predict(**arguments)
    assert "--" not in str(caught.value).partition(":")[0]


def test_the_shipped_bench_needs_no_store(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(building, "solved", unsolved)
    twin = ps.shipped_twin(contact="hertz")
    assert float(twin.predict(velocity="3 m/s", draws=0).velocity) == pytest.approx(3.0)
    with pytest.raises(ps.NotFoundError, match="effect"):
        ps.shipped_twin(effects=["gun.gremlins"])
    with pytest.raises(ps.NotFoundError, match="no sensor 'roof'"):
        twin.predict(velocity=3.0, draws=0).srs["roof"]


def test_a_target_in_five_forms(tmp_path):
    frequency, level = np.array([100.0, 1000.0, 5000.0]), np.array([200.0, 2000.0, 2000.0])
    frame = pd.DataFrame({"frequency_hz": frequency, "level_m_s2": level})
    frame.to_csv(tmp_path / "spec.csv", index=False)
    series = pd.Series(level, index=frequency)
    targets = [target_of(given, "6dB") for given in (tmp_path / "spec.csv", series, frame, (frequency, level))]
    targets.append(target_of(targets[0]))
    for target in targets:
        np.testing.assert_allclose(target.level_m_s2, targets[0].level_m_s2)
        np.testing.assert_allclose(target.upper_db, targets[0].upper_db)
    with pytest.raises(ValueError, match="level"):
        target_of(pd.Series([-1.0, 1.0], index=[100.0, 200.0]))


def test_a_diagnosis_is_that_of_the_command(store):
    report = store.diagnose("first-shots", progress=False)
    printed = _printed(diagnose, "first-shots", "--db", store.url, "--json")
    own = json.loads(json.dumps(report.to_json()))
    assert {**own, "seconds": 0} == {**printed, "seconds": 0}
    effects = report.effects
    assert effects["share"].is_monotonic_decreasing and effects["share"].sum() <= 1.0 + 1e-9
    assert report.fraction == (printed["path"][-1]["fraction"] if printed["path"] else None)
    assert report.gap["before"] == printed["gap"]["before"] and list(report.stages["stage"])
    assert "share of the squared gap" in report.plot().get_xlabel() and report.sentence in repr(report)
    name, fitted = next(iter(report.fitted.items()))
    twin = store.twin(campaign="first-shots", effects=fitted)
    assert name.split("+")[0].split(".")[1] in " ".join(twin.models.values())


def test_adopting_needs_a_campaign_of_the_store(store):
    with pytest.raises(ps.InvalidValueError, match=r"adopting gun.valve_flow needs a campaign of the store"):
        store.diagnose(_FIRST_SHOTS, adopt="gun.valve_flow", progress=False)


def test_a_validation_is_that_of_the_command(store):
    validation = store.validate("first-shots", folds=2, draws=20, progress=False)
    printed = _printed(
        validate, "first-shots", "--db", store.url, "--json", "--folds", "2", "--draws", "20", codes=(0, 1)
    )
    own = json.loads(json.dumps(validation.to_json()))
    assert {**own, "seconds": 0} == {**printed, "seconds": 0}
    frame = validation.to_frame()
    assert frame.loc["velocity", "coverage90"] == printed["quantities"][0]["coverage90"]
    assert validation.calibrated == printed["calibrated"] and validation.sentence in repr(validation)
    assert "90 % band" in validation.plot().get_xlabel() and len(validation.shots) >= 5
