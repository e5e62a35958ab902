"""An impact's channels on one axis of time: every peak, the samples of the contact, and findings at
the times that their evidence names."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from pyroshock.app.figures.figure import ColourRole
from pyroshock.app.operations.impacts.finding_places import (
    PlacedFinding,
    RecordPlace,
    evidence_places,
    list_placed_findings,
)
from pyroshock.app.operations.impacts.impact import list_signals
from pyroshock.app.operations.impacts.record_strips import record_strips
from pyroshock.schema.campaigns import Configuration
from pyroshock.schema.impacts import ExtractionSettingsRow, Impact
from pyroshock.schema.recordings import QualityFinding, SeriesChunk
from pyroshock.schema.session import Writer, open_store
from pyroshock.signals.channel import Sensor
from sqlalchemy import update
from support.stores.recorded import add_recording, pulse_row

RATE, START_S, SAMPLES = 100_000.0, -0.25, 50_000
G = 9.80665
#: Begin of the contact and its length, and the window about it.
CONTACT = (-0.05, -0.049)
WINDOW = (-0.051, -0.047)


@pytest.fixture(scope="module")
def recorded():
    noise = np.random.default_rng(2).normal(size=SAMPLES)
    noise[123], noise[45_678] = 500.0, -700.0
    return noise


@pytest.fixture(scope="module")
def store(tmp_path_factory, recorded):
    url = f"sqlite:///{tmp_path_factory.mktemp('strips') / 'lab.db'}"
    with open_store(url, Writer("test", "0"), create=True) as store:
        sensors = {
            Sensor("laser", "displacement", "mm", position="muzzle"): recorded,
            Sensor("shock", "acceleration", "g", position="plate"): recorded,
            Sensor("force", "force", "kN"): recorded,
        }
        recording, channels = add_recording(store, sensors, RATE, START_S)
        with store.writing() as session:
            session.add(ExtractionSettingsRow(id=1, fingerprint="1", code_version=1, settings={}))
            session.add(Configuration(id=1, fingerprint="f"))
            session.flush()
            session.add(
                Impact(
                    id=1,
                    campaign_id=1,
                    run=1,
                    repetition=1,
                    configuration_id=1,
                    recording_id=recording,
                )
            )
            session.flush()
            session.add(pulse_row(1, start_s=CONTACT[0], contact_time_s=1e-3))
            findings = [
                ("saturation", "reject", channels["shock"], 1, {"first_time_s": -0.0495,
                "longest_s": 3e-5, "runs": 1}),
                ("few-samples", "warning", channels["force"], 1, {"samples": 4}),
                ("velocity", "note", channels["shock"], None, {"velocity_ratio": 1.7}),
            ]  # fmt: skip
            for check, severity, channel, impact, evidence in findings:
                session.add(
                    QualityFinding(
                        recording_id=recording,
                        channel_id=channel,
                        impact_id=impact,
                        check=check,
                        severity=severity,
                        message=f"{check} was found",
                        evidence=evidence,
                    )
                )
        store.recording = recording  # type: ignore[attr-defined]  # for the tests
        store.channels = channels  # type: ignore[attr-defined]  # for the tests
        yield store


def strips_of(store, window=WINDOW, findings=()):
    with store.reading() as session:
        signals = list_signals(session, store.recording)
        return record_strips(session, signals, CONTACT, window, findings)


def test_every_channel_has_one_axis_of_time_and_opens_with_the_contact(store):
    strips = strips_of(store)
    plots = list(strips.figure.plots())
    assert strips.figure.share_x
    assert [plot.title for plot in plots] == ["force", "shock, plate", "laser, muzzle"]
    end_ms = 1e3 * (START_S + (SAMPLES - 1) / RATE)
    for plot in plots:
        assert plot.limits("x") == pytest.approx((1e3 * START_S, end_ms))
        assert plot.x.first_view == pytest.approx((-51.0, -47.0))
        assert [line.at for line in plot.reference_lines] == pytest.approx([-50.0, -49.0])
    assert [plot.y.unit for plot in plots] == ["kN", "g", "mm"]


def test_the_window_has_every_sample_and_the_rest_keeps_its_peaks(store, recorded):
    strips = strips_of(store)
    assert strips.exact == (True, True, True)
    time_ms = 1e3 * (START_S + np.arange(SAMPLES) / RATE)
    inside = (time_ms >= -51 - 1e-9) & (time_ms <= -47 + 1e-9)
    for plot in strips.figure.plots():
        (curve,) = plot.series
        shown = (curve.x >= -51 - 1e-9) & (curve.x <= -47 + 1e-9)
        np.testing.assert_allclose(curve.y[shown], recorded[inside], rtol=1e-9)
        assert (np.diff(curve.x) > 0).all()
        assert (curve.y.max(), curve.y.min()) == pytest.approx((500.0, -700.0))
        assert curve.x.size < 1100


def test_without_a_contact_the_whole_record_is_shown(store):
    with store.reading() as session:
        signals = list_signals(session, store.recording)
        strips = record_strips(session, signals, None, None, ())
    for plot in strips.figure.plots():
        assert plot.x.first_view is None and not plot.reference_lines
    assert strips.exact == (False, False, False)
    assert all(bucket > 0 for bucket in strips.buckets_ms)


def test_findings_stand_in_the_strip_of_their_channel_at_their_time(store):
    with store.reading() as session:
        findings = list_placed_findings(session, 1)
    assert [finding.extent for finding in findings] == ["times", "contact", "record"]
    force, shock, laser = strips_of(store, findings=findings).figure.plots()
    (saturated,) = shock.regions
    assert (saturated.start, saturated.stop) == pytest.approx((-49.5, -49.47))
    assert saturated.mark == "1" and saturated.role == ColourRole.BAD
    assert saturated.text == "reject, saturation: saturation was found"
    (few,) = force.regions
    assert (few.start, few.stop) == pytest.approx((-50.0, -49.0))
    assert few.mark == "2" and few.role == ColourRole.WARN
    assert not laser.regions


def test_a_finding_of_one_sample_is_as_wide_as_a_sample(store):
    finding = PlacedFinding(
        "note", "double-hit", "force", "a second hit", "times", (RecordPlace(-0.04, -0.04),)
    )
    (force, *_) = strips_of(store, findings=[finding]).figure.plots()
    (region,) = force.regions
    assert (region.start, region.stop) == pytest.approx((-40.005, -39.995))


@pytest.mark.parametrize(
    ("evidence", "places"),
    [
        ({"first_time_s": 0.2, "longest_s": 0.01, "runs": 1}, [(0.2, 0.21)]),
        ({"first_time_s": 0.2, "longest_s": 0.01, "runs": 7}, [(0.2, 0.2)]),
        ({"start_s": 0.3}, [(0.3, 0.3)]),
        ({"second_sample": 1000, "delay_s": 0.001}, [(-0.24, -0.24)]),
        ({"left_out": [{"time_s": 0.4}, {"time_s": 0.5}]}, [(0.4, 0.4), (0.5, 0.5)]),
        ({"shift_n": 3.0, "samples_at": [1, 2]}, []),
    ],
)
def test_times_of_evidence_are_read_as_the_checks_write_them(evidence, places):
    channel = SimpleNamespace(start_s=START_S, sampling_rate_hz=RATE)
    read_places = evidence_places(evidence, channel)
    assert [(place.start_s, place.stop_s) for place in read_places] == [
        pytest.approx(pair) for pair in places
    ]


def test_a_damaged_channel_keeps_no_other_from_being_drawn(store):
    with store.reading() as session:
        key = store.channels["laser"]
        session.connection().execute(
            update(SeriesChunk).where(SeriesChunk.channel_id == key).values(frame=b"damaged")
        )
        strips = record_strips(session, list_signals(session, store.recording), CONTACT, WINDOW, ())
        session.rollback()
    assert list(strips.damaged) == ["laser"]
    assert [signal["channel"] for signal in strips.signals] == ["force", "shock"]
