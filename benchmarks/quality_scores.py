"""`python -m benchmarks.quality_scores [FOLDER] [--seed N] [--each N]`: what the quality verdicts
are worth.

Made records, whose faults are known, and the measured ones of FOLDER (default: where the tests look
for them) are judged as an ingest judges them. The folder that PYROSHOCK_RECORDS names may hold
`Test_001.lvm` to `Test_032.lvm` of the public "Dataset-5 Extended Impact Testing" (High-Rate SHM
Working Group): their authors say that two of the 32 are wrong. Precision is the share of a
verdict's records that deserve it, recall the share of records that deserve it and get it. A
record's verdict is its gravest finding.
"""

from __future__ import annotations

import argparse
import os
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyroshock.ingest.extraction.record_checks import check_recording
from pyroshock.ingest.extraction.recording import hits_of
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.units import SI_UNITS

from .harness import table, table_row
from .independent_figures import REAL_DATA, VARIABLE, G, lvm_columns, shipped_records
from .shared_records import Labelled, Signal, made_records

VERDICTS = ("ok", "warning", "reject")


def judge(record: Labelled) -> tuple[str, tuple[str, ...]]:
    """The verdict, and the checks that said it."""
    channels = [
        Channel(
            Sensor(s.name, s.quantity, SI_UNITS[s.quantity], range=s.range_si, axis=s.axis,
            position=s.position),
            s.samples, record.rate_hz,
        )
        for s in record.signals
    ]  # fmt: skip
    findings = check_recording(channels, hits_of(channels, ExtractionSettings(), None))
    severities = {finding.severity for finding in findings} - {"note"}
    worst = max(severities, key=VERDICTS.index, default="ok")
    return worst, tuple(sorted({f.check for f in findings if f.severity == worst}))


def _rate_hz(times_s: NDArray[np.float64]) -> float:
    return 1 / float(np.median(np.diff(times_s)))


def real_records(folder: Path) -> Iterator[Labelled]:
    """Measured ones whose verdict their authors disclosed: hits verified as single, shocks with
    published figures, one saturated sensor beside its reference, one raw record with an offset
    beside its cleaned ones."""
    hits = np.load(folder / "vrtac-impact-hammer" / "dewesoft_20000Hz.npz")
    for key in hits.files:
        for hit in hits[key].astype(float) if hits[key].ndim == 3 else ():
            axes = [
                Signal(f"a{a}", "acceleration", x, axis=a)
                for a, x in zip("xyz", hit[1:], strict=True)
            ]
            yield Labelled(key, "ok", 20e3, (Signal("force", "force", hit[0]), *axes), "vrtac")
    for record in shipped_records(folder):
        if record.origin == "afrl":
            signal = Signal("fixture", "acceleration", record.samples)
            yield Labelled(record.name, "ok", record.rate_hz, (signal,), "afrl")
    windows = np.load(folder / "endaq-ide" / "windows_300ms.npz")
    for key in windows.files:
        record = windows[key].astype(float)
        verdict = "reject" if key == "water6mps_40g_DC_Acceleration" else "ok"
        # the sphere that enters the water carries its sensor, and goes on moving
        position = "impactor" if key.startswith("water") else "plate"
        names = enumerate("xyz", 1)
        signals = [
            Signal(f"a{a}", "acceleration", record[:, i] * G, axis=a, position=position)
            for i, a in names
        ]
        yield Labelled(key, verdict, _rate_hz(record[:, 0]), tuple(signals), "endaq")
    irvine = np.load(folder / "vibrationdata-irvine" / "records.npz")
    for key, verdict in IRVINE.items():
        record = irvine[key]
        signal = Signal("a", "acceleration", record[:, 1] * G)
        yield Labelled(key, verdict, _rate_hz(record[:, 0]), (signal,), "irvine")


#: Recorded wrongly, by the word of the authors ("due to a data acquisition error").
WRONG_TESTS = ("017", "024")


def impact_tests(folder: Path) -> Iterator[Labelled]:
    """32 shocks of a table and of the board on it, two accelerations each."""
    for path in sorted(folder.glob("Test_0*.lvm")):
        columns = {
            name: x for name, x in lvm_columns(path).items() if name.startswith("Acceleration")
        }
        signals = tuple(
            Signal(name, "acceleration", x, position=name) for name, x in columns.items()
        )
        yield Labelled(
            path.stem,
            "reject" if path.stem[-3:] in WRONG_TESTS else "ok",
            51200.0,
            signals,
            "high-rate",
        )


#: Channel 33 rests 6 g lower after the shock than before (its neighbours move by 1.5 g and less).
IRVINE = {
    "rv_separation_raw_txt": "warning", "rv_separation_cleaned_txt": "ok",
    "rv_separation_dat": "ok",
    "flight_stage_sep_txt": "ok", "pyro_sep_test": "ok", "avionics_channel_25": "ok",
    "avionics_channel_30": "ok",
    "avionics_channel_33": "warning", "midfield_shock_txt": "ok", "asrs_txt": "ok",
    "srs2000G_accel_txt": "ok",
}  # fmt: skip


def report(records: Iterable[Labelled]) -> list[str]:
    """Precision and recall by verdict, then each kind that was judged otherwise than it
    deserves."""
    pairs: Counter[tuple[str, str]] = Counter()
    wrong: Counter[tuple[str, str, str, str]] = Counter()
    origins: Counter[str] = Counter()
    for record in records:
        verdict, checks = judge(record)
        pairs[record.verdict, verdict] += 1
        origins[record.origin] += 1
        if verdict != record.verdict:
            kind = record.kind if record.origin == "made" else f"{record.origin} {record.kind}"
            wrong[kind, record.verdict, verdict, ", ".join(checks)] += 1
    rows = []
    for verdict in VERDICTS:
        right = pairs[verdict, verdict]
        deserve, given = (
            sum(n for pair, n in pairs.items() if pair[end] == verdict) for end in (0, 1)
        )
        shares = (f"{right / of:.3f}" if of else "-" for of in (given, deserve))
        rows.append(table_row(verdict, str(deserve), str(given), *shares))
    others = (table_row(*key, str(count)) for key, count in sorted(wrong.items()))
    return [
        f"{sum(origins.values())} records: "
        f"{', '.join(f'{n} {name}' for name, n in origins.items())}\n",
        table(("verdict", "records", "given", "precision", "recall"), rows) + "\n",
        table(("judged otherwise", "deserves", "got", "by", "records"), others),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=REAL_DATA)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", type=int, default=15, help="made records of each kind")
    given = parser.parse_args()
    measured = real_records(given.folder) if given.folder.is_dir() else ()
    others = impact_tests(Path(os.environ[VARIABLE])) if VARIABLE in os.environ else ()
    print("\n".join(report([*made_records(given.seed, given.each), *measured, *others])))


if __name__ == "__main__":
    main()
