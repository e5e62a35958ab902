"""Correlation and ranges of predictors."""

from __future__ import annotations

import json

import numpy as np
from pyroshock.dataset.predictors import correlation, ranges
from support.records.pulse_tables import pulse_table

TABLE = pulse_table(np.random.default_rng(2))


def test_matrix_is_numpys():
    varied = TABLE.x / TABLE.x.max(axis=0)
    assert np.allclose(correlation(TABLE).matrix, np.corrcoef(varied.T), atol=1e-12)


def test_properties_of_two_materials_hang_together():
    """Section 4.2.1: E, nu and yield strength of the plates are correlated by 1 and -1, for there are two."""
    found = correlation(TABLE)
    at = [found.names.index(f"plate_{name}") for name in ("youngs_modulus", "poisson_ratio", "yield_strength")]
    assert np.allclose(found.matrix[np.ix_(at, at)], [[1, -1, 1], [-1, 1, -1], [1, -1, 1]])


def test_what_never_varied_is_not_known():
    some = TABLE.take(TABLE.target_material == "steel")
    found = correlation(some)
    at = found.names.index("plate_density")
    assert np.all(np.isnan(found.matrix[at])) and np.all(np.isnan(found.matrix[:, at]))
    assert found.as_json()["correlation"][at] == [None] * len(found.names)
    json.dumps(found.as_json(), allow_nan=False)


def test_ranges_and_counts():
    rows = {row["predictor"]: row for row in ranges(TABLE)}
    velocity = TABLE.column("impact_velocity")
    assert (rows["impact_velocity"]["min"], rows["impact_velocity"]["max"]) == (velocity.min(), velocity.max())
    assert rows["tip_radius"]["distinct"] == 2
    assert rows["anvil_material"]["levels"] == {"none": 120, "aluminum": 240, "steel": 240}
