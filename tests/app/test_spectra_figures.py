"""Spectra beside their reference: shades of the bands, differences in dB, four-coordinate paper."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.app.figures.figure import BandSeries, LineSeries
from pyroshock.app.operations.impacts.four_coordinate_paper import paper_lines
from pyroshock.app.operations.impacts.overlays import (
    ImpactSpectrum,
    ReferenceBand,
    SpectrumOverlay,
)
from pyroshock.app.operations.impacts.spectra_figures import (
    compared_figure,
    differences_plot,
    four_coordinate_figure,
    impact_spectra_plot,
    spectra_plot,
)
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from pyroshock.twin.chain import default_lines
from pyroshock.twin.srs.target import Target, compare

G = 9.80665
#: The reference, and by how much each spectrum is made to differ from it.
OFFSETS_DB = tuple(np.linspace(-12, 12, 12))


def level_db(level, decibels):
    return level * 10 ** (decibels / 20)


@pytest.fixture(scope="module")
def overlay():
    """Twelve spectra that are whole decibels from their reference, as the overlay of a store."""
    rate = 100_000.0
    time = np.arange(5000) / rate
    record = np.exp(-200 * time) * np.sin(2e3 * np.pi * time)
    lines = default_lines()
    base = shock_response_spectrum(record, rate, lines, q=10.0)
    spectra = tuple(
        ImpactSpectrum(
            i + 1,
            "plate",
            0.0,
            0.05,
            shock_response_spectrum(level_db(record, offset), rate, lines, q=10.0),
        )
        for i, offset in enumerate(OFFSETS_DB)
    )
    tolerance = np.full(lines.size, 6.0)
    target = Target(lines, base.maximax, tolerance, tolerance)
    maximax = np.stack([part.spectrum.maximax for part in spectra])
    bands = tuple(
        ReferenceBand(db, level_db(base.maximax, -db), level_db(base.maximax, db))
        for db in (3.0, 6.0)
    )
    comparison = compare(maximax, lines, target)
    return SpectrumOverlay(lines, spectra, target, bands, comparison, ())


def curves_of(plot):
    return [own for own in plot.series if isinstance(own, LineSeries) and own.name[:3] == "imp"]


def test_differences_are_those_that_the_spectra_were_made_with(overlay):
    plot = differences_plot(overlay)
    assert plot.y.unit == "dB"
    for curve, offset in zip(curves_of(plot), OFFSETS_DB, strict=True):
        np.testing.assert_allclose(curve.y, offset, atol=1e-6)
    low, high = plot.limits("y")
    assert low < -12 and high > 12


def test_levels_and_differences_share_the_axis_of_frequency_and_the_names(overlay):
    grid = compared_figure(overlay)
    upper, lower = grid.plots()
    assert grid.share_x and upper.limits("x") == lower.limits("x")
    assert {own.name for own in curves_of(upper)} == {own.name for own in curves_of(lower)}
    for above, below in zip(curves_of(upper), curves_of(lower), strict=True):
        assert (above.role, above.dash) == (below.role, below.dash)


def test_the_narrow_band_is_darker_than_the_wide_one(overlay):
    for plot in (spectra_plot(overlay), differences_plot(overlay)):
        shades = {own.name: own.opacity for own in plot.series if isinstance(own, BandSeries)}
        assert list(shades) == ["±6 dB", "±3 dB"]  # the narrow one lies on the wide one
        assert shades["±3 dB"] > 2 * shades["±6 dB"]


def test_twelve_spectra_have_twelve_styles(overlay):
    for plot in (spectra_plot(overlay), four_coordinate_figure(overlay)):
        assert len({(own.role, own.dash) for own in curves_of(plot)}) == 12


def test_a_specification_has_its_own_tolerance_as_lines(overlay):
    level = overlay.reference.level_m_s2
    own = ReferenceBand(None, level_db(level, -6), level_db(level, 9))
    bands = (*overlay.bands, own)
    specified = SpectrumOverlay(
        overlay.frequency_hz, overlay.spectra, overlay.reference, bands, overlay.comparison, ()
    )
    edges = [
        own
        for own in differences_plot(specified).series
        if isinstance(own, LineSeries) and own.name == "specification's tolerance"
    ]
    assert [float(np.mean(edge.y)) for edge in edges] == pytest.approx([-6.0, 9.0])


def test_sides_are_two_curves_of_each_spectrum(overlay):
    names = [own.name for own in curves_of(spectra_plot(overlay, sides=True))]
    assert names[:2] == ["impact 1, plate positive", "impact 1, plate negative"]
    assert len(names) == 24


def test_the_spectrum_of_an_impact_is_its_maximax_in_g(overlay):
    (first, *_) = impact_spectra_plot(overlay).series
    assert isinstance(first, LineSeries)
    np.testing.assert_allclose(first.y, overlay.spectra[0].spectrum.maximax / G, rtol=1e-12)


def test_paper_has_equal_decades_and_lines_of_one_acceleration_and_one_displacement(overlay):
    """v = a / (2 pi f) falls and v = 2 pi f d rises by a decade per decade."""
    plot = four_coordinate_figure(overlay)
    assert plot.equal_decades
    rules = [own for own in plot.series if isinstance(own, LineSeries) and own.silent]
    accelerations = [own for own in rules if own.detail.endswith(" g")]
    displacements = [own for own in rules if own not in accelerations]
    assert accelerations and displacements
    for own in accelerations:
        level = 2 * np.pi * own.x * own.y / G
        np.testing.assert_allclose(level, float(own.detail.removesuffix(" g")), rtol=1e-9)
    units = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "nm": 1e-9}
    for own in displacements:
        number, unit = own.detail.split()
        length = own.y / (2 * np.pi * own.x)
        np.testing.assert_allclose(length, float(number) * units[unit], rtol=1e-9)


@pytest.mark.parametrize(
    "frame",
    [(91.0, 11_000.0, 0.4, 14.0), (100.0, 10_000.0, 0.1, 10.0), (20.0, 2_000.0, 0.05, 50.0)],
)
def test_names_of_the_paper_do_not_cover_each_other(frame):
    """On 125 px a decade a name of eight letters is .4 decades long and .11 high."""
    _, words = paper_lines(*frame)
    for number, word in enumerate(words):
        for near in words[:number]:
            along, across = abs(np.log10(word.x / near.x)), abs(np.log10(word.y / near.y))
            assert along >= 0.4 or across >= 0.11, (word.text, near.text)


def test_names_of_the_paper_stand_within_the_frame():
    _, words = paper_lines(100.0, 10_000.0, 0.1, 10.0)
    assert words
    for label in words:
        assert 100.0 <= label.x <= 10_000.0 and 0.1 <= label.y <= 10.0
