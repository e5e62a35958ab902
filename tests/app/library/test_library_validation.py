"""Validation from Python: the scores, sentence and plot of `pyroshock validate --json`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pyroshock as ps
import pytest
from click.testing import CliRunner
from pyroshock.app.demo.demo import ingest_examples
from pyroshock.app.validate.cli import validate
from support.stores.stores import opened


@pytest.fixture
def store(tmp_path: Path, notebook: None) -> Iterator[ps.ExperimentStore]:
    with opened(f"sqlite:///{tmp_path / 'lab.db'}", create=True) as opened_store:
        ingest_examples(opened_store)
    with ps.open(tmp_path / "lab.db", create=False) as store:
        yield store


def test_validation_is_that_of_the_command_line(store: ps.ExperimentStore) -> None:
    found = store.validate("first-shots", draws=20, progress=False)
    result = CliRunner().invoke(validate, ["first-shots", "--draws", "20", "--db", store.url, "--json"])
    expected = json.loads(result.stdout)
    data = found.to_json()
    assert {**data, "seconds": 0} == {**expected, "seconds": 0}
    assert (found.sentence, found.calibrated) == (expected["verdict"], expected["calibrated"])

    (row,) = expected["quantities"]
    scores = found.scores
    assert scores.loc["velocity", "coverage90"] == row["coverage90"]
    assert list(scores.loc["velocity", ["coverage90_low", "coverage90_high"]]) == row["coverage90_ci95"]
    shots = found.shots
    assert isinstance(shots, pd.DataFrame) and len(shots) == row["shots"]
    assert shots["measured"].tolist() == [shot["quantities"]["velocity"]["measured"] for shot in expected["shots"]]
    assert found.failures == tuple(failure["sentence"] for failure in expected["failures"])
    assert found.sentence.partition(":")[0] in found._repr_html_()

    axes = found.plot()
    assert axes.get_xlabel() == "share of shots inside the 90 % band"
    assert [label.get_text() for label in axes.get_yticklabels()] == ["velocity"]


@pytest.mark.parametrize(
    ("campaign", "options", "kind", "message"),
    [
        ("autumn", {}, ps.NotFoundError, "autumn"),
        ("first-shots", {"folds": 1}, ps.InvalidValueError, "folds = 1"),
        ("first-shots", {"contact": "hybrid@3"}, ps.NotFoundError, "hybrid@3"),
    ],
)
def test_error_says_what_there_is_not(
    store: ps.ExperimentStore, campaign: str, options: dict[str, object], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match=message):
        store.validate(campaign, progress=False, **options)
