"""The naive baseline on a bench whose effects obey the library's own laws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyroshock.diagnosis.chain import stages_of
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.reading import read_folder
from pyroshock.validation.cases.draw import draw_case
from pyroshock.validation.cases.record import record_case
from pyroshock.validation.joint_ridge import joint_ridge


def test_gain_of_the_force_goes_held_out_too(tmp_path: Path) -> None:
    case = draw_case("hammer", "strong", np.random.default_rng(2), cause="sensor.force_gain", decoy=False, number=0)
    record_case(case, tmp_path / "c", 1)
    record = read_folder(tmp_path / "c")
    stages, _ = stages_of(record, Options())
    answer = joint_ridge(stages, GapTable.of(record, stages))
    assert answer["fraction"] > 0.7
    assert answer["inside"] <= answer["after"] < answer["before"]
    assert sum(answer["shares"].values()) == pytest.approx(1.0)
