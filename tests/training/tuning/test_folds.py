"""Folds that part no configuration."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.tuning.folds import grouped_folds

GROUPS = np.repeat([f"c{i}" for i in range(23)], 4)


def test_every_row_is_left_out_once() -> None:
    folds = grouped_folds(GROUPS, 5, np.random.default_rng(0))
    assert np.array_equal(np.sum(folds, axis=0), np.ones(len(GROUPS)))


def test_no_configuration_is_parted() -> None:
    for fold in grouped_folds(GROUPS, 5, np.random.default_rng(0)):
        assert not set(GROUPS[fold]) & set(GROUPS[~fold])


def test_folds_are_alike() -> None:
    sizes = [int(fold.sum()) // 4 for fold in grouped_folds(GROUPS, 5, np.random.default_rng(0))]
    assert sorted(sizes) == [4, 4, 5, 5, 5]


def test_no_more_folds_than_groups() -> None:
    assert len(grouped_folds(GROUPS[:12], 5, np.random.default_rng(0))) == 3


@pytest.mark.parametrize(("groups", "folds"), [(GROUPS[:4], 5), (GROUPS, 1)])
def test_nothing_to_leave_out_is_refused(groups: np.ndarray, folds: int) -> None:
    with pytest.raises(ValueError, match="folds"):
        grouped_folds(groups, folds, np.random.default_rng(0))
