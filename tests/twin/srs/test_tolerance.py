"""Spectra against targets: errors, margins, shares; and from no more of a record than a line
takes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.signals.srs.spectrum import octave_grid, shock_response_spectrum
from pyroshock.twin.plate.response import respond
from pyroshock.twin.srs.ringing_window import BLOCK, ringing_spectra
from pyroshock.twin.srs.standards import NASA_STD_7003, parse_tolerance, within_db
from pyroshock.twin.srs.target import Target, compare
from support.records.twin_parts import ringing_plate

LINES = np.array([100.0, 200, 400, 800])


def target(upper=6.0, lower=6.0) -> Target:
    return Target(LINES, np.full(4, 10.0), np.full(4, upper), np.full(4, lower))


def test_margin_counts_to_the_nearer_edge_and_shares_count_lines():
    """Twice the level is six decibels above; the edge belongs to the band, a free side never fails,
    and no response is infinitely below."""
    double = compare(np.full(4, 20.0), LINES, target())
    np.testing.assert_allclose(double.error_db, 6.0206, atol=1e-4)
    np.testing.assert_allclose(double.margin_db, -0.0206, atol=1e-4)
    assert not double.within
    nearer = compare(
        10 * 10 ** (np.array([2.0, -2.0, 5.0, -1.0]) / 20), LINES, target(upper=9.0, lower=3.0)
    )
    np.testing.assert_allclose(nearer.margin_db, [5, 1, 4, 2], atol=1e-9)
    assert nearer.worst_margin_db == pytest.approx(1.0) and nearer.worst_frequency_hz == 200
    assert compare(np.full(4, 10 * 10**0.3), LINES, target(upper=6.0)).within
    some = compare(np.array([10.0, 11.0, 9.0, 40.0]), LINES, target())
    assert some.share_within == 0.75 and some.share_above == 0.75
    none = compare(np.array([0.0, 10, 10, 10]), LINES, target())
    assert none.worst_margin_db == -np.inf and none.worst_frequency_hz == 100
    assert compare(np.full(4, 1e9), LINES, target(upper=np.inf)).within
    assert not compare(np.full(4, 1.0), LINES, target(upper=np.inf)).within


def test_batch_and_lines_in_range_are_judged_one_by_one():
    spectra = np.exp(np.random.default_rng(5).normal(2.3, 0.7, (3, 5, 4)))
    all_at_once = compare(spectra, LINES, target())
    alone = [[compare(one, LINES, target()) for one in row] for row in spectra]
    for name in ("share_within", "share_above", "worst_margin_db", "worst_frequency_hz", "within"):
        np.testing.assert_array_equal(
            getattr(all_at_once, name), [[getattr(x, name) for x in row] for row in alone]
        )
    lines = np.array([50.0, 100, 800, 1600])
    found = compare(np.array([1e9, 10.0, 10.0, 1e9]), lines, target())
    np.testing.assert_array_equal(found.frequency_hz, [100, 800])
    assert found.within
    with pytest.raises(
        ValueError, match=r"no line of the spectrum \(1 to 2 Hz\) .* range \(100 to 800 Hz\)"
    ):
        compare(np.ones(2), np.array([1.0, 2.0]), target())


def test_nasa_std_7003_opens_upwards_above_three_kilohertz_and_no_tolerance_is_one():
    upper, lower = NASA_STD_7003.at(np.array([0.0, 100, 3000, 3000.5, 10_000]))
    assert upper.tolist() == [6, 6, 6, 9, 9]
    assert lower.tolist() == [6] * 5
    assert compare(
        np.full(4, 10.0), LINES, Target(LINES, np.full(4, 10.0), *within_db(0.0).at(LINES))
    ).within
    for wrong in ((-0.5, 1.0), (1.0, -0.5)):
        with pytest.raises(ValueError, match="expected 0 dB or more"):
            within_db(*wrong)


def test_a_rounding_error_beyond_the_edge_is_no_offence_and_more_is():
    for over, share in ((5e-10, 1.0), (1e-8, 0.0)):
        found = compare(np.full(4, 10 * 10 ** ((6.0 + over) / 20)), LINES, target())
        assert (found.within, found.share_within) == (share == 1, share)
        assert np.all(found.margin_db == 0) == found.within
    below = compare(np.full(4, 10 * 10 ** (-5e-10 / 20)), LINES, target())
    assert below.share_above == 1 and np.all(below.error_db == 0)


def test_tolerances_read_and_others_are_refused():
    for text, meant in {
        "6dB": within_db(6.0),
        " 6 dB": within_db(6.0),
        "±1.5db": within_db(1.5),
        "+9/-6dB": within_db(9.0, 6.0),
        "+9 dB / -6 dB": within_db(9.0, 6.0),
        "NASA-STD-7003": NASA_STD_7003,
    }.items():
        assert parse_tolerance(text) == meant
    for text in ("6", "-6dB", "dB", "6dBm", "9/6dB", ""):
        with pytest.raises(ValueError, match="expected one such as 6dB"):
            parse_tolerance(text)


RATE_HZ, OCTAVE_LINES = 100_000.0, octave_grid(100, 10_000, 6)


def record(pulse_s: float, damping: float) -> np.ndarray:
    plate = ringing_plate(120)
    plate = replace(plate, damping_ratio=np.full(plate.frequency_hz.size, damping))
    time = np.arange(20_000) / RATE_HZ
    force = np.where(time < pulse_s, np.sin(np.pi * time / pulse_s), 0.0)
    return respond(plate, force, 1 / RATE_HZ)


@pytest.mark.parametrize(("pulse_s", "damping"), [(1.5e-4, 0.002), (1.5e-3, 0.01), (8e-3, 0.002)])
def test_shortened_records_lose_next_to_nothing(pulse_s, damping):
    felt = record(pulse_s, damping)
    whole = shock_response_spectrum(felt, RATE_HZ, OCTAVE_LINES, q=10).maximax
    short = ringing_spectra(felt, RATE_HZ, OCTAVE_LINES, 10.0, pulse_s)
    assert np.abs(20 * np.log10(short / whole)).max() < 0.1


def test_lowest_lines_take_the_whole_record_and_lines_come_in_the_order_asked():
    felt = record(1e-3, 0.005)
    short = felt[:, :10_000]
    lines = OCTAVE_LINES[:BLOCK]
    whole = shock_response_spectrum(short, RATE_HZ, lines, q=10, resample_within=0.05).maximax
    np.testing.assert_array_equal(
        ringing_spectra(short, RATE_HZ, OCTAVE_LINES, 10.0, 1e-3)[:, :BLOCK], whole
    )
    back = ringing_spectra(felt, RATE_HZ, OCTAVE_LINES[::-1], 10.0, 1e-3)
    np.testing.assert_allclose(
        back[:, ::-1], ringing_spectra(felt, RATE_HZ, OCTAVE_LINES, 10.0, 1e-3), rtol=0.012
    )
