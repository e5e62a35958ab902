"""The modal table, read back by the reader of campaign folders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyroshock.ingest.modes import read_modal_table
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.plate.build import resonant_plate
from pyroshock.virtualbench.plate.modes import PlateModes, modal_table, modes


@pytest.fixture(scope="module")
def solved() -> PlateModes:
    plate = resonant_plate("steel", "free", np.random.default_rng(2))
    return modes(plate, Effects.none(), max_frequency_hz=500.0)


def test_ingest_reads_every_number_back(solved: PlateModes, tmp_path: Path) -> None:
    (tmp_path / "plate_modes.csv").write_text(modal_table(solved, 1))
    read = read_modal_table(tmp_path, "plate_modes.csv", ("acceleration_1", "acceleration_2")).modes
    assert [row.frequency_hz for row in read] == solved.frequencies_hz.tolist()
    assert [row.damping_ratio for row in read] == solved.damping.tolist()
    assert [row.shape_impact for row in read] == solved.shape_impact[1].tolist()
    assert [row.shapes["acceleration_2"] for row in read] == solved.shapes[1].tolist()


@pytest.mark.parametrize("point", [-1, 3])
def test_an_unknown_impact_point_is_refused(solved: PlateModes, point: int) -> None:
    with pytest.raises(ValueError, match=f"point = {point}"):
        modal_table(solved, point)
