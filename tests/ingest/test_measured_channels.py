"""Velocities and pressures out of whole recordings: hammer with an accelerometer, gun with laser
and transducer."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact, Pulse, Shot
from pyroshock.schema.recordings import QualityFinding
from sqlalchemy import select
from support.records.campaigns import write_folder

RATE = 51200.0
MASS = 0.32

HAMMER = (
    '[campaign]\nname = "hammer"\nkind = "hammer"\ndate = '
    '"2026-01-01"\n[bench.hammer]\nmass_kg = 0.32\n'
    '[channels.force]\nquantity = "force"\nunit = "N"\n'
    '[channels.head]\nquantity = "acceleration"\nunit = "g"\nposition = "hammer"\n'
)
GUN = (
    '[campaign]\nname = "gun"\nkind = "gun"\ndate = "2026-01-01"\n'
    '[channels.laser]\nquantity = "voltage"\nunit = "V"\nposition = "muzzle"\n'
    '[channels.tank]\nquantity = "pressure"\nunit = "bar"\nsensitivity = '
    "0.5621\noffset_v = 0.3624\n"
    '[channels.cell]\nquantity = "force"\nunit = "kN"\n'
)


def hits(velocities, width_s=1.2e-3, restitution=0.6, seconds=2.0):
    """Force and acceleration of a rigid hammer of `MASS` that hits with `velocities` and leaves
    with less.

    Force is a half-sine whose impulse is m (1 + e) v; while it presses, the hammer's deceleration
    is F / m.
    """
    time = np.arange(round(seconds * RATE)) / RATE
    force = np.zeros_like(time)
    for i, v in enumerate(velocities):
        start = 0.1 + i * (seconds - 0.2) / len(velocities)
        peak = MASS * (1 + restitution) * v * np.pi / 2 / width_s
        inside = (time > start) & (time < start + width_s)
        force[inside] = peak * np.sin(np.pi * (time[inside] - start) / width_s)
    return time, force


def ring(acceleration, frequency_hz=6000.0, damping=0.02):
    """What an accelerometer sees through a hammer head with one resonance (unit gain at rest)."""
    from scipy.signal import cont2discrete, lfilter

    w = 2 * np.pi * frequency_hz
    b, a, _ = cont2discrete(([w**2], [1, 2 * damping * w, w**2]), 1 / RATE, method="foh")
    return lfilter(b.ravel(), a, acceleration)


@pytest.mark.parametrize("count", [1, 10], ids=["one hit, raw", "ten hits, deconvolved"])
def test_impact_velocity_is_the_hammers(store, tmp_path, count):
    # At the end of compression half of the impulse of a symmetric pulse has passed: v_i = (1 + e) v
    # / 2.
    velocities = np.linspace(0.8, 2.4, count) if count > 1 else np.array([1.5])
    rng = np.random.default_rng(3)
    _, force = hits(velocities)
    acceleration = ring(-force / MASS / 9.80665) if count > 1 else -force / MASS / 9.80665
    arrays = {
        "force": (force + rng.normal(size=force.size) * 0.1).astype(np.float32),
        "head": (acceleration + rng.normal(size=force.size) * 0.02).astype(np.float32),
        "fs": RATE,
    }
    folder = write_folder(
        tmp_path / "c",
        HAMMER,
        "run,repetition,tip_material,recording\n1,1,steel,a.npz\n",
        {"a.npz": arrays},
    )
    report = ingest_folder(store, folder)
    assert (report.impacts, report.set_aside) == (count, [])
    with store.reading() as session:
        impacts = list(session.scalars(select(Impact).order_by(Impact.repetition)))
        assert [i.repetition for i in impacts] == list(range(1, count + 1))
        assert {i.velocity_source for i in impacts} == {"integrated"}
        found = np.array([i.impact_velocity_m_s for i in impacts])
        stated = np.array([i.impact_velocity_u_m_s for i in impacts])
    expected = 0.8 * velocities
    np.testing.assert_allclose(found, expected, rtol=0.02)
    assert np.all(np.abs(found - expected) < 4 * stated + 0.005 * expected)


def test_late_acceleration_is_a_finding(store, tmp_path):
    _, force = hits([1.5])
    late = np.roll(-force / MASS / 9.80665, 8)
    folder = write_folder(
        tmp_path / "c",
        HAMMER,
        "run,repetition,recording\n1,1,a.npz\n",
        {"a.npz": {"force": force, "head": late, "fs": RATE}},
    )
    ingest_folder(store, folder)
    with store.reading() as session:
        evidence = session.scalars(
            select(QualityFinding.evidence).where(QualityFinding.check == "delay")
        ).one()
    assert evidence["delay_samples"] == pytest.approx(8, abs=0.2)


def gun_record(velocity=14.0, pressure_bar=0.42, length_m=0.085, rate=25000.0):
    """Laser (V), transducer (V) and load cell (kN) of one shot."""
    time = np.arange(round(0.5 * rate)) / rate
    rng = np.random.default_rng(5)
    laser = (
        np.where((time > 0.2) & (time < 0.2 + length_m / velocity), 1.0, 4.0)
        + rng.normal(size=time.size) * 0.02
    )
    pressure = pressure_bar * np.where(time < 0.17, 1.0, np.exp(-(time - 0.17) / 0.05))
    tank = 0.3624 + 0.5621 * pressure + rng.normal(size=time.size) * 1e-4
    inside = (time > 0.25) & (time < 0.252)
    cell = (
        np.where(inside, 3.0 * np.sin(np.pi * (time - 0.25) / 0.002), 0.0)
        + rng.normal(size=time.size) * 1e-3
    )
    return {"laser": laser, "tank": tank, "cell": cell, "fs": rate}


HEADER = "run,repetition,bullet_mass_kg,tank_pressure_bar,tip_material,bullet_length_mm,recording\n"
RUNS = HEADER + "1,1,0.1428,0.4,PLA,{},a.npz\n"


def test_shot_is_measured_by_laser_and_transducer(store, tmp_path):
    ingest_folder(
        store, write_folder(tmp_path / "c", GUN, RUNS.format(85), {"a.npz": gun_record()})
    )
    with store.reading() as session:
        shot = session.scalars(select(Shot)).one()
        assert shot.velocity_source == "laser"
        assert abs(shot.measured_velocity_m_s - 14.0) < 2 * shot.measured_velocity_u_m_s
        # eq. 5.2 with 1 mm and one period of 25 kHz
        assert shot.measured_velocity_u_m_s == pytest.approx(
            np.hypot(14 / 85, 14**2 / 0.085 * 4e-5), rel=0.05
        )
        assert shot.recorded_pressure_pa == pytest.approx(0.42e5, abs=50)
        assert shot.tank_pressure_pa == pytest.approx(0.4e5)
        pulse = session.scalars(select(Pulse).where(Pulse.impact_id == shot.impact_id)).one()
        assert pulse.peak_force_n == pytest.approx(3000, rel=0.01)
        assert pulse.impulse_n_s == pytest.approx(3000 * 2 / np.pi * 2e-3, rel=0.01)


def test_load_cell_array_is_summed_and_a_missing_bullet_length_told(store, tmp_path):
    toml = GUN + '[channels.cell_2]\nquantity = "force"\nunit = "N"\n'
    record = gun_record()
    record["cell_2"] = record["cell"] * 1e3
    ingest_folder(store, write_folder(tmp_path / "c", toml, RUNS.format(""), {"a.npz": record}))
    with store.reading() as session:
        assert session.scalars(select(Pulse.peak_force_n)).one() == pytest.approx(6000, rel=0.01)
        assert session.scalars(select(Shot.measured_velocity_m_s)).one() is None
        query = select(QualityFinding.message).where(QualityFinding.check == "no-bullet-length")
        assert "bullet_length_mm" in session.scalars(query).one()
