"""Families of observables: which there are, how large their gaps are, and when a background may
make them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.gap import GapMetric, GapTable, Noise
from pyroshock.diagnosis.observable_families import (
    background_probability,
    family_columns,
    family_gaps,
    family_of,
)
from pyroshock.diagnosis.observables.base import Observable
from pyroshock.diagnosis.observables.contact.features import OBSERVABLES
from pyroshock.diagnosis.observables.plate.stage import mode_observables
from pyroshock.diagnosis.record import CampaignRecord

VELOCITY = Observable("ln_velocity", "gun", "velocity", "1", 0.01, 0.008)
EXIT, RESIDUAL = (
    Observable(name, "gun", "tank_pressure", "1", 0.01, 0.002)
    for name in ("exit_pressure", "residual_pressure")
)
LINES = tuple(
    Observable(
        f"acceleration_1 spectrum at {f} Hz", "plate", "acceleration_1", "dB", 0.5, 0.15, float(f)
    )
    for f in (100, 200)
)
MODES = mode_observables(np.array([300.0, 800.0]), (0.001, 0.1))
AMPLITUDE = Observable(
    "acceleration_1 ln amplitude of the mode at 300 Hz", "plate", "acceleration_1", "1", 0.06, 0.015
)
REST, DELAY = (
    Observable(f"acceleration_1 {name}", "plate", "acceleration_1", "1", 0.1, 0.004, detail=True)
    for name in ("rest from 0 to 1 ms", "delay")
)
PLATE = (*MODES, *LINES, AMPLITUDE, REST, DELAY)


def table(
    observables: Sequence[Observable], tolerances: Sequence[float], sigma: float = 1e-3
) -> GapTable:
    """Two configurations, off by so many tolerances to either side; the scatter of a mean is
    `sigma` tolerances."""
    tolerance = np.array([item.tolerance for item in observables])
    mean = np.array([[1.0], [-1.0]]) * np.array(tolerances) * tolerance
    return GapTable(
        record=CampaignRecord("by hand", "gun", (), ()),
        observables=tuple(observables),
        residuals=mean,
        mean=mean,
        count=np.where(np.isfinite(mean), 1, 0),
        noise=Noise(np.diag((sigma * tolerance) ** 2), np.full(len(observables), 10.0)),
        nuisances=np.zeros((0, *mean.shape)),
        loudness={},
    )


def test_every_observable_has_the_family_that_the_report_names() -> None:
    assert [family_of(item) for item in (VELOCITY, EXIT, RESIDUAL)] == [
        "velocity",
        "pressure trace",
        "pressure trace",
    ]
    pulse = {item.name: family_of(item) for item in OBSERVABLES}
    assert {name for name, family in pulse.items() if family == "peak, impulse, width"} == {
        "ln_peak", "ln_impulse", "ln_width_half",
    }  # fmt: skip
    assert set(pulse.values()) == {"peak, impulse, width", "shape"}
    assert [family_of(item) for item in PLATE] == [
        "frequencies", "frequencies", "damping", "damping", "spectrum", "spectrum",
        "amplitudes of modes", "rest and delay", "rest and delay",
    ]  # fmt: skip


def test_family_without_a_name_of_its_own_is_its_channels() -> None:
    strange = Observable(
        "momentum over impulse", "contact_check", "velocity_after", "1", 0.02, 0.01
    )
    assert family_of(strange) == "velocity after"


def test_families_have_their_rms_in_their_own_unit() -> None:
    gap = table([VELOCITY, *MODES, *LINES], [0.5, 3.0, 4.0, 2.0, 2.0, 0.6, 0.8], sigma=0.1)
    sizes = {item.family: item for item in family_gaps(gap)}
    assert list(sizes) == ["velocity", "frequencies", "damping", "spectrum"]
    assert sizes["velocity"].before == pytest.approx(0.005)
    assert sizes["frequencies"].before == pytest.approx(0.002 * np.sqrt((9 + 16) / 2))
    assert sizes["spectrum"].before == pytest.approx(0.5 * np.sqrt((0.36 + 0.64) / 2))
    assert [item.tolerance for item in sizes.values()] == pytest.approx([0.01, 0.002, 0.1, 0.5])
    assert [item.noise_floor for item in sizes.values()] == pytest.approx(
        [0.001, 0.0002, 0.01, 0.05]
    )
    assert [item.beyond_noise for item in sizes.values()] == [False, True, True, False]


def test_spectrum_within_tolerance_does_not_hide_a_damping_that_is_not() -> None:
    gap = table(PLATE, [0.1, 0.1, 3.0, 3.0, 0.6, 0.6, 0.2, 0.1, 0.1])
    assert not GapMetric.of(gap).size(gap).beyond_noise
    assert [item.family for item in family_gaps(gap) if item.beyond_noise] == ["damping"]
    assert background_probability(gap) < 0.02


def test_family_without_a_value_is_not_listed() -> None:
    gap = table([VELOCITY, EXIT], [2.0, np.nan])
    assert [item.family for item in family_gaps(gap)] == list(family_columns(gap)) == ["velocity"]


def test_noise_is_taken_off_before_a_family_is_compared_with_its_tolerance() -> None:
    # 3, 4, 5: a scatter of four, of which a gap of five leaves three.
    assert family_gaps(table([VELOCITY], [5.0], sigma=4.0))[0].excess == pytest.approx(3.0)
    assert background_probability(table([VELOCITY], [4.0], sigma=4.0)) == 1.0


def test_what_uncertain_nominal_numbers_may_do_is_no_more_than_a_background() -> None:
    """Five tolerances, of which a declared uncertainty makes four: three are left."""
    gap = table([VELOCITY], [5.0])
    stated = replace(gap, nuisances=np.full((1, 2, 1), 4.0 * VELOCITY.tolerance))
    assert background_probability(stated) == pytest.approx(
        background_probability(table([VELOCITY], [3.0])), rel=1e-3
    )
    wide = replace(gap, nuisances=np.full((1, 2, 1), 5.0 * VELOCITY.tolerance))
    assert background_probability(wide) == 1.0
    assert family_gaps(wide) == family_gaps(gap)  # the report's sizes stay what they are


@pytest.mark.parametrize(
    ("size", "low", "high"), [(0.9, 1.0, 1.0), (1.5, 0.6, 0.8), (2.0, 0.3, 0.4), (3.0, 0.0, 0.02)]
)
def test_background_is_within_tolerance_and_a_little_beyond(
    size: float, low: float, high: float
) -> None:
    assert low <= background_probability(table([VELOCITY], [size])) <= high
    # the largest family decides
    assert background_probability(table([VELOCITY, *LINES], [size, 0.1, 0.1])) == pytest.approx(
        background_probability(table([VELOCITY], [size])), rel=1e-3
    )
