"""How the error falls with the number of shots: a model learned anew from a part of its
configurations, and judged on the same held-out pulses.

A laboratory that plans further shots asks whether more of them make the model better. Whole
configurations are left out, since repetitions of what was learned tell little. The parts are
nested: the configurations of a smaller part are in every larger one of the same order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ...array_types import Floats
from ...dataset.table import PulseTable
from ..models.base import ContactModel
from .metrics import pulse_errors
from .summary import clustered, positive_interval

#: Parts of the configurations that are learned from.
SHARES = (0.25, 0.5, 0.75, 1.0)
#: Orders in which configurations are taken, for each part but the whole.
ORDERS = 3
_RESAMPLES = 2000
#: Called with the fits done, their number and what is being done.
Step = Callable[[int, int, str], None]


@dataclass(frozen=True)
class LearningPoint:
    """The mean force NRMSE on the held-out pulses after learning from a part of the configurations,
    with its 90 % interval over held-out configurations (None where there is a single one).

    `configurations` and `pulses` are those that were learned from, the mean over `orders`; `failed`
    counts the orders in which the model could not learn from so few.
    """

    share: float
    configurations: int
    pulses: int
    error: float
    low: float | None
    high: float | None
    orders: int
    failed: int = 0

    def as_json(self) -> dict[str, float | int | None]:
        """Plain data."""
        return asdict(self)


def learning_curve(
    model: ContactModel,
    training: PulseTable,
    held_out: PulseTable,
    rng: np.random.Generator,
    *,
    shares: Sequence[float] = SHARES,
    orders: int = ORDERS,
    step: Step = lambda *_: None,
) -> list[LearningPoint]:
    """The error on the same held-out pulses for a rising number of configurations.

    Parameters:
        model: A fitted model; each point is one that is learned and tuned anew (`relearn`).
        training: The pulses that the model was trained on.
        held_out: The pulses that it is judged on, none of them in `training`.
        rng: The generator of the orders and of the trainings.
        shares: Parts of the configurations, rising; by default a quarter to all.
        orders: In how many orders configurations are taken; all of them need one only.
        step: Called with the fits done, their number and what is being done.

    Returns:
        A point for each share of which the model could learn in one order at least.

    Raises:
        ValueError: Where the model can learn from no share.
    """
    names = np.unique(training.configuration)
    sequences = [rng.permutation(names) for _ in range(orders)]
    counts = [max(1, round(share * len(names))) for share in shares]
    tasks = [
        (share, count, sequence)
        for share, count in zip(shares, counts, strict=True)
        for sequence in (sequences if count < len(names) else sequences[:1])
    ]
    errors: dict[float, list[Floats]] = {share: [] for share in shares}
    sizes: dict[float, list[int]] = {share: [] for share in shares}
    tried = dict.fromkeys(shares, 0)
    reason = ""
    for done, (share, count, sequence) in enumerate(tasks):
        step(done, len(tasks), f"{count} of {len(names)} configurations")
        part = training.take(np.isin(training.configuration, sequence[:count]))
        tried[share] += 1
        try:
            prediction = model.relearn(part, rng.spawn(1)[0]).predict(held_out.inputs)
            errors[share].append(pulse_errors(held_out, prediction).force_nrmse)
        except ValueError as error:  # too few to learn from: the curve begins further to the right
            reason = str(error)
            continue
        sizes[share].append(len(part))
    step(len(tasks), len(tasks), "")
    if not any(errors.values()):
        raise ValueError(f"the model can learn from no part of its configurations: {reason}")
    return [
        _point(share, count, errors[share], sizes[share], tried[share], held_out, rng)
        for share, count in zip(shares, counts, strict=True)
        if errors[share]
    ]


def _point(
    share: float,
    count: int,
    errors: Sequence[Floats],
    sizes: Sequence[int],
    tried: int,
    held_out: PulseTable,
    rng: np.random.Generator,
) -> LearningPoint:
    mean = np.mean(errors, axis=0)
    low, high = positive_interval(clustered(mean[:, None], held_out.configuration), rng, _RESAMPLES)
    finite = bool(np.isfinite([low[0], high[0]]).all())
    return LearningPoint(
        share=share,
        configurations=count,
        pulses=round(float(np.mean(sizes))),
        error=float(mean.mean()),
        low=float(low[0]) if finite else None,
        high=float(high[0]) if finite else None,
        orders=len(errors),
        failed=tried - len(errors),
    )
