"""`validate`: the JSON that scripts rely on, the verdict in words, the exit code."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from pyroshock.app.demo.demo import ingest_examples
from pyroshock.app.validate.cli import validate
from pyroshock.validation.prediction_scores.shot_comparison import PredictionVerdict
from support.stores.hammer_stores import copied, filled_store, full_campaign
from support.stores.stores import opened


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lab")
    store = filled_store(folder, full_campaign(folder / "spring"))
    with opened(f"sqlite:///{store}") as opened_store:
        ingest_examples(opened_store)
    return store


@pytest.fixture
def lab(filled: Path, quick_twins: Path):
    """Gives the command line over a copy of a store with a hammer's campaign and the thesis's five shots."""
    url = copied(filled, quick_twins)
    return lambda *words: CliRunner().invoke(validate, [*words, "--db", url])


def data_of(result: Result) -> dict:  # JSON
    assert result.exit_code in (0, 1), result.stderr
    return json.loads(result.stdout)


def test_json_is_the_contract_and_a_page_is_written(lab, tmp_path: Path) -> None:
    page = tmp_path / "validation.html"
    data = data_of(lab("spring", "--contact", "hertz", "--json", "--html", str(page)))
    text = page.read_text(encoding="utf-8")
    for words in ("Validation", "peak force", "Ranks of the measured values", "<svg"):
        assert words in text
    assert {"quantities", "failures", "verdict", "seen"} <= data.keys()
    keys = {"name", "unit", "shots", "coverage50", "coverage90", "coverage90_ci95", "crps", "median_abs_error"}
    for row in data["quantities"]:
        assert keys <= row.keys()
        assert 0 <= row["coverage90_ci95"][0] <= row["coverage90"] <= row["coverage90_ci95"][1] <= 1
    for failure in data["failures"]:
        assert {"rule", "quantity", "bias"} <= failure.keys()


def test_five_shots_of_the_thesis_are_left_out_one_by_one(lab) -> None:
    data = data_of(lab("first-shots", "--json"))
    (velocity,) = data["quantities"]
    assert (velocity["name"], velocity["shots"], velocity["configurations"]) == ("velocity", 5, 5)
    assert data["folds"] == 5
    assert data["verdict"].startswith("Too little to judge the 90 % bands, 5 shots of 5 configurations")


def test_text_says_verdict_first_and_not_calibrated_is_exit_code_1(lab, monkeypatch: pytest.MonkeyPatch) -> None:
    result = lab("first-shots")
    assert result.exit_code == 0 and result.stdout.startswith("first-shots: Too little to judge")
    assert "inside 90 % band" in result.stdout
    overconfident = PredictionVerdict("Not calibrated: the 90 % bands hold only 40 %.", calibrated=False)
    monkeypatch.setattr("pyroshock.app.validate.validation.verdict", lambda _: overconfident)
    result = lab("first-shots")
    assert result.exit_code == 1 and "Not calibrated" in result.stdout


def test_unknown_campaign_is_one_line(lab) -> None:
    result = lab("winter")
    assert result.exit_code == 2 and result.stderr.count("\n") == 1 and "winter" in result.stderr
