"""Between its nodes a surface is what the stage says."""

from __future__ import annotations

from functools import cache

import numpy as np
from pyroshock.diagnosis.evidence.surface import POINTS, Surface, basis
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.stages.gun import GunStage
from support.records.gun_shots import shots, tables


@cache
def made() -> tuple[GapTable, tuple[Surface, ...], GunStage]:
    return tables(shots())


def test_surfaces_interpolate_the_stage() -> None:
    """To a third of the tolerance and 5 % of the change, wherever they claim to be valid: laws are off by a tenth."""
    gap, surfaces, stage = made()
    assert len(surfaces) > 10
    for surface in surfaces:
        rng = np.random.default_rng(1)
        u = surface.points[rng.choice(np.flatnonzero(surface.valid), 24)]
        exact = stage.changes([[surface.effect(row)] for row in u])
        near = np.array([surface.change(row) for row in u])
        assert np.isfinite(exact).all()
        far = np.abs(near - exact) - 0.33 * gap.tolerance[0] - 0.05 * np.abs(exact)
        assert np.all(far < 0), (surface.id, [axis.name for axis in surface.sheet.axes], far.max())


def test_basis_sums_to_one() -> None:
    u = np.random.default_rng(0).uniform(size=(40, 2))
    np.testing.assert_allclose(basis(u, 7).sum(axis=1), 1.0, atol=1e-12)


def test_points_are_many_enough_for_a_narrow_posterior() -> None:
    """Neighbours differ by less than a standard error of a mean of four shots."""
    for surface in made()[1]:
        if len(surface.sheet.axes) == 1:
            changes = (surface.basis @ surface.nodes.reshape(len(surface.nodes), -1))[surface.valid]
            inside = np.abs(changes).max(axis=1) < 0.3
            steps = np.abs(np.diff(changes[inside], axis=0)).max(axis=1)
            assert np.median(steps) < 0.0075
            assert len(surface.points) == POINTS[1]
