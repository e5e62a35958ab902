"""Whether an installed package has a published vulnerability: `make audit`, by pip-audit and the
services it asks.

A vulnerability fails unless `advisories.toml` accepts it for the time being. A machine that cannot
ask the service does not fail, and is not told that all is well: it is told that nothing was asked.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

ACCEPTED = Path(__file__).with_name("advisories.toml")
COMMAND = (
    sys.executable,
    "-m",
    "pip_audit",
    "--format",
    "json",
    "--progress-spinner",
    "off",
    "--skip-editable",
)
#: Asked in turn until one knows our packages: behind a mirror of the index the first knows none.
SERVICES = ("pypi", "osv")
PATIENCE_S = 120.0


@dataclass(frozen=True)
class Outcome:
    """`asked`: packages that the service knows; `unknown`: those it does not; `vulnerable`:
    (package, id, fixed in)."""

    asked: int = 0
    unknown: tuple[str, ...] = ()
    vulnerable: tuple[tuple[str, str, str], ...] = ()
    why_not: str = ""


def outcome_of(document: dict[str, Any]) -> Outcome:
    """What pip-audit's JSON says."""
    packages = document["dependencies"]
    found = [
        (
            f"{each['name']} {each['version']}",
            hole["id"],
            ", ".join(hole["fix_versions"]) or "no version yet",
        )
        for each in packages
        for hole in each.get("vulns", ())
    ]
    unknown = tuple(each["name"] for each in packages if "skip_reason" in each)
    return Outcome(len(packages) - len(unknown), unknown, tuple(found))


def outcome_by(service: str, *words: str, patience_s: float = PATIENCE_S) -> Outcome:
    """The outcome for this interpreter's packages; `words` are more options of pip-audit."""
    command = [*COMMAND, "--vulnerability-service", service, *words]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=patience_s, check=False
        )
        return outcome_of(json.loads(done.stdout))
    except subprocess.TimeoutExpired:
        return Outcome(why_not=f"no answer in {patience_s:.0f} s")
    except ValueError:  # it ends without JSON where it reaches nobody
        return Outcome(why_not=(done.stderr.strip().splitlines() or ["no answer"])[-1][:200])


def not_accepted(
    outcome: Outcome, accepted: Sequence[dict[str, Any]], today: date
) -> Iterator[str]:
    """A line for each vulnerability that fails."""
    until = {(each["package"], each["id"]): each["until"] for each in accepted}
    for package, identity, fixed in outcome.vulnerable:
        end = until.get((package.split()[0], identity))
        if end is None:
            yield (
                f"{package}: {identity}, mended in {fixed}: raise its pin, or "
                f"accept it in {ACCEPTED.name}"
            )
        elif end < today:
            yield f"{package}: {identity}, mended in {fixed}: was accepted until {end}"


def told(outcome: Outcome) -> str:
    """What was asked and what was not, in one line."""
    if outcome.asked == 0:
        why = (
            outcome.why_not
            or f"it knows none of {len(outcome.unknown)} packages; is the index a mirror?"
        )
        return f"audit: NOT DONE: no advisory service can be asked ({why})"
    some = f"; not known there: {', '.join(outcome.unknown)}" if outcome.unknown else ""
    return f"audit: {outcome.asked} packages asked, {len(outcome.vulnerable)} vulnerabilities{some}"


def main() -> int:
    """0: nothing known, or nobody to ask; 1: a vulnerability."""
    accepted = tomllib.loads(ACCEPTED.read_text(encoding="utf-8")).get("accepted", [])
    for service in SERVICES:
        outcome = outcome_by(service)
        if outcome.asked:
            break
    wrong = list(not_accepted(outcome, accepted, datetime.now(UTC).date()))
    for line in wrong:
        print(f"audit: {line}", file=sys.stderr)
    print(told(outcome))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
