"""Work that is begun again where what stopped it passes, with growing pauses of random length, until patience ends."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

Result = TypeVar("Result")


@dataclass(frozen=True)
class Patience:
    """How long to go on: seconds by a clock that nobody sets, and the pauses between two attempts."""

    total_s: float = 120.0
    shortest_s: float = 0.02
    longest_s: float = 5.0

    def pause_s(self, attempt: int, rng: random.Random) -> float:
        """After the attempt of this number. Random, so that those who met once do not meet again."""
        return rng.uniform(0.5, 1.0) * min(self.longest_s, self.shortest_s * 2.0 ** min(attempt, 30))


def rerun(
    attempt: Callable[[], Result],
    again: Callable[[Exception, int], bool],
    patience: Patience = Patience(),
    *,
    sleep: Callable[[float], None] = time.sleep,
    clock: Callable[[], float] = time.monotonic,
) -> Result:
    """What `attempt` returns. An error for which `again(error, number of attempts)` holds has it called once more;
    any other, or one after `patience`, is raised."""
    deadline, number, rng = clock() + patience.total_s, 0, random.Random()
    while True:
        number += 1
        try:
            return attempt()
        except Exception as error:
            pause_s = patience.pause_s(number, rng)
            if not again(error, number) or clock() + pause_s > deadline:
                raise
        sleep(pause_s)
