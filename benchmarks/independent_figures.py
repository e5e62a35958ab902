"""`python -m benchmarks.independent_figures [FOLDER]`: figures of measured records beside an
independent calculation.

FOLDER holds the measured records of others (default: where the tests look for them).
PYROSHOCK_RECORDS may name a folder of further ones, text or LabVIEW files. The calculation shares
nothing with the product: NumPy reads the files, and peak, width at half of the peak and impulse
follow from the samples by the trapezoid rule and linear crossings. The table shows the largest
deviation of ours, by origin and figure.
"""

from __future__ import annotations

import os
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyroshock.ingest.extraction.pulses import extract_pulses
from pyroshock.ingest.readers import open_recording
from pyroshock.signals.shock_figures import shock_figures
from pyroshock.signals.units import to_si

from .harness import ROOT, table, table_row

#: Where the tests look for the measured records of others; the variable names a folder of further
#: ones.
REAL_DATA, VARIABLE = ROOT.parent / "shared" / "real-data", "PYROSHOCK_RECORDS"
#: The largest deviation from the independent calculation that is allowed.
LIMITS = {"peak": 0.005, "half width": 0.01, "impulse": 0.01}
G = 9.80665

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Record:
    """Samples of one channel in SI, as NumPy read them."""

    origin: str
    name: str
    quantity: str
    samples: Floats
    rate_hz: float


def shipped_records(folder: Path) -> Iterator[Record]:
    """The measured records that the tests have: 33 hits, one hit, and six shocks of a drop
    table."""
    hits = np.load(folder / "vrtac-impact-hammer" / "dewesoft_20000Hz.npz")
    for key in hits.files:
        for i, hit in enumerate(hits[key] if hits[key].ndim == 3 else ()):
            yield Record("vrtac", f"{key}/{i}", "force", hit[0].astype(float), 20e3)
    table = lvm_columns(folder / "ladisk-imac-tutorial" / "acceleration.lvm")
    yield Record("ladisk", "acceleration.lvm", "force", table["Force (Trigger)"], 50e3)
    shocks = np.load(folder / "afrl-ds3-electronics-shock" / "shocks.npz")
    for key in shocks.files:
        if shocks[key].ndim == 2:
            yield Record("afrl", key, "acceleration", shocks[key][:, 1] * G, 1e6)


def further_records(folder: Path) -> Iterator[Record]:
    """Text of two columns, time in s and acceleration in g, and LabVIEW files of accelerations in
    m/s2; each file must be read by the product's readers to the same numbers."""
    for path in sorted(folder.glob("*.txt")):
        time, acceleration = np.loadtxt(path, unpack=True)
        _refuse_other_numbers(path, "acceleration", acceleration * G)
        yield Record(
            "text",
            path.name,
            "acceleration",
            acceleration * G,
            (len(time) - 1) / (time[-1] - time[0]),
        )
    for path in sorted(folder.glob("*.lvm")):
        for name, samples in lvm_columns(path).items():
            if name.startswith("Acceleration") and samples.size > 1000:
                _refuse_other_numbers(path, name, samples)
                yield Record("LabVIEW", f"{path.name}/{name}", "acceleration", samples, 51200.0)


def lvm_columns(path: Path) -> dict[str, Floats]:
    """Columns of a LabVIEW file of one segment, by name."""
    lines = path.read_text(encoding="latin-1").splitlines()
    head = max(i for i, line in enumerate(lines) if line.startswith("***End_of_Header***")) + 1
    separator = "\t" if "\t" in lines[head] else ","
    names, *rows = [line.split(separator) for line in lines[head:] if line.strip()]
    columns = {}
    for at, name in enumerate(names):
        if name not in ("X_Value", "Comment", ""):
            fields = [row[at].strip() for row in rows if at < len(row)]
            columns[name] = np.array([float(field.replace(",", ".")) for field in fields if field])
    return columns


def calculated_pulse(force: Floats, rate_hz: float) -> dict[str, float]:
    """Peak, width at half of it and impulse of the one contact of a force (n,), above the median of
    the 5 ms before."""
    upright = force if force.max() - np.median(force) > np.median(force) - force.min() else -force
    top = int(upright.argmax())
    start = top - int(0.001 * rate_hz) - int(0.005 * rate_hz)
    x = upright - np.median(upright[max(start, 0) : max(top - int(0.001 * rate_hz), 16)])
    below = np.flatnonzero(x <= 0.005 * x[top])
    first, last = below[below < top].max(), below[below > top].min()
    impulse = float(np.sum((x[first:last] + x[first + 1 : last + 1]) / 2)) / rate_hz
    half = x[top] / 2
    left = max(i for i in range(first, top) if x[i] <= half)
    right = min(i for i in range(top, last + 1) if x[i] <= half)
    begin = left + (half - x[left]) / (x[left + 1] - x[left])
    end = right - 1 + (x[right - 1] - half) / (x[right - 1] - x[right])
    return {"peak": float(x[top]), "half width": (end - begin) / rate_hz, "impulse": impulse}


def calculated_shock(acceleration: Floats) -> dict[str, float]:
    """Largest acceleration of a shock (n,) above the mean of the first half of what lies before
    it."""
    loud = np.flatnonzero(
        np.abs(acceleration - np.median(acceleration)) > 0.05 * np.abs(acceleration).max()
    )
    rest = acceleration[: loud[0] // 2]
    x = acceleration - (rest.mean() if rest.size >= 16 else 0.0)
    return {"peak": float(np.abs(x).max())}


def our_figures(record: Record) -> dict[str, float]:
    """The same by the product."""
    if record.quantity == "force":
        pulse = max(
            extract_pulses(record.samples, record.rate_hz), key=lambda each: each.peak_force_n
        )
        return {
            "peak": pulse.peak_force_n,
            "half width": pulse.width_half_s,
            "impulse": pulse.impulse_n_s,
        }
    figures = shock_figures(record.samples, record.rate_hz)
    return {} if figures is None else {"peak": figures.peak_acceleration_m_s2}


def deviations(record: Record) -> dict[str, float]:
    """Relative deviation of ours, by figure."""
    force = record.quantity == "force"
    calculated = (
        calculated_pulse(record.samples, record.rate_hz)
        if force
        else calculated_shock(record.samples)
    )
    ours = our_figures(record)
    return {name: abs(ours[name] / value - 1.0) for name, value in calculated.items()}


def _refuse_other_numbers(path: Path, name: str, expected: Floats) -> None:
    """Raise `AssertionError` where the product reads other samples in SI than NumPy."""
    with open_recording(path) as recording:
        gain, offset = to_si(recording.info(name).unit or "m/s2", "acceleration")
        np.testing.assert_allclose(
            np.asarray(recording.read(name), dtype=float) * gain + offset, expected, rtol=1e-9
        )


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else REAL_DATA
    records = list(shipped_records(folder)) if folder.is_dir() else []
    if VARIABLE in os.environ:
        records += further_records(Path(os.environ[VARIABLE]))
    largest: defaultdict[tuple[str, str], list[float]] = defaultdict(list)
    for record in records:
        for name, deviation in deviations(record).items():
            largest[record.origin, name].append(deviation)
    head = ("records", "figure", "number", "median deviation", "largest", "limit")
    print(table(head, (
        table_row(*key, str(len(x)), f"{np.median(x):.2%}", f"{max(x):.2%}",
        f"{LIMITS[key[1]]:.1%}")
        for key, x in largest.items()
    )))  # fmt: skip


if __name__ == "__main__":
    main()
