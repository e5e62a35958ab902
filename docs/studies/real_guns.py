"""Two guns that others recorded, as campaigns: five shots of the thesis's, 74 of a small one."""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration
from pyroshock.ingest.extraction.velocity import muzzle_velocity_uncertainty
from pyroshock.twin.gun.bench import GunBench

FIRST_SHOTS = Path(__file__).resolve().parents[2] / "examples" / "first-shots"
TRETTEL = (
    Path(__file__).resolve().parents[3]
    / "shared"
    / "real-data"
    / "trettel-blastersim"
    / "shots.csv"
)
#: Geometry as the gun's author gives it. Friction, valve and dead volume are left to the diagnosis.
BORE_M = 0.527 * 0.0254
SMALL_GUN = GunBench(18.03e-6, BORE_M, BORE_M, 0.3048, 0.0, 1.4, 1.0)
DART_KG = 0.98e-3
#: The dart that did not leave the barrel: 25 psi.
STUCK_PA = 25 * 6894.757
#: Of eq. 5.2: the metre's resolution.
LENGTH_ERROR_M = 1e-3


def first_shots_record(efficiency: float = 1.0) -> CampaignRecord:
    """The five shots of Table 3.1 as they are shipped, with another efficiency than eq. 2.18's one
    half.

    Uncertainties follow eq. 5.2 from the bullet's length and one sampling period of the laser.
    """
    with (FIRST_SHOTS / "campaign.toml").open("rb") as handle:
        gun = replace(GunBench(**tomllib.load(handle)["bench"]["gun"]), efficiency=efficiency)
    with (FIRST_SHOTS / "runs.csv").open(newline="") as handle:
        rows = list(csv.DictReader(handle))
    shots = []
    for row in rows:
        velocity = float(row["measured_velocity_m_s"])
        length, period = (
            float(row["bullet_length_mm"]) / 1e3,
            1 / float(row["laser_sampling_rate_hz"]),
        )
        u = float(
            muzzle_velocity_uncertainty(length, length / velocity, LENGTH_ERROR_M, time_u_s=period)
        )
        shots.append(
            (float(row["tank_pressure_bar"]) * 1e5, float(row["bullet_mass_kg"]), velocity, u)
        )
    said = f"efficiency {efficiency:g}; friction and travel identified from Table 5.1, not measured"
    return _record("first-shots", gun, shots, (said,))


def trettel_record(csv_path: Path = TRETTEL) -> CampaignRecord:
    """74 shots of a small gun with its author's geometry and no calibration: no valve, dead volume
    or friction.

    Raises `FileNotFoundError` where the table of shots is not there.
    """
    with csv_path.open(newline="") as handle:
        rows = [row for row in csv.DictReader(handle) if row["v_m_s"] != "did_not_exit"]
    shots = [(float(row["p_gauge_kPa"]) * 1e3, DART_KG, float(row["v_m_s"]), None) for row in rows]
    said = (
        "bore and projectile are of one diameter: the dart's clearance is not "
        "known; friction is taken as zero"
    )
    return _record("trettel", SMALL_GUN, shots, (said,))


def write_folder(record: CampaignRecord, folder: Path, date: str) -> Path:
    """A gun's record as a campaign folder, which is made; `date` is ISO."""
    assert record.gun is not None
    folder.mkdir(parents=True, exist_ok=True)
    settings = "".join(f"{name} = {value!r}\n" for name, value in vars(record.gun).items())
    head = f'[campaign]\nname = "{record.name}"\nkind = "gun"\ndate = "{date}"\n\n[bench.gun]\n'
    (folder / "campaign.toml").write_text(head + settings, encoding="utf-8")
    columns = ["run", "repetition", "tank_pressure_bar", "bullet_mass_kg", "measured_velocity_m_s"]
    with (folder / "runs.csv").open("w", newline="", encoding="utf-8") as handle:
        writer = csv.writer(handle)
        stated = all(run.velocity_u_m_s is not None for run in record.runs)
        writer.writerow([*columns, "measured_velocity_u_m_s"] if stated else columns)
        for run in record.runs:
            assert run.tank_pressure_pa is not None
            row = [
                run.run,
                run.repetition,
                run.tank_pressure_pa / 1e5,
                run.bullet_mass_kg,
                run.velocity_m_s,
            ]
            writer.writerow([*row, run.velocity_u_m_s] if stated else row)
    return folder


Shot = tuple[float, float, float, float | None]


def _record(
    name: str, gun: GunBench, shots: Sequence[Shot], assumptions: tuple[str, ...]
) -> CampaignRecord:
    """Shots of one pressure and mass are one configuration, in the order in which they first
    come."""
    settings = list(dict.fromkeys((pressure, mass) for pressure, mass, *_ in shots))
    seen = [0] * len(settings)
    runs = []
    for order, (pressure, mass, velocity, u) in enumerate(shots):
        at = settings.index((pressure, mass))
        seen[at] += 1
        runs.append(Run(at, order + 1, seen[at], order, pressure, mass, velocity, u))
    configurations = tuple(
        RunConfiguration(
            f"{pressure / 1e5:.4g} bar", {"tank_pressure": pressure, "bullet_mass": mass}
        )
        for pressure, mass in settings
    )
    return CampaignRecord(name, "gun", configurations, tuple(runs), gun, assumptions=assumptions)
