"""`python -m benchmarks.coregional [--full]`: the coregional likelihood from our peers and from us, as Markdown.

Each way runs alone in a fresh process that may hold 24 GB, peers for at most `LIMIT_S`. Without `--full` the peers are
asked for 45, 90, 180 and 720 pulses of 20 outputs; with it for 1,440 too. The exit code is 1 where a promise is not
kept. BoTorch is no dependency: without it, its row says so (`pip install botorch`).
"""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .coregional_ways import OUTPUTS, PREDICTED, TRAINING, WAYS
from .measuring import ROOT, Spread

LIMIT_S, LIMIT_BYTES = 180.0, 24 * 10**9
SMALL, PULSES = (45, 90, 180, 720), 1440
PEERS = ("GPyTorch MultitaskKernel", "BoTorch KroneckerMultiTaskGP")
YARDSTICKS = ("one Cholesky factorisation", "one Cholesky factorisation, one core")


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


def asked(way: str, n: int, repeats: int, limit_s: float = LIMIT_S) -> Found:
    """Of a fresh process."""
    command = [sys.executable, "-m", "benchmarks.coregional_ways", way, str(n), str(repeats)]
    try:
        done = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, timeout=limit_s, preexec_fn=_limit_memory, check=False
        )
    except subprocess.TimeoutExpired:
        return Found(why=f"killed after {limit_s:g} s")
    if done.returncode:
        return Found(why=_reason(done.stderr, done.returncode))
    return Found(json.loads(done.stdout.splitlines()[-1]))


def _limit_memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (LIMIT_BYTES, LIMIT_BYTES))


def _reason(said: str, code: int) -> str:
    if "No module named" in said:
        return "not installed"
    wanted_more = any(word in said.lower() for word in ("memory", "allocate"))
    return f"needs more than {LIMIT_BYTES / 1e9:g} GB" if wanted_more else f"failed ({code})"


def likelihoods(n: int, ways: tuple[str, ...]) -> tuple[list[str], list[str]]:
    """Rows of a table for n pulses, and the promises broken."""
    found = {way: asked(way, n, repeats(way, n)) for way in ways}
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
    slow = [f"{way} at {n}: less than 200 times slower" for way in PEERS if not _far_behind(found, way, n)]
    return rows, apart + slow + (_promises(found) if n == PULSES else [])


def _far_behind(found: Mapping[str, Found], way: str, n: int) -> bool:
    return way not in found or n < 180 or found[way].seconds >= 200 * found["pyroshock"].seconds


def _promises(found: Mapping[str, Found]) -> list[str]:
    ours, yardstick = found["pyroshock"], min(found[way].seconds for way in YARDSTICKS)
    broken = ["more than 4 Cholesky factorisations"] * (ours.seconds > 4 * yardstick)
    return broken + ["an evaluation of more than 1 GB"] * (ours.told["peak_bytes"] > 1e9)


def repeats(way: str, n: int) -> int:
    """Peers at 720 take a minute each."""
    return 1 if way in PEERS and n > 180 else 3 if way in PEERS else 9


def training() -> tuple[str, list[str]]:
    told = asked(TRAINING, PULSES, 1).told
    sentence = (
        f"Training on {PULSES} x 13 inputs and {OUTPUTS} outputs: {told['fit_s']:.1f} s, {told['evaluations']} "
        f"evaluations, converged: {told['converged']}, at most {told['bound']:.1g} lost of the likelihood, peak "
        f"{told['peak_bytes'] / 1e6:,.0f} MB; {PREDICTED} pulses with spread: {told['predict_s']:.2f} s."
    )
    broken = ["training over 60 s"] * (told["fit_s"] > 60) + ["not converged"] * (not told["converged"])
    broken += ["training over 2 GB"] * (told["peak_bytes"] > 2e9)
    return sentence, broken + ["prediction over 2 s"] * (told["predict_s"] > 2)


def main(arguments: list[str]) -> int:
    say = sys.stdout.write
    say("| pulses | way | loss and gradient | likelihood apart | peak memory |\n| ---: | --- | --- | --- | --- |\n")
    broken: list[str] = []
    for n in (*SMALL, PULSES):
        ways = tuple(way for way in WAYS if _wanted(way, n, "--full" in arguments))
        rows, missed = likelihoods(n, ways)
        say("\n".join(rows) + "\n")
        sys.stdout.flush()
        broken += missed
    sentence, missed = training()
    say(f"\n{sentence}\n\nnot kept: {'; '.join(broken + missed) or 'nothing'}\n")
    return 1 if broken + missed else 0


def _wanted(way: str, n: int, full: bool) -> bool:
    if way in YARDSTICKS:
        return n == PULSES
    return n < PULSES or full or way not in PEERS


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
