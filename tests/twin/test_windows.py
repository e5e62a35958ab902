"""Spectra from no more of a record than a line takes are those of all of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.signals.srs.spectrum import octave_grid, shock_response_spectrum
from pyroshock.twin.plate.response import respond
from pyroshock.twin.srs.ringing_window import BLOCK, ringing_spectra
from support.records.twin_parts import ringing_plate

RATE_HZ, LINES = 100_000.0, octave_grid(100, 10_000, 6)


def record(pulse_s: float, damping: float) -> np.ndarray:
    plate = ringing_plate(120)
    plate = replace(plate, damping_ratio=np.full(plate.frequency_hz.size, damping))
    time = np.arange(20_000) / RATE_HZ
    force = np.where(time < pulse_s, np.sin(np.pi * time / pulse_s), 0.0)
    return respond(plate, force, 1 / RATE_HZ)


@pytest.mark.parametrize(("pulse_s", "damping"), [(1.5e-4, 0.002), (1.5e-3, 0.01), (8e-3, 0.002)])
def test_shortened_records_lose_next_to_nothing(pulse_s, damping):
    felt = record(pulse_s, damping)
    whole = shock_response_spectrum(felt, RATE_HZ, LINES, q=10).maximax
    short = ringing_spectra(felt, RATE_HZ, LINES, 10.0, pulse_s)
    assert np.abs(20 * np.log10(short / whole)).max() < 0.1


def test_lowest_lines_take_the_whole_record_and_lines_come_in_the_order_asked():
    felt = record(1e-3, 0.005)
    short = felt[:, :10_000]
    whole = shock_response_spectrum(short, RATE_HZ, LINES, q=10).maximax
    np.testing.assert_array_equal(ringing_spectra(short, RATE_HZ, LINES, 10.0, 1e-3)[:, :BLOCK], whole[:, :BLOCK])
    back = ringing_spectra(felt, RATE_HZ, LINES[::-1], 10.0, 1e-3)
    np.testing.assert_allclose(back[:, ::-1], ringing_spectra(felt, RATE_HZ, LINES, 10.0, 1e-3), rtol=0.012)
