"""The coregional likelihood from our peers and from us at every size: `python -m benchmarks.coregional --full`.

Printed as Markdown. Each way runs alone in a fresh process that may hold 24 GB, for at most `LIMIT_S` a likelihood.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .apart import Apart, ApartError
from .coregional_ways import CHOLESKY, ONE_CORE_CHOLESKY, OUTPUTS, ways
from .measuring import Spread

LIMIT_S, LIMIT_BYTES = 180.0, 24 * 10**9
SIZES, LARGEST = (45, 90, 180, 720, 1440), 1440
PEERS = ("GPyTorch MultitaskKernel", "BoTorch KroneckerMultiTaskGP")
YARDSTICKS = (CHOLESKY, ONE_CORE_CHOLESKY)


@dataclass(frozen=True)
class Found:
    """What a process told; where it told nothing, `why`."""

    told: Mapping[str, Any] = field(default_factory=dict)
    why: str = ""

    @property
    def seconds(self) -> float:
        return statistics.median(self.told["seconds"]) if self.told else float("inf")

    def cells(self, reference: float | None) -> list[str]:
        """`reference` is the likelihood to compare with; None where a way computes none."""
        if not self.told:
            return [self.why, "—", "—"]
        apart = "—" if reference is None else f"{abs(self.told['value'] - reference):.1g}"
        peak = f"{self.told['peak_bytes'] / 1e6:,.0f} MB"
        return [Spread.of(self.told["seconds"]).text(" ms", 1e3), apart, peak]


def asked(way: str, n: int, repeats: int) -> Found:
    """Of a fresh process."""
    warm = int(repeats > 1)  # imports and first pages
    with Apart("-m", "benchmarks.coregional_ways", way, limit_bytes=LIMIT_BYTES) as program:
        try:
            answers = [program.ask(LIMIT_S, what="likelihood", n=n) for _ in range(warm + repeats)]
        except ApartError as error:
            return Found(why=f"needs more than {LIMIT_BYTES / 1e9:g} GB" if "memory" in str(error) else str(error))
    return Found({**answers[-1], "seconds": [answer["seconds"] for answer in answers[warm:]]})


def rows_of(n: int) -> tuple[list[str], list[str]]:
    """Rows of the table for n pulses, and what is not as it should be."""
    wanted = [way for way in ways() if way not in YARDSTICKS or n == LARGEST]
    found = {way: asked(way, n, repeats(way, n)) for way in wanted}
    reference = found["pyroshock"].told["value"]
    rows = [
        f"| {n} | {' | '.join([way, *one.cells(None if way in YARDSTICKS else reference)])} |"
        for way, one in found.items()
    ]
    apart = [
        f"{way} at {n}: another likelihood"
        for way, one in found.items()
        if way not in YARDSTICKS and one.told and abs(one.told["value"] - reference) > 1e-6 * n * OUTPUTS
    ]
    return rows, apart


def repeats(way: str, n: int) -> int:
    """Peers at 720 take a minute each."""
    return 1 if way in PEERS and n > 180 else 3 if way in PEERS else 9


def main() -> int:
    say = sys.stdout.write
    say("| pulses | way | loss and gradient | likelihood apart | peak memory |\n| ---: | --- | --- | --- | --- |\n")
    broken: list[str] = []
    for n in SIZES:
        rows, missed = rows_of(n)
        say("\n".join(rows) + "\n")
        sys.stdout.flush()
        broken += missed
    say(f"\nnot as it should be: {'; '.join(broken) or 'nothing'}\n")
    return 1 if broken else 0
