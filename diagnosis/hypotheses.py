"""What may be the matter, and how likely each is before any evidence."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Priors:
    """Shares of "none", of all single effects together, of all pairs together, and of "unknown"."""

    none: float = 0.2
    singles: float = 0.5
    pairs: float = 0.1
    unknown: float = 0.2

    def __post_init__(self) -> None:
        shares = (self.none, self.singles, self.pairs, self.unknown)
        if min(shares) < 0 or abs(sum(shares) - 1) > 1e-9:
            raise ValueError(f"priors {shares}: expected shares of none, singles, pairs, unknown that sum to one")
