"""Accelerometers in another unit, with another sign, or in each other's place are refused; a wrong
plate is not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.plausibility import LikelyMistake, implausible
from pyroshock.diagnosis.plausibility.channels import early_fits, tensile_force
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration, Series
from support.records.plate_folders import CHANNELS, plate_record, small_plate

Accelerations = Mapping[str, Series]


def changed(change: Callable[[Accelerations], Accelerations]) -> CampaignRecord:
    record = plate_record()
    runs = tuple(replace(run, accelerations=change(run.accelerations)) for run in record.runs)
    return replace(record, runs=runs)


def times(factor: float, *channels: str) -> Callable[[Accelerations], Accelerations]:
    return lambda recorded: {
        name: replace(series, values=series.values * (factor if name in channels else 1.0))
        for name, series in recorded.items()
    }


def findings(record: CampaignRecord) -> tuple[LikelyMistake, ...]:
    return implausible(record, [])


def test_a_perfect_bench_fits_itself() -> None:
    fits = early_fits(plate_record(noise=0.0))
    np.testing.assert_allclose(np.diag(fits.correlation), 1, atol=1e-9)
    np.testing.assert_allclose(fits.log_gain, 0, atol=1e-9)
    plate = small_plate()
    alike = replace(plate, shapes=plate.shapes[[0, 0]])
    assert findings(replace(plate_record(alike), plate=alike)) == ()


@pytest.mark.parametrize(
    ("stiffer", "damping"), [(1.0, 1.0), (1.05, 1.0), (0.95, 1.0), (1.0, 4.0), (1.0, 0.3)]
)
def test_another_plate_than_the_table_s_is_no_mistake(stiffer: float, damping: float) -> None:
    plate = small_plate()
    true = replace(
        plate,
        frequency_hz=plate.frequency_hz * stiffer,
        damping_ratio=plate.damping_ratio * damping,
    )
    assert findings(plate_record(true)) == ()


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1 / 9.80665, " g "), (9.80665, " g "), (1e3, "mm/s2"), (1 / 0.3048, "ft/s2")],
)
def test_one_channel_in_another_unit_is_refused(factor: float, unit: str) -> None:
    (finding,) = findings(changed(times(factor, CHANNELS[1])))
    assert (finding.severity, finding.channel) == ("refuse", CHANNELS[1])
    assert unit in finding.message


def test_a_channel_of_any_name_in_another_unit_is_refused() -> None:
    record = changed(times(1e3, CHANNELS[0]))
    sides = dict(zip(CHANNELS, ("left", "right"), strict=True))
    runs = tuple(
        replace(
            run, accelerations={sides[name]: series for name, series in run.accelerations.items()}
        )
        for run in record.runs
    )
    (finding,) = implausible(
        replace(record, runs=runs, plate=replace(small_plate(), sensors=("left", "right"))), []
    )
    assert (finding.severity, finding.channel) == ("refuse", "left")
    assert finding.message.endswith("correct its unit or sensitivity in campaign.toml")


@pytest.mark.parametrize(
    ("kind", "anvil", "refused"), [("gun", "steel", 0), ("gun", "none", 1), ("hammer", "steel", 1)]
)
def test_an_anvil_on_preloaded_cells_swings_back(kind: str, anvil: str, refused: int) -> None:
    """After the blow the cells show a pull of 60 %, which neither bare cells nor a hammer's tip
    do."""
    time = np.arange(400) / 1e5
    swing = 1e4 * np.where(
        time < 1e-3, np.sin(np.pi * time / 1e-3), -0.6 * np.sin(np.pi * (time - 1e-3) / 1e-3)
    )
    force = Series(np.where(time < 2e-3, swing, 0.0), 1e5, 0.0)
    runs = tuple(Run(0, number, 1, number, force=force) for number in range(1, 4))
    record = CampaignRecord(
        "swings", kind, (RunConfiguration("c", {"anvil_material": anvil}),), runs
    )
    assert len(tensile_force(record)) == refused


def test_channels_in_each_other_s_place_or_reversed_are_refused() -> None:
    (finding,) = findings(changed(times(-1.0, CHANNELS[0])))
    assert (finding.severity, finding.channel) == ("refuse", CHANNELS[0])
    assert "polarity" in finding.message
    first, second = CHANNELS
    (finding,) = findings(
        changed(lambda recorded: {first: recorded[second], second: recorded[first]})
    )
    assert finding.severity == "refuse"
    assert "swapped" in finding.message
    record = plate_record()
    runs = tuple(replace(run, force=run.accelerations[CHANNELS[0]]) for run in record.runs)
    (finding,) = findings(replace(record, runs=runs))
    assert (finding.severity, finding.channel) == ("refuse", "force")
    assert "pulls" in finding.message
    (finding,) = findings(changed(times(1e3, *CHANNELS)))
    assert finding.severity == "refuse"
    assert "force: values in kN where N is declared" in finding.message
    assert "mm/s2" in finding.message
