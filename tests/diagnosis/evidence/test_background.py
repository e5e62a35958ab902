"""Small errors: a pulse that is too long is so in all that is made of its length; shapes may be met better."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.background import BANK, PLATE_BANK, Background, Kernels, bank, under
from pyroshock.diagnosis.evidence.cells import Cells
from pyroshock.diagnosis.evidence.whitening import Whitening
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.stages.contact import ContactStage
from pyroshock.diagnosis.stages.plate import PlateStage
from support.records.contact_campaigns import hammer_record
from support.records.plate_records import plate, played


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
    found = kernel.background({"contact": Background(1.0, 0.0, 0.0)})
    peak, impulse, half, tenth = (of(gap, cells, f"ln_{n}") for n in ("peak", "impulse", "width_half", "width_tenth"))
    assert found[half, tenth] == found[peak, impulse] == found[half, impulse] == pytest.approx(1.0)
    assert found[peak, half] == 0
    left = np.zeros(len(found))
    left[[impulse, peak, half]] = 1, -1, -1
    assert left @ found @ left < 0.5  # what an impulse is beside its height and its length


def test_shapes_may_be_met_better(kernels: tuple[GapTable, Cells, Kernels]) -> None:
    gap, cells, kernel = kernels
    found = kernel.background({"contact": Background(0.0, 0.0, 1.0, detail=0.1)})
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
    density = [Whitening.of(noise + kernel.background({"contact": one})).log_density(z) for one in BANK]
    coarse = [value for value, one in zip(density, BANK, strict=True) if one.detail == 1]
    assert max(density) > max(coarse) + 5


@pytest.mark.parametrize("one", BANK)
def test_every_background_is_a_covariance(one: Background, kernels: tuple[GapTable, Cells, Kernels]) -> None:
    found = kernels[2].background({"contact": one})
    assert np.allclose(found, found.T)
    assert np.linalg.eigvalsh(found).min() > -1e-9


@pytest.fixture(scope="module")
def plates() -> tuple[GapTable, Cells, Kernels]:
    record = played(bench=plate(), contacts=[(2e-4, 900.0), (3e-4, 1200.0), (4e-4, 900.0)], repetitions=2)
    gap = GapTable.of(record, (PlateStage(record),))
    cells = Cells.of(gap)
    return gap, cells, Kernels.of(gap, cells)


def test_gain_is_shared_by_all_that_a_sensor_shows_of_one_configuration(
    plates: tuple[GapTable, Cells, Kernels],
) -> None:
    gap, cells, kernel = plates
    found = kernel.background({"plate": Background(0.0, gain=(0.0, 0.7))})
    name = [gap.observables[int(o)].name for o in cells.observable]
    level = np.array(["spectrum" in each or "ln amplitude" in each for each in name])
    same = (cells.configuration[:, None] == cells.configuration) & (kernel.channel[:, None] == kernel.channel)
    np.testing.assert_allclose(found, 0.49 * (same & level[:, None] & level))


@pytest.mark.parametrize("one", PLATE_BANK)
def test_every_background_of_a_plate_is_a_covariance(one: Background, plates: tuple[GapTable, Cells, Kernels]) -> None:
    found = plates[2].background({"plate": one})
    assert np.allclose(found, found.T)
    assert np.linalg.eigvalsh(found).min() > -1e-9


@pytest.mark.parametrize(
    "stages", [("gun",), ("contact",), ("gun", "contact"), ("plate",), ("gun", "contact", "plate")]
)
def test_what_may_lie_under_a_gap_is_of_the_bank(stages: tuple[str, ...]) -> None:
    every = bank(stages)
    assert all(set(one) == set(stages) for one in every)
    assert all(one in every for one in under(stages))
    assert len({tuple(one.items()) for one in every}) == len(every)
