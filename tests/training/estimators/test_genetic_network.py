"""The network that a genetic search sizes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from pyroshock.training.estimators.genetic_network import (
    LAYERS,
    NEURONS,
    PENALTIES,
    GeneticNetwork,
    decoded,
    left_out_error,
    show,
)
from pyroshock.training.estimators.network import Network
from pyroshock.training.tuning.folds import grouped_folds
from support.checks.estimator_checks import Rows, assert_same, known_law

SMALL = {"population": 4, "generations": 2, "folds": 2, "iterations": 15}


def fitted(
    rows: Rows, journal: Path | None = None, seed: int = 3, **settings: int
) -> GeneticNetwork:
    one = GeneticNetwork(**{**SMALL, **settings})
    one.journal = journal
    return one.fit(rows.x, rows.y, rows.groups, np.random.default_rng(seed))


def test_predicts_and_reports_what_it_found_and_searches_no_more() -> None:
    rows = known_law()[0]
    network = fitted(rows)
    layers, penalty = decoded(network.found_.genes)
    assert (network.network_.layers, network.network_.penalty) == (layers, penalty)
    assert network.arrays()["layers"].tolist() == list(layers)
    again = network.refit(rows.x, rows.y, rows.groups, np.random.default_rng(8))
    assert isinstance(again, GeneticNetwork)
    assert again.found_ is None
    assert again.arrays()["layers"].tolist() == network.arrays()["layers"].tolist()
    report = network.fit_report()
    assert report.settings["population"] == 4
    assert report.settings["generations"] == 2
    assert report.settings["neurons"] == "-".join(map(str, layers))
    assert report.settings["regularisation"] == penalty
    assert report.settings["search_best"] == network.found_.value
    assert report.histories["search_best"] == network.found_.best
    evaluated = report.histories["candidates_evaluated"]
    assert evaluated[0] <= 4
    assert list(evaluated) == sorted(evaluated)
    assert evaluated[-1] == network.found_.evaluated
    assert len(report.histories["loss"]) == 2
    search = report.searches[""]
    assert len(search.trials) == network.found_.evaluated
    assert search.best.score == network.found_.value
    assert search.best.settings == {
        "hidden_layers": len(layers),
        "neurons_per_layer": layers[0],
        "regularisation": penalty,
    }
    assert set(search.logarithmic) < set(search.settings)
    report = GeneticNetwork(**SMALL).restore(network.arrays()).fit_report()
    assert report.settings["neurons"] == network.fit_report().settings["neurons"]
    assert "search_best" not in report.settings
    assert not report.histories
    assert not report.searches


def test_workers_do_not_change_it_and_progress_is_told() -> None:
    assert_same(fitted(known_law()[0], workers=1), fitted(known_law()[0], workers=3))
    messages: list[str] = []
    network = GeneticNetwork(**SMALL)
    network.progress = lambda _done, _total, words: messages.append(words)
    rows = known_law()[0]
    network.fit(rows.x, rows.y, rows.groups, np.random.default_rng(0))
    assert len(messages) == SMALL["generations"] + 1
    assert "neurons" in messages[0]
    # 2 layers of 144 neurons, lambda 0.2009 (Table 4.9; on newtons, not on standardised forces).
    assert LAYERS == (1, 2, 3)
    assert min(NEURONS) < 10 < 144 < max(NEURONS)
    assert list(PENALTIES) == sorted(PENALTIES)
    assert decoded((1, 0, 20)) == ((4, 4), 0.1)
    assert show((1, 0, 20)) == "2 x 4 neurons, lambda 0.1"


def values_of(journal: bytes) -> list[tuple[list[int], float]]:
    lines = [json.loads(line) for line in journal.splitlines()[1:]]
    return sorted((line["key"], line["value"]) for line in lines)


def test_resumes_from_its_journal(tmp_path: Path) -> None:
    # Half a journal gives the same network; a whole one is not added to.
    rows, path = known_law()[0], tmp_path / "journal"
    whole = fitted(rows, path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert_same(fitted(rows, path), whole)
    assert values_of(path.read_bytes()) == values_of(content)
    assert_same(fitted(rows), whole)
    assert fitted(rows, path, generations=4).found_.best[:3] == whole.found_.best


@pytest.mark.parametrize("change", ["forces", "configurations", "seed", "iterations"])
def test_journal_of_other_data_is_refused(tmp_path: Path, change: str) -> None:
    rows, path = known_law()[0], tmp_path / "journal"
    fitted(rows, path, generations=0)
    other = Rows(
        rows.x,
        rows.y * 1.001 if change == "forces" else rows.y,
        rows.groups[::-1].copy() if change == "configurations" else rows.groups,
    )
    settings = {"iterations": 16} if change == "iterations" else {}
    with pytest.raises(ValueError, match="another search"):
        fitted(other, path, seed=4 if change == "seed" else 3, generations=0, **settings)


def test_left_out_error_is_that_of_separate_networks() -> None:
    """Each fold by a `Network` of its own, eq. 4.4 by hand."""
    rows = known_law()[0]
    folds = grouped_folds(rows.groups, 3, np.random.default_rng(0))
    together = left_out_error((12,), 1e-3, rows.x, rows.y, folds, 20, np.random.default_rng(9))
    rng, errors = np.random.default_rng(9), np.zeros(len(rows.x))
    for fold in folds:
        network = Network((12,), 1e-3, 20).fit(
            rows.x[~fold], rows.y[~fold], rows.groups[~fold], rng
        )
        wrong = network.predict(rows.x[fold]).mean - rows.y[fold]
        errors[fold] = np.sqrt(np.mean(wrong**2, axis=1)) / np.ptp(rows.y[fold], axis=1)
    assert together == pytest.approx(errors.mean(), rel=1e-3)
