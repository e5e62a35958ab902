"""Settings of the bench for a prescribed spectrum, as notebooks see them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .displays import axes_or_new, titled_table
from .frames import frame_of
from .progress import step_bar
from .quantities import si

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ...doe.space import Space
    from ...schema.session import Store
    from ...twin.srs.target import Target
    from ...twin.tune.goal import Goal
    from ...twin.tune.space import Amount
    from ...twin.tune.tuner import Tuned
    from ..twins.building import TwinRequest
    from .quantities import Quantity

    #: A CSV file, a Series, a DataFrame, frequencies and levels, or a target of the twin.
    TargetLike = str | os.PathLike[str] | pd.Series[Any] | pd.DataFrame | tuple[ArrayLike, ArrayLike] | Target

#: Rows of tables and of JSON.
SHOWN = 10


@dataclass(frozen=True, eq=False)
class TunedSettings:
    """Ranked settings, each with the probability that every line of the spectrum lies within its tolerance.

    `tuned` is the result of the tuner behind it, `notes` say what was assumed.
    """

    tuned: Tuned
    goal: Goal
    notes: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """Whether any setting meets the target, how likely, and what stands in the way where none does."""
        return self.tuned.attainability.sentence

    @property
    def attainable(self) -> bool:
        """Whether a setting meets the target with the probability that was asked for."""
        return self.tuned.attainability.obstacle is None

    def to_frame(self) -> pd.DataFrame:
        """A setting in each row, the best first: settings in SI, probabilities, worst margin and its frequency."""
        rows = []
        for row in self.to_json():
            listed = {name: value for name, value in row.items() if not isinstance(value, dict | list)}
            rows.append({**listed, **row["settings"], "alternatives": len(row["alternatives"])})
        return frame_of(rows, ("rank",))

    def avoid(self) -> pd.DataFrame:
        """Settings to avoid, with the reason."""
        from ..tuning.laboratory import avoid_json

        return frame_of(({**avoid_json(item)["settings"], "why": item.reason} for item in self.tuned.avoid), ("why",))

    def to_json(self) -> list[dict[str, Any]]:
        """As `pyroshock tune --json` prints it."""
        from ..tuning.laboratory import proposal_json

        return [proposal_json(proposal, rank) for rank, proposal in enumerate(self.tuned.proposals[:SHOWN], 1)]

    def plot(self, ax: Axes | None = None) -> Axes:
        """The expected spectra of the best settings in the tolerance of the target.

        Raises `LookupError` where the bench refuses every setting.
        """
        from ..tuning.plots import draw_tuned

        if not self.tuned.proposals:
            raise LookupError(f"there is no setting to draw: {self.sentence}")
        axes = axes_or_new(ax, 8.0, 5.0)
        draw_tuned(axes, self.tuned, self.goal)
        return axes

    def __repr__(self) -> str:
        return f"<{self.sentence}>"

    def _repr_html_(self) -> str:
        return titled_table(self.sentence, self.to_frame())


def target_of(given: TargetLike, tolerance: str | None = None) -> Target:
    """A prescribed spectrum in m/s2. Raises `ValueError` as `target_csv.read_target` and `Target`.

    Without a tolerance of its own or a given one, NASA-STD-7003's is taken.
    """
    from ...twin.srs.target import Target
    from ...twin.srs.target_csv import read_target, target_of_csv
    from ...twin.srs.tolerance import parse_tolerance

    wanted = parse_tolerance(tolerance) if tolerance else None
    if isinstance(given, Target):
        return given if wanted is None else given.with_tolerance(wanted)
    if isinstance(given, str | os.PathLike):
        return read_target(Path(given), wanted)
    import pandas as pd

    if isinstance(given, pd.DataFrame):
        table = given if "frequency_hz" in given.columns else given.reset_index()
    elif isinstance(given, pd.Series):
        table = pd.DataFrame({"frequency_hz": np.asarray(given.index), "level_m_s2": np.asarray(given)})
    else:
        frequency, level = (np.asarray(part, dtype=np.float64) for part in given)
        table = pd.DataFrame({"frequency_hz": frequency, "level_m_s2": level})
    return target_of_csv(table.to_csv(index=False).encode(), "target", wanted)


def tuned_settings(
    store: Store | None,
    url: str,
    request: TwinRequest,
    target: TargetLike,
    *,
    tolerance: str | None = None,
    measured: str | Sequence[str] = (),
    sensor: str | None = None,
    bullet_mass: Quantity | Iterable[Quantity] | None = None,
    factors: str | os.PathLike[str] | None = None,
    share: float = 1.0,
    at_least: float = 0.5,
    extrapolate: bool = False,
    seed: int = 0,
    progress: bool = True,
) -> TunedSettings:
    """Search the settings of a bench for a prescribed spectrum.

    `bullet_mass` is one mass, or the masses that the laboratory owns; `factors` a plan's TOML file with all that it
    owns; `measured` campaigns whose shots teach the search. A setting meets the target from the probability `at_least`
    on, where the `share` of all lines lies within. Raises as `tuning.session.session_of`, and `LookupError` without a
    store.
    """
    from ...doe.space import read_space, shipped_factors, space_from_text

    if store is None:
        raise LookupError("tune needs a store: open one with pyroshock.open(...), and take the twin of a campaign")
    owned = read_space(Path(factors)) if factors else space_from_text(shipped_factors("gun"))
    campaigns = (measured,) if isinstance(measured, str) else tuple(measured)
    ask_target = target_of(target, tolerance)
    with step_bar("tune", "settings", progress) as step:
        return search_settings(
            store, url, request, ask_target, owned, campaigns, sensor, _masses(bullet_mass), share, extrapolate, seed,
            at_least, step,
        )  # fmt: skip


def search_settings(
    store: Store,
    url: str,
    request: TwinRequest,
    target: Target,
    factors: Space,
    measured: tuple[str, ...],
    sensor: str | None,
    masses: Amount | None,
    share: float,
    extrapolate: bool,
    seed: int,
    at_least: float,
    step: Any,
) -> TunedSettings:
    """The search itself, of what was read. Raises as `tuning.session.session_of`."""
    from ..models.training import models_extra
    from ..tuning.session import Ask, session_of

    lined = replace(request, frequency_hz=tuple(target.lines().tolist()))
    ask = Ask(target, lined, factors, measured, sensor, masses, share, extrapolate, seed, at_least)
    with models_extra():
        session = session_of(store, url, ask)
    return TunedSettings(session.run(step), session.goal, session.notes)


def _masses(given: Quantity | Iterable[Quantity] | None) -> Amount | None:
    from ...twin.tune.space import Levels

    if given is None:
        return None
    several = isinstance(given, Iterable) and not isinstance(given, str) and not hasattr(given, "units")
    masses: Any = given if several else [given]
    return Levels(tuple(si(mass, "kg", "bullet_mass") for mass in masses))
