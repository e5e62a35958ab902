"""The gun's force from the plate's accelerations: a plate of known modes, struck by known
forces."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.schema.listings import iter_shots
from pyroshock.schema.recordings import QualityFinding, RecordedChannel
from sqlalchemy import select
from support.records.campaigns import write_folder

RATE = 51_200.0
#: Frequency (Hz), damping ratio and shape at the impact point and at two sensors (1/sqrt(kg)) of a
#: free plate's modes; the first is its motion as a whole, 20 kg.
MODES = (
    (0.0, 0.0, 0.2236, 0.2236, 0.2236),
    (310.0, 0.02, 0.31, 0.22, -0.27),
    (742.0, 0.015, -0.24, 0.30, 0.12),
    (1290.0, 0.02, 0.28, -0.21, 0.33),
    (2630.0, 0.02, 0.19, 0.27, -0.22),
    (4410.0, 0.015, -0.26, 0.18, 0.25),
    (7350.0, 0.02, 0.22, -0.16, 0.21),
)
TOML = (
    '[campaign]\nname = "shots"\nkind = "gun"\ndate = "2026-03-03"\n'
    '[channels.acc_1]\nquantity = "acceleration"\nunit = "m/s2"\nposition = "A"\n'
    '[channels.acc_2]\nquantity = "acceleration"\nunit = "m/s2"\nposition = "B"\n'
    '[force]\nfrom = ["acc_1", "acc_2"]\ntransfer_function = "hammer.npz"\n'
)


def acceleration(force, sensor):
    """Of the plate at a sensor under a force at the impact point: z'' = F - 2 zeta w z' - w^2 z of
    each mode, z and z' by convolution with the closed impulse response exp(-zeta w t) sin(w_d t) /
    w_d."""
    found = np.zeros_like(force)
    dt = 1 / RATE
    for frequency, zeta, impact, *sensors in MODES:
        gain = impact * sensors[sensor]
        if frequency == 0.0:
            found += gain * force
            continue
        omega = 2 * np.pi * frequency
        pole = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2)) * omega * dt)
        damped = omega * np.sqrt(1 - zeta**2)
        n = np.arange(int(14 / (zeta * omega) * RATE))
        h = (pole**n).imag / damped
        velocity = np.gradient(h, dt)
        response = (
            force
            - 2 * zeta * omega * _convolved(force, velocity) * dt
            - omega**2 * _convolved(force, h) * dt
        )
        found += gain * response
    return found


def _convolved(force, h):
    from scipy.signal import fftconvolve

    return fftconvolve(force, h)[: force.size]


def pulse(samples, start_s, duration_s, peak_n):
    """sin^2, whose spectrum ends soon after 2 / duration."""
    phase = (np.arange(samples) / RATE - start_s) / duration_s
    return np.where((phase > 0) & (phase < 1), peak_n * np.sin(np.pi * phase) ** 2, 0.0)


def recording(force, rng, noise_m_s2):
    return {
        f"acc_{i + 1}": acceleration(force, i) + rng.normal(size=force.size) * noise_m_s2
        for i in range(2)
    }


def hammer(rng, hits=5, duration_s=0.25e-3, band_noise=0.0):
    """Hits of 3 kN, a second apart."""
    force = sum(
        pulse(round((hits + 0.2) * RATE), 0.2 + i, duration_s, 3000.0 + 200 * i)
        for i in range(hits)
    )
    records = recording(force, rng, 0.3 + band_noise)
    return {"force": force + rng.normal(size=force.size) * 0.2, **records, "fs": RATE}


def campaign(folder, rng, shots, hammered=None, toml=TOML, columns="", values=""):
    """`shots`: (duration s, peak N) of each shot's force."""
    rows, recordings = [f"run,repetition,bullet_mass_kg,tank_pressure_bar,recording{columns}"], {}
    for i, (duration_s, peak_n) in enumerate(shots, 1):
        force = pulse(round(1.0 * RATE), 0.1, duration_s, peak_n)
        recordings[f"{i}.npz"] = {"fs": RATE, **recording(force, rng, 1.0)}
        rows.append(f"{i},1,0.5,2.0,{i}.npz{values}")
    recordings["hammer.npz"] = hammer(rng) if hammered is None else hammered
    return write_folder(folder, toml, rows, recordings)


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def findings(store):
    with store.reading() as session:
        return [f for f in session.scalars(select(QualityFinding)) if f.check == "derived-force"]


def test_force_comes_back_from_the_accelerations(store, rng, tmp_path):
    made = [(0.8e-3, 40_000.0), (0.5e-3, 90_000.0)]
    report = ingest_folder(store, campaign(tmp_path / "c", rng, made), jobs=1)
    assert (report.impacts, report.shots) == (2, 2)
    with store.reading() as session:
        pulses = list(
            session.scalars(select(Pulse).join(Impact).where(Pulse.current).order_by(Impact.run))
        )
        assert len(list(iter_shots(session, "shots"))) == 2
    for row, (duration_s, peak_n) in zip(pulses, made, strict=True):
        assert row.peak_force_n == pytest.approx(peak_n, rel=0.05)
        assert row.contact_time_s == pytest.approx(duration_s, rel=0.10)
        assert row.impulse_n_s == pytest.approx(peak_n * duration_s / 2, rel=0.05)
        # of sin^2, a tenth of the peak is passed at asin(sqrt(0.1)) / pi of its length
        assert row.width_tenth_s == pytest.approx(
            duration_s * (1 - 2 * np.arcsin(np.sqrt(0.1)) / np.pi), rel=0.10
        )


def test_derived_force_says_what_it_is_and_is_known_again(store, rng, tmp_path):
    folder = campaign(tmp_path / "c", rng, [(0.8e-3, 40_000.0)])
    for _ in range(2):
        assert ingest_folder(store, folder, jobs=1).impacts == 1
    with store.reading() as session:
        assert len(list(session.scalars(select(Impact)))) == 1
        channel = session.scalars(
            select(RecordedChannel).where(RecordedChannel.quantity == "force")
        ).one()
    assert channel.name == "force_derived"
    assert channel.header["derived_from"] == ["acc_1", "acc_2"]
    assert channel.header["transfer_function"] == "hammer.npz"
    (finding,) = findings(store)
    assert (finding.severity, finding.evidence["hits"]) == ("note", 5)
    assert finding.evidence["residual"] < 0.02
    assert "nobody states where" in finding.message


def test_pulse_above_the_known_band_is_refused_with_the_reason(store, rng, tmp_path):
    soft = hammer(rng, duration_s=2e-3, band_noise=5.0)
    report = ingest_folder(
        store, campaign(tmp_path / "c", rng, [(0.15e-3, 40_000.0)], soft), jobs=1
    )
    assert (report.impacts, report.shots) == (0, 1)
    (finding,) = findings(store)
    assert finding.severity == "reject"
    assert "hit with a harder tip" in finding.message


def test_stated_place_is_taken_and_a_shot_at_another_refused(store, rng, tmp_path):
    toml, shots = TOML + 'impact_position = "centre"\n', [(0.8e-3, 40_000.0)]
    folder = campaign(tmp_path / "c", rng, shots, None, toml, ",impact_position", ",edge")
    message = "impact_position is 'edge', force.impact_position of campaign.toml 'centre'"
    with pytest.raises(IngestError, match=message):
        ingest_folder(store, folder, jobs=1)
    ingest_folder(
        store,
        campaign(tmp_path / "d", rng, shots, None, toml, ",impact_position", ",centre"),
        jobs=1,
    )
    assert "nobody states where" not in findings(store)[0].message


@pytest.mark.parametrize("missing", ["acc_2", "force"])
def test_hammer_recording_without_a_channel_says_what_to_record(store, rng, tmp_path, missing):
    hammered = hammer(rng, hits=3)
    del hammered[missing]
    folder = campaign(tmp_path / "c", rng, [(0.8e-3, 40_000.0)], hammered)
    with pytest.raises(
        IngestError, match=rf"{missing}.*record at least three hits of an instrumented hammer"
    ):
        ingest_folder(store, folder, jobs=1)


def test_too_few_hits_and_a_missing_recording_of_the_hammer_are_refused(store, rng, tmp_path):
    folder = campaign(tmp_path / "c", rng, [(0.8e-3, 40_000.0)], hammer(rng, hits=2))
    with pytest.raises(IngestError, match="holds 2 hits, 3 needed"):
        ingest_folder(store, folder, jobs=1)
    (folder / "hammer.npz").unlink()
    with pytest.raises(IngestError, match=r"force.transfer_function: .*record at least three hits"):
        ingest_folder(store, folder, jobs=1)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            'from = ["acc_3"]',
            r"force.from names 'acc_3'; expected acceleration channels, here: acc_1, acc_2",
        ),
        ('from = "acc_1"', "force.from is 'acc_1'; expected a list"),
        ("from = []", "force.from is \\[\\]; expected a list"),
        ('from = ["acc_1"]', "force.transfer_function is missing"),
        (
            'from = ["acc_1"]\ntransfer_function = 3',
            "force.transfer_function is 3; expected a text",
        ),
        ('from = ["acc_1"]\ntransfer_function = "h.npz"\nunit = "kg"', "force.unit"),
        (
            'from = ["acc_1"]\ntransfer_function = "h.npz"\nsensitivity = 0',
            "force.sensitivity is 0",
        ),
        (
            'from = ["acc_1"]\nfile = "h.npz"',
            "unknown key 'force.file'; known: from, transfer_function",
        ),
        (
            'from = ["acc_1"]\n[channels.load_cell]\nquantity = "force"\nunit = "N"',
            "derives a force, and channels.load_cell records one",
        ),
    ],
)
def test_table_that_is_not_understood_is_refused(store, rng, tmp_path, lines, message):
    toml = TOML[: TOML.index("[force]")] + "[force]\n" + lines + "\n"
    folder = campaign(tmp_path / "c", rng, [], {}, toml)
    with pytest.raises(IngestError, match=message):
        ingest_folder(store, folder, jobs=1)
