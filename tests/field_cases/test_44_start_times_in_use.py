"""Field case 44 and its kind: wherever channels are taken together, each is taken at the moment
that its start says."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from pyroshock.ingest.extraction.channels import total_force
from pyroshock.ingest.extraction.common_grid import GridError, delayed, on_one_grid
from pyroshock.ingest.extraction.record_checks import check_recording, contacts_on
from pyroshock.ingest.extraction.recording import extract_recording, hits_of
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.readers import RecordingError
from pyroshock.schema.impacts import Pulse
from pyroshock.schema.recordings import QualityFinding
from pyroshock.schema.session import Writer, open_store
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.checks import Contact
from sqlalchemy import select

RATE = 51_200.0
#: Frequency (Hz) and damping ratio of a plate's modes, gain at two sensors (1/kg); the first is the
#: plate as a whole.
MODES = (
    (0.0, 0.0, 0.05, 0.05),
    (620.0, 0.03, 0.10, -0.07),
    (1740.0, 0.03, -0.08, 0.09),
    (4300.0, 0.02, 0.06, 0.07),
)
LATE = [0.0, 16.0, 7.37, -0.5, 2048.0, -300.25]


def acceleration(time_s, event, sensor):
    """Of the plate under a force peak * sin^2 at times (n,): of each mode on a grid eight times
    finer."""
    start_s, duration_s, peak_n = event
    fine = 8
    grid = np.arange(time_s[0] * RATE * fine, time_s[-1] * RATE * fine + 1) / (RATE * fine)
    phase = (grid - start_s) / duration_s
    force = np.where((phase > 0) & (phase < 1), peak_n * np.sin(np.pi * phase) ** 2, 0.0)
    total = np.zeros_like(grid)
    for frequency, zeta, *gains in MODES:
        if frequency == 0.0:
            total += gains[sensor] * force
            continue
        from scipy.signal import cont2discrete, lfilter

        omega = 2 * np.pi * frequency
        b, a, _ = cont2discrete(
            ([1.0, 0.0, 0.0], [1.0, 2 * zeta * omega, omega**2]), 1 / (RATE * fine), "foh"
        )
        total += gains[sensor] * lfilter(b.ravel(), a, force)
    return total[::fine][: time_s.size]


def write(path, channels):
    """Each channel is (samples, start in s), as an HDF5 file has it in attributes."""
    with h5py.File(path, "w") as file:
        for name, (samples, start_s) in channels.items():
            file[name] = samples
            file[name].attrs.update({"sampling_rate_hz": RATE, "start_s": start_s})


def record(samples, start_s, event, sensor):
    return acceleration(start_s + np.arange(samples) / RATE, event, sensor), start_s


TOML = """\
[campaign]
name = "derived"
date = "2026-03-02"
kind = "gun"
[channels.acc_1]
quantity = "acceleration"
unit = "m/s2"
position = "plate"
[channels.acc_2]
quantity = "acceleration"
unit = "m/s2"
position = "plate"
[force]
from = ["acc_1", "acc_2"]
transfer_function = "hammer.h5"
"""


def hammer(path, late):
    """Four hits of 0.2 ms, 0.4 s apart; the accelerometers begin `late` samples after the force."""
    samples, hits = round(1.8 * RATE), [0.1 + 0.4 * i for i in range(4)]
    time_s = np.arange(samples) / RATE
    phases = [(time_s - hit) / 0.2e-3 for hit in hits]
    force = sum(np.where((p > 0) & (p < 1), 3000 * np.sin(np.pi * p) ** 2, 0.0) for p in phases)
    noise = np.random.default_rng(1)
    channels = {"force": (force + noise.normal(size=samples) * 0.1, 0.0)}
    for sensor in range(2):
        parts = [record(samples, late / RATE, (hit, 0.2e-3, 3000.0), sensor)[0] for hit in hits]
        channels[f"acc_{sensor + 1}"] = sum(parts) + noise.normal(size=samples) * 0.05, late / RATE
    write(path, channels)


@pytest.fixture
def store(sqlite_url):
    with open_store(sqlite_url, Writer("test", "0"), create=True) as store:
        yield store


@pytest.mark.parametrize(
    ("late", "hammer_late"), [(0.0, 0.0), (16.0, 0.0), (7.37, 0.0), (-40.5, 0.0), (16.0, 9.25)]
)
def test_derived_force_of_channels_that_start_at_different_times(
    store, tmp_path, late, hammer_late
):
    """8 kN for 0.7 ms as sin^2: 2.8 N s, and a tenth of the peak is passed at asin(sqrt(0.1)) / pi
    of its length."""
    event = (0.02, 0.7e-3, 8000.0)
    samples = 16384
    noise = np.random.default_rng(2)
    channels = {}
    for sensor, offset in enumerate((0.0, late)):
        values, start_s = record(samples, offset / RATE, event, sensor)
        channels[f"acc_{sensor + 1}"] = values + noise.normal(size=samples) * 0.2, start_s
    write(tmp_path / "shot.h5", channels)
    hammer(tmp_path / "hammer.h5", hammer_late)
    (tmp_path / "campaign.toml").write_text(TOML)
    (tmp_path / "runs.csv").write_text(
        "run,repetition,bullet_mass_kg,tank_pressure_bar,recording\n1,1,0.5,2.0,shot.h5\n"
    )
    ingest_folder(store, tmp_path, jobs=1)
    with store.reading() as session:
        pulse = session.scalars(select(Pulse)).one()
        finding = next(
            f for f in session.scalars(select(QualityFinding)) if f.check == "derived-force"
        )
        assert pulse.peak_force_n == pytest.approx(8000, rel=0.02)
        assert pulse.impulse_n_s == pytest.approx(2.8, rel=0.02)
        assert pulse.width_tenth_s == pytest.approx(
            0.7e-3 * (1 - 2 * np.arcsin(np.sqrt(0.1)) / np.pi), rel=0.04
        )
        assert pulse.start_s == pytest.approx(0.02, abs=0.1e-3)
        assert finding.severity == "note"


def tones(time_s, share=0.9):
    """Sines up to a share of the Nyquist frequency."""
    rng = np.random.default_rng(44)
    frequency, phase = rng.uniform(0.0, share * RATE / 2, 20), rng.uniform(0, 6.3, 20)
    return np.sum(np.sin(2 * np.pi * frequency[:, None] * time_s + phase[:, None]), axis=0)


def channel(
    name,
    start_s,
    quantity="acceleration",
    unit="m/s2",
    samples=4096,
    signal=tones,
    rate=RATE,
    **where,
):
    return Channel(
        Sensor(name, quantity, unit, **where),
        signal(start_s + np.arange(samples) / rate),
        rate,
        start_s,
    )


@pytest.mark.parametrize("late", LATE)
def test_one_grid_has_every_channel_at_its_own_moments(late):
    grid = on_one_grid([channel("a", 0.25), channel("b", 0.25 + late / RATE)])
    time_s = grid.start_s + np.arange(grid.values.shape[1]) / RATE
    inner = slice(33, -33)
    assert np.array_equal(
        grid.values[0], channel("a", 0.25).si[grid.first : grid.first + time_s.size]
    )
    error = np.abs(grid.values[1] - tones(time_s))[inner].max() / np.abs(tones(time_s)).max()
    assert error < (1e-9 if late == round(late) else 1e-4)
    assert time_s.size == 4096 - int(np.ceil(abs(late) - 0.5))


@pytest.mark.parametrize("delay", [-0.5, -0.123, 0.3, 0.5])
def test_delay_is_band_limited(delay):
    n = np.arange(2000.0)
    for share in (0.01, 0.3, 0.6, 0.9):
        moved = delayed(np.sin(np.pi * share * n), delay)
        assert np.abs(moved - np.sin(np.pi * share * (n - delay)))[40:-40].max() < 1e-4
    assert np.allclose(delayed(np.full(100, 3.5), delay), 3.5)


def test_channels_without_a_common_moment_or_rate_are_refused():
    with pytest.raises(
        GridError, match=r"no moment in common: 'a' from 0 to 0\.08 s, 'b' from 1 to 1\.08 s"
    ):
        on_one_grid([channel("a", 0.0), channel("b", 1.0)])
    with pytest.raises(
        GridError, match="'a' is recorded at 51200 Hz and 'b' at 25600 Hz; record them at one rate"
    ):
        on_one_grid([channel("a", 0.0), channel("b", 0.0, rate=RATE / 2)])


def half_sine(time_s):
    phase = (time_s - 0.04) / 1e-3
    return np.where((phase > 0) & (phase < 1), 1000 * np.sin(np.pi * phase), 0.0)


@pytest.mark.parametrize("late", [0.0, 8.0, 3.4, -200.6])
def test_cells_of_an_array_are_added_at_the_same_moment(late):
    cells = [
        channel("cell_1", 0.0, "force", "N", signal=lambda t: 0.6 * half_sine(t)),
        channel("cell_2", late / RATE, "force", "N", signal=lambda t: 0.4 * half_sine(t)),
    ]
    total, clock = total_force(cells)
    time_s = clock.start_s + np.arange(total.size) / RATE
    assert np.abs(total - half_sine(time_s)).max() < (
        1e-9 if late == round(late) else 5.0
    )  # the corner rings
    (pulse,) = hits_of(cells, ExtractionSettings(), 1).pulses
    assert pulse.start_s == pytest.approx(0.04, abs=2 / RATE)
    assert pulse.peak_force_n == pytest.approx(1000, rel=2e-3)


def test_cells_without_a_common_moment_are_refused():
    cells = [
        channel(name, start, "force", "N") for name, start in (("cell_1", 0.0), ("cell_2", 5.0))
    ]
    with pytest.raises(
        RecordingError,
        match="force channels cannot be added: the channels have no moment in common",
    ):
        total_force(cells)


def test_contacts_are_moved_to_the_clock_of_each_channel():
    force = channel("force", 0.0, "force", "N")
    contacts = [Contact(100, 110, 130), Contact(1000, 1010, 1030), Contact(4000, 4010, 4030)]
    assert contacts_on(channel("a", 0.0), force, contacts) == list(enumerate(contacts))
    late = channel("a", 500 / RATE, samples=1000)
    assert contacts_on(late, force, contacts) == [(1, Contact(500, 510, 530))]
    slow = channel("a", -0.01, rate=RATE / 4, samples=1000)
    assert contacts_on(slow, force, contacts)[1] == (1, Contact(378, 380, 386))


def test_finding_in_a_contact_is_that_contacts():
    """Three samples are missing from an acceleration within the second contact, by its own
    clock."""
    hits = [0.05, 0.25, 0.45]

    def force(t):
        return sum(half_sine(t - hit + 0.04) for hit in hits)

    start_s = 0.2
    at = round((hits[1] + 0.5e-3 - start_s) * RATE)
    acceleration = Channel(
        Sensor("acc", "acceleration", "m/s2"), np.random.default_rng(3).normal(size=5000), RATE,
        start_s,
        {"time_gaps": [[at, 3]]},
    )  # fmt: skip
    channels = [channel("force", 0.0, "force", "N", samples=30000, signal=force), acceleration]
    findings = check_recording(channels, hits_of(channels, ExtractionSettings(), 3))
    (gap,) = [
        f
        for f in findings
        if f.channel == "acc" and f.check == "dropouts" and f.evidence["kind"] == "gap"
    ]
    assert (gap.contact, gap.severity) == (1, "reject")


@pytest.mark.parametrize("late", [0.0, 25.0, -12.4])
def test_impact_velocity_is_that_of_the_contact(tmp_path, late):
    """The impactor's deceleration is the force over its mass of 0.5 kg; it stands still at the
    peak."""

    def at(start_s, scale=1.0):
        return (
            scale * half_sine(start_s + np.arange(6000) / RATE)
            + np.random.default_rng(5).normal(size=6000) * 1e-3
        )

    write(
        tmp_path / "hit.h5", {"force": (at(0.0), 0.0), "head": (at(late / RATE, -2.0), late / RATE)}
    )
    sensors = {
        "force": Sensor("force", "force", "N"),
        "head": Sensor("head", "acceleration", "m/s2", position="impactor"),
    }
    processed = extract_recording(tmp_path, "hit.h5", sensors, ExtractionSettings(), expected=1)
    assert not [f for f in processed.findings if f.check in ("delay", "no-impact-velocity")]
    assert processed.speeds[0].velocity_m_s == pytest.approx(2.0 * 1000 * 1e-3 / np.pi, rel=0.01)


def test_impactor_recorded_after_the_contact_gives_no_velocity(tmp_path):
    time_s = np.arange(6000) / RATE
    write(
        tmp_path / "hit.h5", {"force": (half_sine(time_s), 0.0), "head": (half_sine(time_s), 0.06)}
    )
    sensors = {
        "force": Sensor("force", "force", "N"),
        "head": Sensor("head", "acceleration", "m/s2", position="impactor"),
    }
    processed = extract_recording(tmp_path, "hit.h5", sensors, ExtractionSettings(), expected=1)
    assert processed.speeds == (None,)
    assert any("in which not all contacts are" in f.message for f in processed.findings)
