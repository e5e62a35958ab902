"""Field case 38: records of a hammer with a second hit, a tap before, or the sign turned. Each is
named, and the figures are those of the hit that the row means."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyroshock as ps
import pytest

RATE_HZ, PEAK_N, DURATION_S = 51_200.0, 2_000.0, 0.5e-3
#: Of a half sine: 2 / pi of the peak over its duration.
IMPULSE_N_S = 2 / np.pi * PEAK_N * DURATION_S
#: The hits of each record: start (s) and share of the peak; and the check that names it, None for a
#: good one.
RECORDS = {
    "single": (((0.02, 1.0),), None),
    "second60-3ms": (((0.02, 1.0), (0.023, 0.6)), "double-hit"),
    "second30-20ms": (((0.02, 1.0), (0.04, 0.3)), "double-hit"),
    "second8-5ms": (((0.02, 1.0), (0.025, 0.08)), "double-hit"),
    "touching": (((0.02, 1.0), (0.02 + 0.9 * DURATION_S, 0.6)), "implausible-impulse"),
    "pretap": (((0.02, 0.35), (0.026, 1.0)), "double-hit"),
    "inverted": (((0.02, -1.0),), "force-sign"),
    "second150ms": (((0.02, 1.0), (0.17, 0.6)), "hit-without-row"),
}
_COLUMNS = "run,repetition,tip_material,tip_radius_mm,plate_material,anvil_material,insulator"
CAMPAIGN = """[campaign]
name = "hits"
kind = "hammer"
date = "2026-03-02"

[bench.hammer]
mass_kg = 0.32

[channels.force]
quantity = "force"
unit = "N"
"""


def force_n(hits: tuple[tuple[float, float], ...]) -> np.ndarray:
    time_s = np.arange(12_000) / RATE_HZ
    force = 0.5 * np.random.default_rng(38).standard_normal(time_s.size)
    for start_s, share in hits:
        phase = (time_s - start_s) / DURATION_S
        force += np.where((phase > 0) & (phase < 1), share * PEAK_N * np.sin(np.pi * phase), 0.0)
    return force


def write_campaign(folder: Path) -> Path:
    (folder / "recordings").mkdir(parents=True)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    rows = [f"{_COLUMNS},hammer_speed,boundary_conditions,impact_velocity_m_s,recording"]
    for run, (name, (hits, _)) in enumerate(RECORDS.items(), 1):
        np.savez(folder / "recordings" / f"{name}.npz", force=force_n(hits), fs=RATE_HZ)
        rows.append(f"{run},1,steel,30,aluminum,none,none,low,free,1.0,recordings/{name}.npz")
    (folder / "runs.csv").write_text("\n".join(rows) + "\n")
    return folder


def test_second_hits_taps_and_turned_signs_are_named_and_the_figures_are_of_the_hit(
    tmp_path: Path,
) -> None:
    with ps.open(tmp_path / "lab.db") as store:
        outcome = store.ingest(write_campaign(tmp_path / "hits"), jobs=1, progress=False)
        impacts = store.impacts()
    checks: dict[str, set[str]] = {name: set() for name in RECORDS}
    for finding in outcome.report.findings:
        checks[Path(finding["recording"]).stem].add(finding["check"])
    assert checks["single"] == set()
    missing = [
        name
        for name, (_, check) in RECORDS.items()
        if check is not None and check not in checks[name]
    ]
    assert missing == []
    apart = [run for run, name in enumerate(RECORDS, 1) if name != "touching"]
    alone = impacts[impacts["run"].isin(apart)]
    assert len(alone) == len(apart)
    assert alone["peak_force_n"].to_numpy() == pytest.approx(PEAK_N, rel=5e-3)
    assert alone["contact_time_s"].to_numpy() == pytest.approx(DURATION_S, abs=1.5 / RATE_HZ)
    assert alone["impulse_n_s"].to_numpy() == pytest.approx(IMPULSE_N_S, rel=1e-2)
