"""Are wrong units told, and right ones left alone? `python -m benchmarks.wrong_units [--campaigns
240] [--seed 1]`.

Virtual campaigns of guns and hammers, their units right, are ingested and held against the twin as
a diagnosis does; then the first --wrong of them (all) once more with one unit wrong
(`unit_campaigns`). Printed by kind of campaign: refusals and warnings of wrong units where all are
right; and by wrong unit how many are refused, with the factor or setting named, and how many are
not noticed. Exit code 1 where a right campaign is refused or warned of. --rows FILE keeps one line
of JSON for each campaign, and goes on where the file stops.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from pyroshock.diagnosis.chain import stages_of
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.plausibility import implausible
from pyroshock.diagnosis.reading.campaign import read_campaign
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.session import Writer, open_scratch_store

from .harness import table, table_row
from .unit_campaigns import KINDS, TURNS, write_campaign, wrong_unit_of

CAMPAIGNS = 240
#: Findings of the ingest that speak of a unit.
UNIT_CHECKS = ("implausible-impulse", "implausible-tip", "pressure-above-regulator")


@dataclass(frozen=True)
class UnitAlarm:
    """What is said of a unit: by the ingest or by the diagnosis, as a refusal or as a warning."""

    by: str
    refusal: bool
    message: str


def unit_alarms(folder: Path) -> list[UnitAlarm]:
    """What the ingest of a campaign's folder says of units, and, where it takes the campaign, what
    the diagnosis does before it begins."""
    with open_scratch_store(Writer("benchmark", "0")) as store:
        try:
            report = ingest_folder(store, folder, jobs=1)
        except IngestError as error:
            return [UnitAlarm("ingest", True, fault) for fault in error.faults]
        alarms = [
            UnitAlarm("ingest", False, f"{finding['check']}: {finding['message']}")
            for finding in report.findings
            if finding["check"] in UNIT_CHECKS and finding["severity"] != "note"
        ]
        with store.reading() as session:
            record = read_campaign(session, report.campaign)
    try:
        stages, _ = stages_of(record, Options())
    except ValueError:  # nothing to compare: no diagnosis says anything of units
        return alarms
    findings = implausible(record, stages)
    return alarms + [
        UnitAlarm("diagnosis", item.severity == "refuse", item.message) for item in findings
    ]


@dataclass(frozen=True)
class UnitRow:
    """A campaign with right units, and the same with a wrong one: what was said of each."""

    number: int
    kind: str
    strengths: str
    right: list[UnitAlarm]
    wrong_unit: str = ""
    words: str = ""
    wrong: list[UnitAlarm] = field(default_factory=list)

    @property
    def outcome(self) -> str:
        """Of the wrong unit."""
        refusals = [alarm for alarm in self.wrong if alarm.refusal]
        for said, word in ((refusals, "refused"), (self.wrong, "warned")):
            if any(self.words in alarm.message for alarm in said):
                return f"{word}, named"
            if said:
                return f"{word}, otherwise"
        return "not noticed"


def unit_rows(numbers: Sequence[int], seed: int, wrong_below: int = CAMPAIGNS) -> Iterator[UnitRow]:
    """The campaigns of these numbers, one after the other; those below `wrong_below` with a wrong
    unit, too."""
    for number in numbers:
        with tempfile.TemporaryDirectory(prefix="pyroshock-units-") as place:
            folder, changed = Path(place) / "campaign", Path(place) / "changed"
            kind, strengths = write_campaign(number, seed, folder)
            if number >= wrong_below:
                yield UnitRow(number, kind, strengths, unit_alarms(folder))
                continue
            turn = sum(TURNS[earlier % len(TURNS)] == kind for earlier in range(number))
            wrong = wrong_unit_of(kind, turn, folder)
            shutil.copytree(folder, changed)
            wrong.write(changed)
            yield UnitRow(
                number,
                kind,
                strengths,
                unit_alarms(folder),
                wrong.name,
                wrong.words,
                unit_alarms(changed),
            )


def report(rows: Sequence[UnitRow]) -> str:
    """Both tables, and every message of a right campaign."""
    by_kind: dict[str, list[UnitRow]] = {
        kind: [row for row in rows if row.kind == kind] for kind in KINDS
    }
    right = [
        table_row(KINDS[kind], str(len(group)), *(str(count) for count in _alarms_by_place(group)))
        for kind, group in by_kind.items()
        if group
    ]
    right.append(
        table_row("all", str(len(rows)), *(str(count) for count in _alarms_by_place(rows)))
    )
    by_unit: dict[tuple[str, str], list[UnitRow]] = defaultdict(list)
    for row in rows:
        if not row.wrong_unit:
            continue
        by_unit[row.wrong_unit, row.kind].append(row)
    outcomes = (
        "refused, named",
        "refused, otherwise",
        "warned, named",
        "warned, otherwise",
        "not noticed",
    )
    wrong = []
    for (unit, kind), group in sorted(by_unit.items()):
        counts = Counter(row.outcome for row in group)
        wrong.append(
            table_row(unit, kind, str(len(group)), *(str(counts[outcome]) for outcome in outcomes))
        )
    messages = [
        f"{row.number} {row.kind} {row.strengths}: {alarm.by}: {alarm.message}"
        for row in rows
        for alarm in row.right
    ]
    places = (
        "refused at ingest",
        "warned at ingest",
        "refused by diagnosis",
        "warned by diagnosis",
    )
    return "\n\n".join(
        [
            table(("units right: kind", "campaigns", *places), right),
            table(("unit wrong", "kind", "campaigns", *outcomes), wrong),
            *messages,
        ]
    )


def _alarms_by_place(rows: Sequence[UnitRow]) -> list[int]:
    """Campaigns with at least one: refused and warned at ingest, refused and warned by the
    diagnosis."""
    return [
        sum(any((alarm.by, alarm.refusal) == (by, refusal) for alarm in row.right) for row in rows)
        for by in ("ingest", "diagnosis")
        for refusal in (True, False)
    ]


def _stored(path: Path | None) -> list[UnitRow]:
    if path is None or not path.exists():
        return []
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines():
        values = json.loads(line)
        alarms = {
            name: [UnitAlarm(**alarm) for alarm in values[name]] for name in ("right", "wrong")
        }
        rows.append(UnitRow(**{**values, **alarms}))
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--campaigns", type=int, default=CAMPAIGNS, help=f"how many [{CAMPAIGNS}]")
    parser.add_argument(
        "--wrong",
        type=int,
        default=CAMPAIGNS,
        help="of these, so many with a wrong unit, too [all]",
    )
    parser.add_argument("--seed", type=int, default=1, help="other campaigns for each seed [1]")
    parser.add_argument("--rows", type=Path, help="file of one JSON line a campaign")
    options = parser.parse_args(arguments)
    begin, rows = time.monotonic(), _stored(options.rows)
    done = {row.number for row in rows}
    numbers = [number for number in range(options.campaigns) if number not in done]
    for row in unit_rows(numbers, options.seed, options.wrong):
        rows.append(row)
        print(
            f"{row.number} {row.kind}: {len(row.right)} alarms; {row.wrong_unit}: {row.outcome}",
            file=sys.stderr,
            flush=True,
        )
        if options.rows:
            with options.rows.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(row)) + "\n")
    print(report(rows))
    print(f"\n{time.monotonic() - begin:.0f} s")
    return 1 if any(row.right for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
