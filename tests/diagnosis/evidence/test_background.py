"""Small errors: a pulse that is too long is so in all that is made of its length; shapes may be met better."""

from __future__ import annotations

import numpy as np
import pytest
from contact_campaigns import hammer_record
from pyroshock.diagnosis.evidence.background import BANK, Background, Kernels
from pyroshock.diagnosis.evidence.cells import Cells
from pyroshock.diagnosis.evidence.whitening import Whitening
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.stages.contact import ContactStage


@pytest.fixture(scope="module")
def kernels() -> tuple[GapTable, Cells, Kernels]:
    record = hammer_record()
    gap = GapTable.of(record, (ContactStage(record),))
    cells = Cells.of(gap)
    return gap, cells, Kernels.of(gap, cells)


def of(gap: GapTable, cells: Cells, name: str) -> int:
    """The cell of an observable in the first configuration."""
    column = [each.name for each in gap.observables].index(name)
    return int(np.flatnonzero((cells.configuration == 0) & (cells.observable == column))[0])


def test_impulse_is_height_times_length(kernels: tuple[GapTable, Cells, Kernels]) -> None:
    gap, cells, kernel = kernels
    found = kernel.background(Background(1.0, 0.0, 0.0))
    peak, impulse, half, tenth = (of(gap, cells, f"ln_{n}") for n in ("peak", "impulse", "width_half", "width_tenth"))
    assert found[half, tenth] == found[peak, impulse] == found[half, impulse] == pytest.approx(1.0)
    assert found[peak, half] == 0
    left = np.zeros(len(found))
    left[[impulse, peak, half]] = 1, -1, -1
    assert left @ found @ left < 0.5  # what an impulse is beside its height and its length


def test_shapes_may_be_met_better(kernels: tuple[GapTable, Cells, Kernels]) -> None:
    gap, cells, kernel = kernels
    found = kernel.background(Background(0.0, 0.0, 1.0, detail=0.1))
    skew, peak = of(gap, cells, "skew"), of(gap, cells, "ln_peak")
    assert found[skew, skew] == pytest.approx(0.01)
    assert found[peak, peak] > 0.9


def test_gain_is_not_priced_by_shapes_that_are_right(kernels: tuple[GapTable, Cells, Kernels]) -> None:
    """Widths 0.7 tolerances off everywhere, shapes right to a twentieth: a background of the bank holds that."""
    gap, cells, kernel = kernels
    z = np.zeros(len(cells.z))
    for name in ("ln_width_half", "ln_width_tenth", "ln_impulse"):
        z[cells.observable == [each.name for each in gap.observables].index(name)] = 0.7
    noise = np.diag(np.full(len(z), 0.05**2))
    density = [Whitening.of(noise + kernel.background(one)).log_density(z) for one in BANK]
    coarse = [value for value, one in zip(density, BANK, strict=True) if one.detail == 1]
    assert max(density) > max(coarse) + 5


@pytest.mark.parametrize("one", BANK)
def test_every_background_is_a_covariance(one: Background, kernels: tuple[GapTable, Cells, Kernels]) -> None:
    found = kernels[2].background(one)
    assert np.allclose(found, found.T)
    assert np.linalg.eigvalsh(found).min() > -1e-9
