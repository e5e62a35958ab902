"""Settings of the bench for a prescribed spectrum, as notebooks see them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ....twin.tune.probability import DRAWS
from ...common.errors import argument_names, library_errors
from ...common.frames import frame_of, titled_table
from ...common.number_format import finite
from ...figures.matplotlib_renderer import plot_on
from ..operation import Result, ResultTable
from .bench_adapter import NONE, SHOWN, avoid_json, level_m_s2, proposal_rows
from .verdict import answer_sentences, tuning_sentences, tuning_tables

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ....schema.session import Store
    from ....twin.srs.target import Target
    from ....twin.tune.goal import Goal
    from ....twin.tune.tuner import Tuned
    from ...common.progress import Step
    from ...figures.figure import Figure, Plot
    from ...twins.building import TwinRequest
    from ..sentence import Sentence
    from .request import SpectrumSearch

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
class TunedSettings(Result):
    """Ranked settings, each with the probability that every line of the spectrum lies within its
    tolerance.

    `tuned` is the result of the tuner behind it, `assumptions` say what was assumed of `twin`.
    """

    tuned: Tuned
    goal: Goal
    assumptions: tuple[str, ...]
    twin: TwinRequest

    @property
    def sentence(self) -> str:
        """Whether any setting meets the target, how likely, and what stands in the way where none
        does."""
        return argument_names(self.summary())

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
        return frame_of(
            ({**avoid_json(item)["settings"], "why": item.reason} for item in self.tuned.avoid),
            ("why",),
        )

    def notes(self) -> Sequence[str]:
        """What was assumed."""
        return self.assumptions

    def sentences(self) -> Sequence[Sentence]:
        """The answer, and the best setting."""
        return tuning_sentences(self.job_data())

    def tables(self) -> Sequence[ResultTable]:
        """The answer, the settings, what stands in the way, and the settings to avoid."""
        return tuning_tables(self.job_data())

    @property
    def exit_code(self) -> int:
        """1 where no setting meets the target."""
        return 0 if self.attainable else 1

    def summary(self) -> str:
        """The answer in words."""
        return str(self.job_data()["attainability"]["sentence"])

    def next_command(self) -> Sequence[str]:
        """The best setting is predicted whole."""
        rows = self.to_json()
        if not rows or not self.attainable:
            return ()
        best = rows[0]["settings"]
        anvil = (
            ()
            if best["anvil_material"] == NONE
            else ("--anvil", best["anvil_material"], "--insulator", best["insulator"])
        )
        return (
            "predict", "--tank-pressure", f"{best['tank_pressure_pa'] / 1e5:.4g}bar",
            "--bullet-mass", f"{best['bullet_mass_kg']:.4g}kg",
            "--tip", best["tip_material"], "--tip-radius", f"{best['tip_radius_m'] * 1e3:.4g}mm",
            *anvil, "--impact-position", best["impact_position"],
        )  # fmt: skip

    def job_data(self) -> dict[str, Any]:
        """`tune --json`, with whether the target is met, the target, what to avoid, and notes."""
        goal = self.goal
        data: dict[str, Any] = {
            "draws": DRAWS,
            "attainability": finite(self.tuned.attainability.as_json()),
            "proposals": self.to_json(),
            "avoid": [avoid_json(setting) for setting in self.tuned.avoid[:SHOWN]],
            "notes": list(self.assumptions),
            "frequency_hz": goal.frequency_hz.tolist(),
            "prescribed_m_s2": level_m_s2(goal.level_db).tolist(),
            "lower_m_s2": level_m_s2(goal.level_db - goal.lower_db.clip(0, 200)).tolist(),
            "upper_m_s2": level_m_s2(goal.level_db + goal.upper_db.clip(0, 200)).tolist(),
            "twin": {name: getattr(self.twin, name) for name in ("campaign", "contact", "plate")},
        }
        data["attainability"]["sentence"] = " ".join(map(str, answer_sentences(data)))
        return data

    def to_json(self) -> list[dict[str, Any]]:
        """As `pyroshock tune --json` prints it."""
        return proposal_rows(self.tuned)

    def figures(self) -> Sequence[Figure]:
        """The expected spectra of the best settings, where there are any."""
        return (self.figure(),) if self.tuned.proposals else ()

    def plot(self, ax: Axes | None = None) -> Axes:
        """The expected spectra of the best settings in the tolerance of the target.

        Parameters:
            ax: The axes to draw on; by default new ones.

        Raises:
            NotFoundError: Where the bench refuses every setting.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The expected spectra of the best settings in the tolerance of the target, as a figure.

        Raises:
            NotFoundError: Where the bench refuses every setting.
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
    """A prescribed spectrum in m/s2.

    Parameters:
        given: The path of a CSV file, a Series over the frequency in Hz (m/s2), a DataFrame with
            the columns frequency_hz and level_m_s2 or level_g, a pair of arrays (n,) in Hz and
            m/s2, or a target.
        tolerance: "6dB", "+9/-6dB" or a number in dB, either way; by default that of `given`, else
            NASA-STD-7003's.

    Raises:
        ValueError: For a table without these columns, frequencies that do not rise, and a tolerance
            of another form.
    """
    from ....twin.srs.standards import parse_tolerance, within_db
    from ....twin.srs.target import Target
    from ....twin.srs.target_csv import read_target, target_of_csv

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


def search_settings(
    store: Store | None,
    url: str,
    target: Target,
    search: SpectrumSearch,
    twin: TwinRequest,
    step: Step,
) -> TunedSettings:
    """The settings for a spectrum.

    Parameters:
        store: The store whose campaigns are learned from; None: the shipped bench.
        url: The address of the store, beside which models and solved plates lie.
        target: The prescribed spectrum.
        search: What the laboratory owns, and what counts as meeting the target.
        twin: The twin that predicts.
        step: Receives the progress.

    Raises:
        LookupError: For an unknown campaign, sensor or contact model.
        ValueError: For a target whose lines the twin does not predict.
    """
    from ...common.model_registry import models_extra
    from .session import session_of

    with models_extra():
        session = session_of(store, url, target, search, twin)
    return TunedSettings(session.run(step), session.goal, session.notes, session.answering)
