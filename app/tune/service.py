"""Settings of the bench for a prescribed spectrum, as notebooks see them."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..common.errors import argument_names, library_errors
from ..common.frames import frame_of, si, titled_table
from ..figures.matplotlib_renderer import plot_on

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ...doe.space import Space
    from ...schema.session import Store
    from ...twin.srs.target import Target
    from ...twin.tune.goal import Goal
    from ...twin.tune.space import Amount
    from ...twin.tune.tuner import Tuned
    from ..common.frames import Quantity
    from ..common.progress import Step
    from ..figures.figure import Plot
    from .session import Ask

    #: A CSV file, a Series, a DataFrame, frequencies and levels, or a target of the twin.
    TargetLike = (
        str
        | os.PathLike[str]
        | pd.Series[Any]
        | pd.DataFrame
        | tuple[ArrayLike, ArrayLike]
        | Target
    )


@dataclass(frozen=True, eq=False)
class TunedSettings:
    """Ranked settings, each with the probability that every line of the spectrum lies within its
    tolerance.

    `tuned` is the result of the tuner behind it, `notes` say what was assumed.
    """

    tuned: Tuned
    goal: Goal
    notes: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """Whether any setting meets the target, how likely, and what stands in the way where none
        does."""
        return argument_names(self.tuned.attainability.sentence)

    @property
    def attainable(self) -> bool:
        """Whether a setting meets the target with the probability that was asked for."""
        return self.tuned.attainability.obstacle is None

    @property
    def probability(self) -> float:
        """Of the best setting, that it meets the target."""
        return self.tuned.attainability.probability

    @property
    def spectra(self) -> pd.DataFrame:
        """A line in each row: the target with the edges of its tolerance, and the expected spectrum
        of each setting with its 90 % band, m/s2; settings are called by their rank."""
        import pandas as pd

        goal = self.goal
        columns = {
            "target": 10 ** (goal.level_db / 20),
            "tolerance_lower": 10 ** ((goal.level_db - goal.lower_db) / 20),
            "tolerance_upper": 10 ** ((goal.level_db + goal.upper_db) / 20),
        }
        for row in self.to_json():
            for end in ("expected", "lower", "upper"):
                columns[f"{end}_{row['rank']}"] = np.asarray(row[f"{end}_m_s2"])
        frame = pd.DataFrame(columns, index=pd.Index(goal.frequency_hz, name="frequency_hz"))
        frame.attrs["units"] = {"frequency_hz": "Hz", **dict.fromkeys(columns, "m/s2")}
        return frame

    @property
    def alternatives(self) -> pd.DataFrame:
        """Settings that promise the same as one of the table, whose `rank` they have."""
        return frame_of(
            (
                {"rank": row["rank"], **setting}
                for row in self.to_json()
                for setting in row["alternatives"]
            ),
            ("rank",),
        )

    def to_frame(self) -> pd.DataFrame:
        """A setting in each row, the best first: settings in SI, probabilities, worst margin and
        its frequency."""
        rows = []
        for row in self.to_json():
            listed = {
                name: value for name, value in row.items() if not isinstance(value, dict | list)
            }
            rows.append({**listed, **row["settings"], "alternatives": len(row["alternatives"])})
        return frame_of(rows, ("rank",))

    @property
    def avoid(self) -> pd.DataFrame:
        """Settings to avoid, with the reason."""
        from .bench_adapter import avoid_json

        return frame_of(
            ({**avoid_json(item)["settings"], "why": item.reason} for item in self.tuned.avoid),
            ("why",),
        )

    def to_json(self) -> list[dict[str, Any]]:
        """As `pyroshock tune --json` prints it."""
        from .bench_adapter import proposal_rows

        return proposal_rows(self.tuned)

    def plot(self, ax: Axes | None = None) -> Axes:
        """The expected spectra of the best settings in the tolerance of the target.

        Raises `LookupError` where the bench refuses every setting.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The expected spectra of the best settings in the tolerance of the target, as a figure.

        Raises `LookupError` where the bench refuses every setting.
        """
        from .figures import goal_figure

        if not self.tuned.proposals:
            with library_errors():
                raise LookupError(f"there is no setting to draw: {self.sentence}")
        return goal_figure(self.tuned, self.goal)

    def __repr__(self) -> str:
        return f"<{self.sentence}>"

    def _repr_html_(self) -> str:
        return titled_table(self.sentence, self.to_frame())


def target_of(given: TargetLike, tolerance: str | float | None = None) -> Target:
    """A prescribed spectrum in m/s2; a number is a tolerance in dB, either way.

    Without a tolerance of its own or a given one, NASA-STD-7003's is taken. Raises `ValueError` as
    `target_csv.read_target` and `Target`.
    """
    from ...twin.srs.standards import parse_tolerance, within_db
    from ...twin.srs.target import Target
    from ...twin.srs.target_csv import read_target, target_of_csv

    if isinstance(tolerance, str):
        wanted = parse_tolerance(tolerance) if tolerance else None
    else:
        wanted = None if tolerance is None else within_db(tolerance)
    if isinstance(given, Target):
        return given if wanted is None else given.with_tolerance(wanted)
    if isinstance(given, str | os.PathLike):
        return read_target(Path(given), wanted)
    import pandas as pd

    if isinstance(given, pd.DataFrame):
        table = given if "frequency_hz" in given.columns else given.reset_index()
    elif isinstance(given, pd.Series):
        table = pd.DataFrame(
            {"frequency_hz": np.asarray(given.index), "level_m_s2": np.asarray(given)}
        )
    else:
        frequency, level = (np.asarray(part, dtype=np.float64) for part in given)
        table = pd.DataFrame({"frequency_hz": frequency, "level_m_s2": level})
    return target_of_csv(table.to_csv(index=False).encode(), "target", wanted)


def search_settings(store: Store | None, url: str, ask: Ask, step: Step) -> TunedSettings:
    """The search for what is asked, at the lines of its target. Raises as
    `tuning.session.session_of`."""
    from ..common.model_registry import models_extra
    from .session import session_of

    lines = tuple(ask.target.lines().tolist())
    with models_extra():
        session = session_of(
            store, url, replace(ask, request=replace(ask.request, frequency_hz=lines))
        )
    return TunedSettings(session.run(step), session.goal, session.notes)


def factors_of(path: str | os.PathLike[str] | None) -> Space:
    """What a laboratory owns: of a plan's TOML file, or the levels that ship with the software.
    Raises `ValueError`."""
    from ...doe.space import read_space, shipped_factors, space_from_text

    return space_from_text(shipped_factors("gun")) if path is None else read_space(Path(path))


def masses_of(given: Quantity | Iterable[Quantity] | None, name: str) -> Amount | None:
    """Masses that the laboratory owns: one, several ("0.2kg,0.5kg", or a list), or any between two
    ("0.2kg:1kg").

    Raises `ValueError` that says `name`.
    """
    from ...twin.tune.space import ContinuousRange, Levels

    if given is None:
        return None
    if isinstance(given, str) and ":" in given:
        low, high = sorted(si(end, "kg", name) for end in given.split(":", 1))
        return Levels((low,)) if math.isclose(low, high) else ContinuousRange(low, high)
    if isinstance(given, str):
        return Levels(tuple(si(mass, "kg", name) for mass in given.split(",")))
    several = isinstance(given, Iterable) and not hasattr(given, "units")
    masses: Any = given if several else [given]
    return Levels(tuple(si(mass, "kg", name) for mass in masses))
