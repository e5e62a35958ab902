"""Pulses and spectra over each other, and the specifications that they are held against."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.app.operations.impacts.overlays import MOST_SPECTRA, pulse_overlay, spectrum_overlay
from pyroshock.app.operations.impacts.spectra import (
    MOST_BYTES,
    MOST_POINTS,
    source_name,
    target_from_upload,
)
from pyroshock.schema.campaigns import Campaign, Configuration
from pyroshock.schema.conditions import UnknownFieldError
from pyroshock.schema.configurations import configuration_id
from pyroshock.schema.impacts import ExtractionSettingsRow, Impact
from pyroshock.schema.known_factors import RunLevel
from pyroshock.schema.listings import Condition
from pyroshock.schema.series import encode
from pyroshock.schema.session import Writer, open_store
from pyroshock.signals.channel import Sensor
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from pyroshock.twin.chain import default_lines
from pyroshock.twin.srs.target import ramps
from pyroshock.twin.srs.target_csv import read_target
from support.stores.recorded import WHEN, add_recording, pulse_row

#: tip radius (m; None: not recorded), peak (N), contact time (s)
MADE = (
    (0.03, 100.0, 1e-3), (0.03, 300.0, 1e-3), (0.03, 200.0, 1e-3), (0.015, 500.0, 2e-3), (0.015,
    500.0, 0.5e-3),
    (None, 50.0, 1e-3),
)  # fmt: skip


def half_sine(share):
    return np.sin(np.pi * np.clip(share, 0, 1))


@pytest.fixture(scope="module")
def pulse_store(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('overlay') / 'lab.db'}"
    with open_store(url, Writer("test", "0"), create=True) as pulse_store:
        with pulse_store.writing() as session:
            session.add(Campaign(id=1, name="c", kind="hammer", date=WHEN.date(), fingerprint="c"))
            session.add(ExtractionSettingsRow(id=1, fingerprint="1", code_version=1, settings={}))
            for key, (radius, peak, contact) in enumerate(MADE, 1):
                levels = [RunLevel("tip_material", "steel")]
                levels += (
                    [] if radius is None else [RunLevel("tip_radius", repr(radius), radius, "m")]
                )
                configuration = configuration_id(session, levels)
                session.add(
                    Impact(
                        id=key, campaign_id=1, run=key, repetition=1, configuration_id=configuration
                    )
                )
                session.flush()
                curve = encode(peak * half_sine(np.linspace(0, 1, 401)))
                session.add(pulse_row(key, contact_time_s=contact, fine_period_s=contact / 400,
                peak_force_n=peak,
                                      fine_force_n=curve))  # fmt: skip
        yield pulse_store


def pulses_over(pulse_store, factor="tip_radius", where=(), campaign="c", **named):
    with pulse_store.reading() as session:
        return pulse_overlay(session, campaign, where, factor, **named)


def test_pulses_are_grouped_by_level_with_mean_and_deviation(pulse_store):
    overlay = pulses_over(pulse_store)
    assert [(group.level, group.count) for group in overlay.groups] == [
        (0.015, 2),
        (0.03, 3),
        (None, 1),
    ]
    assert [group.impacts for group in overlay.groups] == [(4, 5), (1, 2, 3), (6,)]
    assert (overlay.factor, overlay.drawn, overlay.matching, overlay.thinned) == (
        "tip_radius_m",
        6,
        6,
        False,
    )
    overlay = pulses_over(pulse_store, points=101)
    group, shape = overlay.groups[1], half_sine(overlay.axis / 1e-3)
    np.testing.assert_allclose(group.mean_n, 200 * shape, atol=0.05)
    np.testing.assert_allclose(group.deviation_n, 100 * shape, atol=0.05)
    assert np.isnan(overlay.groups[2].deviation_n).all()


def test_axis_is_time_or_the_share_of_the_contact(pulse_store):
    overlay = pulses_over(pulse_store, points=201)
    assert (overlay.normalised, overlay.axis[0], overlay.axis[-1]) == (False, 0.0, 2e-3)
    long, short = overlay.groups[0].force_n
    np.testing.assert_allclose(long, 500 * half_sine(overlay.axis / 2e-3), atol=0.1)
    assert (short[overlay.axis > 0.5e-3] == 0).all() and short.max() == pytest.approx(
        500.0, rel=1e-3
    )
    overlay = pulses_over(pulse_store, points=51, normalised=True)
    assert (overlay.normalised, overlay.axis[-1]) == (True, 1.0)
    long, short = overlay.groups[0].force_n
    np.testing.assert_allclose(long, short, atol=1e-9)
    np.testing.assert_allclose(long, 500 * half_sine(overlay.axis), atol=0.1)
    np.testing.assert_allclose(overlay.groups[0].deviation_n, 0, atol=1e-9)


def test_pulses_are_thinned_filtered_and_counted_by_a_known_factor(pulse_store):
    overlay = pulses_over(pulse_store, most=3)
    assert (overlay.drawn, overlay.matching, overlay.thinned) == (3, 6, True)
    assert sum(group.count for group in overlay.groups) == 3
    where = (Condition("peak_force_n", ">", 150.0),)
    assert pulses_over(pulse_store, where=where, campaign=None).matching == 4
    none = pulses_over(pulse_store, where=(Condition("peak_force_n", ">", 1e9),))
    assert (none.groups, none.drawn, none.matching) == ((), 0, 0)
    with pytest.raises(UnknownFieldError, match=r"'colour'.*tip_material, tip_radius"):
        pulses_over(pulse_store, "colour")
    with pytest.raises(ValueError, match="points is 1"):
        pulses_over(pulse_store, points=1)


# --- spectra of impacts over each other: each the one that its record has alone, and the bands
# about them -----------
RATE, SAMPLES = 50_000.0, 5000
PLATE = Sensor("plate", "acceleration", "m/s2", position="plate")
HEAD = Sensor("head", "acceleration", "m/s2", position="hammer head")
FORCE = Sensor("force", "force", "N")


def ringing(at_s, amplitude):
    """A decaying 1 kHz ringing that begins at `at_s`."""
    time = np.arange(SAMPLES) / RATE - at_s
    return np.where(time > 0, amplitude * np.exp(-200 * time) * np.sin(2e3 * np.pi * time), 0.0)


@pytest.fixture(scope="module")
def spectrum_store(tmp_path_factory):
    """Impacts 1 and 2 alone in their recordings, the second twice as loud; 3 and 4 together in one;
    5 without any."""
    url = f"sqlite:///{tmp_path_factory.mktemp('spectra') / 'lab.db'}"
    with open_store(url, Writer("test", "0"), create=True) as spectrum_store:
        first_recording, _ = add_recording(
            spectrum_store, {PLATE: 3.0 + ringing(0.02, 100.0), FORCE: ringing(0.02, 1.0)}, RATE
        )
        two, _ = add_recording(
            spectrum_store, {PLATE: ringing(0.02, 200.0), HEAD: np.zeros(SAMPLES)}, RATE
        )
        both, _ = add_recording(
            spectrum_store, {PLATE: ringing(0.02, 100.0) + ringing(0.06, 400.0)}, RATE
        )
        none, _ = add_recording(spectrum_store, {FORCE: ringing(0.02, 1.0)}, RATE)
        with spectrum_store.writing() as session:
            session.add(Configuration(id=1, fingerprint="1"))
            session.add(ExtractionSettingsRow(id=1, fingerprint="1", code_version=1, settings={}))
            session.flush()
            hits = ((first_recording, 0.02), (two, 0.02), (both, 0.02), (both, 0.06), (none, 0.02))
            for key, (recording, start) in enumerate(hits, 1):
                own = {"campaign_id": 1, "configuration_id": 1, "recording_id": recording}
                session.add(Impact(id=key, run=key, repetition=1, **own))
                session.flush()
                session.add(pulse_row(key, start_s=start))
        yield spectrum_store


def spectra_over(spectrum_store, *impacts, **named):
    with spectrum_store.reading() as session:
        return spectrum_overlay(session, impacts, **named)


def test_spectrum_is_the_records_own_and_of_the_oscillators_asked_for(spectrum_store):
    overlay = spectra_over(spectrum_store, 1)
    (alone,) = overlay.spectra
    expected = shock_response_spectrum(ringing(0.02, 100.0), RATE, default_lines(), q=10.0)
    assert (alone.impact, alone.channel) == (1, "plate")
    np.testing.assert_array_equal(overlay.frequency_hz, default_lines())
    for name in ("maximax", "positive", "negative", "pseudo_velocity_m_s"):
        np.testing.assert_allclose(
            getattr(alone.spectrum, name), getattr(expected, name), rtol=1e-9
        )
    sharp, blunt = (
        spectra_over(spectrum_store, 1, q=q).spectra[0].spectrum.maximax.max() for q in (50.0, 5.0)
    )
    assert sharp > 1.5 * blunt
    spectra = spectra_over(spectrum_store, 1, frequency_hz=np.array([100.0, 1000.0, 30_000.0]))
    np.testing.assert_array_equal(spectra.frequency_hz, [100.0, 1000.0])


def test_spectra_are_compared_with_one_of_them(spectrum_store):
    """The second record is the first twice as loud: 6.02 dB above it."""
    overlay = spectra_over(spectrum_store, 1, 2, channel="plate", reference=1)
    np.testing.assert_allclose(overlay.comparison.error_db[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(overlay.comparison.error_db[1], 6.0206, atol=1e-4)
    with pytest.raises(ValueError, match="impact 5 has no spectrum to compare with"):
        spectra_over(spectrum_store, 1, 5, reference=5)


def test_spectra_are_held_against_their_mean_in_decibels_or_a_specification(spectrum_store):
    overlay = spectra_over(spectrum_store, 1, 2, channel="plate")
    quiet, loud = (spectrum_of_channel.spectrum.maximax for spectrum_of_channel in overlay.spectra)
    np.testing.assert_allclose(loud, 2 * quiet, rtol=1e-9)
    np.testing.assert_allclose(overlay.reference.level_m_s2, np.sqrt(2) * quiet, rtol=1e-9)
    np.testing.assert_allclose(
        overlay.comparison.error_db, [[-3.0103] * quiet.size, [3.0103] * quiet.size], atol=1e-4
    )
    assert [band.db for band in overlay.bands] == [3.0, 6.0]
    for band in overlay.bands:
        level = overlay.reference.level_m_s2
        np.testing.assert_allclose(20 * np.log10(band.upper_m_s2 / level), band.db)
        np.testing.assert_allclose(20 * np.log10(band.lower_m_s2 / level), -band.db)
    assert overlay.comparison.within.all()
    specification = ramps(500.0, 10.0, (2000.0, 0.0))
    overlay = spectra_over(spectrum_store, 1, specification=specification)
    assert overlay.reference is specification
    assert (
        overlay.comparison.frequency_hz.min() >= 500
        and overlay.comparison.frequency_hz.max() <= 2000
    )
    assert [band.db for band in overlay.bands] == [3.0, 6.0, None]
    np.testing.assert_allclose(overlay.bands[2].upper_m_s2, 10 * 10**0.3, rtol=1e-9)
    assert not overlay.comparison.within.any()


def test_hits_of_one_recording_do_not_hear_each_other_and_silent_channels_are_told(spectrum_store):
    overlay = spectra_over(spectrum_store, 3, 4)
    first, second = overlay.spectra
    assert first.stop_s < second.start_s + 1e-9 < 0.06 <= second.start_s + 10.1e-3
    at = int(np.argmin(np.abs(overlay.frequency_hz - 1000)))
    expected = shock_response_spectrum(
        ringing(0.02, 100.0), RATE, overlay.frequency_hz, q=10.0
    ).maximax[at]
    assert first.spectrum.maximax[at] == pytest.approx(expected, rel=0.01)
    assert second.spectrum.maximax[at] == pytest.approx(4 * expected, rel=0.01)
    overlay = spectra_over(spectrum_store, 2, 5)
    assert [spectrum_of_channel.channel for spectrum_of_channel in overlay.spectra] == ["plate"]
    assert overlay.left_out == (
        "impact 5: no acceleration was recorded",
        "impact 2: head is silent",
    )


@pytest.mark.parametrize(("impacts", "named", "kind", "said"), [
    ((5,), {}, ValueError,
     "no acceleration of these impacts has a spectrum: impact 5: no acceleration"),
    ((1,), {"channel": "roof"}, ValueError, "impact 1: no acceleration 'roof' was recorded"),
    ((), {}, ValueError, "0 impacts"),
    (range(MOST_SPECTRA + 1), {}, ValueError, f"expected 1 to {MOST_SPECTRA}"),
    ((99,), {}, LookupError, "no impact 99"),
    ((1,), {"frequency_hz": np.array([30_000.0])}, ValueError, "half the sampling rate"),
])  # fmt: skip
def test_nothing_to_show_says_why(spectrum_store, impacts, named, kind, said):
    with pytest.raises(kind, match=said):
        spectra_over(spectrum_store, *impacts, **named)


# --- uploaded specifications: read as a file is, and refused with file, line and value
# ------------------------------
SPEC = "frequency_hz,level_g,tolerance_db\n100,5,6\n1000,50,6\n10000,50,9\n"


def test_upload_is_what_the_file_is(tmp_path):
    (tmp_path / "spec.csv").write_text(SPEC, encoding="utf-8")
    file, upload = read_target(tmp_path / "spec.csv"), target_from_upload(SPEC, "spec.csv")
    for name in ("frequency_hz", "level_m_s2", "upper_db", "lower_db"):
        np.testing.assert_array_equal(getattr(upload, name), getattr(file, name))
    assert upload.level_m_s2[0] == pytest.approx(5 * 9.80665)
    made = target_from_upload(SPEC.encode(), "spec.csv", "+9/-3dB")  # goes before the file's
    assert (set(made.upper_db), set(made.lower_db)) == ({9.0}, {3.0})
    with pytest.raises(ValueError, match="tolerance is 'six'"):
        target_from_upload(SPEC, "spec.csv", "six")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            SPEC.replace("50,6", "loud,6"),
            r"spec.csv, line 3: level_g is 'loud'; expected a positive number",
        ),
        (SPEC.replace("1000,", "-1000,"), r"spec.csv, line 3: frequency_hz is '-1000'"),
        (
            SPEC.replace("10000,", "1e9,"),
            r"spec.csv: frequency_hz is 1e\+09; expected 0.01 to 1e\+06 Hz",
        ),
        (SPEC.replace(",tolerance_db", ""), r"spec.csv, line 2: 3 fields; expected 2"),
        ("", "spec.csv: is empty"),
        (b"\xff\xfe\x00", "spec.csv: no CSV table in UTF-8: byte 0 is not UTF-8"),
        (
            "frequency_hz,level_g\n" + "x" * 200_000 + ",1\n2,1\n",
            "spec.csv: no CSV table in UTF-8: row 2: field larger",
        ),
        (
            "frequency_hz,level_g,slope_db_per_octave\n1,1,\n100000,,99999\n",
            r"line 3: slope_db_per_octave is '99999'",
        ),
        (
            "#" * (MOST_BYTES + 1),
            f"{MOST_BYTES + 1} bytes; expected a specification of at most {MOST_BYTES}",
        ),
    ],
    ids=["level", "frequency", "range", "fields", "empty", "encoding", "field", "slope", "size"],
)
def test_what_is_wrong_is_named_with_line_and_value(content, said):
    with pytest.raises(ValueError, match=said):
        target_from_upload(content, "spec.csv")


def test_too_many_points_are_refused_and_a_name_is_no_path():
    rows = "".join(f"{100 + i},1\n" for i in range(MOST_POINTS + 1))
    with pytest.raises(
        ValueError, match=f"{MOST_POINTS + 1} points; expected at most {MOST_POINTS}"
    ):
        target_from_upload("frequency_hz,level_g\n" + rows, "spec.csv", "6dB")
    texts = {
        "../../etc/spec.csv": "spec.csv",
        "C:\\lab\\spec.csv": "spec.csv",
        "a\nb.csv": "ab.csv",
        "": "specification",
    }
    assert {given: source_name(given) for given in texts} == texts


@given(st.one_of(st.text(max_size=300), st.binary(max_size=300)), st.booleans())
@settings(max_examples=300)
def test_any_content_is_read_or_refused(content, with_header):
    head = "frequency_hz,level_g,slope_db_per_octave,upper_db\n100,1,,3\n"
    if with_header:
        content = head + content if isinstance(content, str) else head.encode() + content
    try:
        target = target_from_upload(content, "spec.csv")
    except ValueError as error:
        assert str(error)
    else:
        assert np.isfinite(target.level_m_s2).all() and target.lines().size >= 1
