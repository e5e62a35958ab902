"""A plan of the store: its runs, their quality, their run sheet, and its virtual shots."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload
from urllib.parse import quote

from ....doe.plans import StoredPlan
from ....files.spreadsheet_guard import guarding
from ...common.errors import raises_library_errors
from ...common.frames import frame_of, step_bar, titled_table
from ...common.plan_tables import cells_of, plan_as_json, settings_in_si
from ...figures.matplotlib_renderer import plot_on
from ..operation import Result, ResultTable

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ....doe.merit.quality import Quality
    from ...common.frames import Quantity
    from ...figures.figure import Figure, Plot


class PlanQuality:
    """The quality of a design: balance, spread, changeovers, and what goes with time. `figures` has
    the numbers."""

    def __init__(self, stored: StoredPlan) -> None:
        from ....doe.merit.quality import quality

        self._stored = stored
        self._treatments = stored.treatments("planned", "done")
        self.figures: Quality = quality(stored.space, self._treatments)

    def to_frame(self) -> pd.DataFrame:
        """A row for each figure (index: its name), with its words, value, and whether less or more
        of it is better."""
        import pandas as pd

        from ....doe.merit.quality import FIGURES

        rows = [
            {"figure": name, "words": words, "value": getattr(self.figures, name), "better": better}
            for name, (words, better) in FIGURES.items()
        ]
        changes = [
            {
                "figure": f"changeovers_{name}",
                "words": f"changeovers, {name}",
                "value": count,
                "better": "less",
            }
            for name, count in self.figures.changeovers.items()
        ]
        return pd.DataFrame(rows + changes).set_index("figure")

    def plot(self, ax: Axes | None = None) -> Axes:
        """How far each pair of levels is from its share.

        Parameters:
            ax: The axes to draw on; by default new ones.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """How far each pair of levels is from its share, as a figure."""
        from ....doe.merit.pair_balance import level_labels, pair_matrix
        from .figures import pairs_figure

        space = self._stored.space
        return pairs_figure(level_labels(space), pair_matrix(space, self._treatments))

    def __repr__(self) -> str:
        shown = ", ".join(
            f"{name} {getattr(self.figures, name):.4g}" for name in ("worst_pair", "d_efficiency")
        )
        return f"<PlanQuality of {self._stored.name!r}: {self.figures.runs} runs, {shown}>"

    def _repr_html_(self) -> str:
        return titled_table(f"Quality of plan {self._stored.name}", self.to_frame(), 40)


class PlannedDesign(Result):
    """A plan of the store: its runs, their quality and their run sheet. `stored` is the plan of the
    database layer."""

    def __init__(self, stored: StoredPlan) -> None:
        self.stored = stored

    @property
    def name(self) -> str:
        return self.stored.name

    @property
    def method(self) -> str:
        """The method of design, with those of its options that are not the usual ones."""
        return self.stored.method

    @property
    def seed(self) -> int | None:
        return self.stored.seed

    def __len__(self) -> int:
        return len(self.stored.runs)

    def notes(self) -> Sequence[str]:
        """Size, method and seed, and what a two-level design cannot tell apart."""
        repetitions = sorted({run.repetitions for run in self.stored.runs})
        hits = " or ".join(map(str, repetitions))
        aliases = (f"aliased: {line}" for line in self.aliases())
        return (
            f"plan {self.name}: {len(self)} runs of {hits} repetitions, {self._made_by()}",
            *aliases,
        )

    def _made_by(self) -> str:
        return self.method if self.seed is None else f"{self.method}, seed {self.seed}"

    def tables(self) -> Sequence[ResultTable]:
        """The settings of every run, in order of run."""
        rows = ({"run": run.run, **settings_in_si(cells_of(run))} for run in self.stored.runs)
        return (ResultTable("", tuple(rows), "no runs"),)

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock plan status --json` prints it: numbers in SI, the unit in the key."""
        return plan_as_json(self.stored)

    def address(self) -> str:
        """The page of the plan."""
        return f"/plans/{quote(self.name, safe='')}"

    def summary(self) -> str:
        """Runs and seed."""
        return f"{len(self)} runs" + ("" if self.seed is None else f", seed {self.seed}")

    def next_command(self) -> Sequence[str]:
        """The run sheet is printed next."""
        return ("plan", "sheet", self.name, "--out", f"{self.name}.html")

    def to_frame(self) -> pd.DataFrame:
        """A row for each run, in order of run: its state, its factors and what follows from them,
        numbers in SI.

        Columns of quantities end in their unit ("tank_pressure_pa"); `.attrs["units"]` has the unit
        of each.
        """
        own = {f.column: str(f.unit) for f in self.stored.space.factors if f.numbers is not None}
        rows = []
        for run in self.stored.runs:
            cells: dict[str, Any] = {
                "run": run.run,
                "status": run.status,
                "repetitions": run.repetitions,
            }
            for column, text in settings_in_si(cells_of(run)).items():
                cells[column] = float(text) if column in own else text
            rows.append(
                cells
                | {
                    "recorded": len(run.accepted),
                    "rejected": len(run.rejected),
                    "reason": run.reason,
                }
            )
        frame = frame_of(rows)
        frame.attrs["units"] |= {column: unit for column, unit in own.items() if column in frame}
        return frame

    @raises_library_errors
    def quality(self) -> PlanQuality:
        """Of the runs that are not discarded. Raises `InvalidValueError` where none is left."""
        return PlanQuality(self.stored)

    def aliases(self) -> list[str]:
        """What a two-level design cannot tell apart: "tip_radius = plate_material*insulator"; none
        of other designs."""
        from ....doe.merit.quality import alias_lines, aliases

        treatments = self.stored.treatments("planned", "done")
        return alias_lines(aliases(self.stored.space, treatments)) if len(treatments) else []

    @overload
    def sheet(self, path: None = None, *, spreadsheet_guard: bool = True) -> str: ...

    @overload
    def sheet(self, path: str | os.PathLike[str], *, spreadsheet_guard: bool = True) -> Path: ...

    @raises_library_errors
    def sheet(
        self, path: str | os.PathLike[str] | None = None, *, spreadsheet_guard: bool = True
    ) -> str | Path:
        """The run sheet.

        Parameters:
            path: The file to write: .csv, .xlsx or .html. By default nothing is written.
            spreadsheet_guard: Whether in CSV a text that begins with = + - @ gets an apostrophe, so
                that no spreadsheet takes it for a formula.

        Returns:
            The text of the sheet as CSV, or the path that was written.

        Raises:
            InvalidValueError: For another suffix.
        """
        from ....doe.sheet import sheet_text, write_sheet

        with guarding(spreadsheet_guard):
            if path is None:
                return sheet_text(self.stored)
            write_sheet(self.stored, Path(path))
        return Path(path)

    @raises_library_errors
    def simulate(
        self,
        folder: str | os.PathLike[str],
        *,
        seed: int = 0,
        effects: Mapping[str, float] | None = None,
        echoes: bool = False,
        name: str | None = None,
        repetitions: int | None = None,
        trigger: str | float | None = None,
        pre_trigger: Quantity | None = None,
        jobs: int | None = None,
        progress: bool = True,
    ) -> Path:
        """Fire the plan on the virtual bench into a new campaign folder, as `pyroshock simulate`
        does.

        What was set and what really happened is in FOLDER.sealed.json beside the folder.

        Parameters:
            folder: The campaign folder that is made.
            seed: Seed of the bench: the same seed gives the same files.
            effects: Strength of effects by name ({"gun.blow_by": 3}): 0 takes an effect away; 1,
                the default, is a realistic bench's.
            echoes: Whether the edges of the plate act on what strikes it while it touches.
            name: The name of the campaign; by default the plan's.
            repetitions: Hits or shots of each run; by default the plan's.
            trigger: The share of the tank's pressure whose loss starts a recording of a gun: "5%"
                or 0.05; "none" for a recorder that is started by hand. By default 5 %.
            pre_trigger: The time that is recorded before the trigger, in s, as text with a unit or
                a quantity of pint; by default 300 ms.
            jobs: The number of processes; by default one for each core, at most 4.
            progress: Whether a bar shows the progress.

        Returns:
            The folder, as `store.ingest` takes it.

        Raises:
            InvalidValueError: For a folder that is not empty, and for what cannot be fired.
        """
        from .rehearsal import simulate_plan

        with step_bar(self.name, "recordings", progress) as step:
            return simulate_plan(
                self.stored,
                Path(folder),
                seed=seed,
                effects=effects,
                echoes=echoes,
                name=name,
                repetitions=repetitions,
                trigger=trigger,
                pre_trigger=pre_trigger,
                jobs=jobs,
                progress=step,
            ).folder

    def plot(self, ax: Axes | None = None) -> Axes:
        """The levels of every factor from run to run.

        Parameters:
            ax: The axes to draw on; by default new ones.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The levels of every factor from run to run, as a figure."""
        from .figures import run_order_figure

        title = f"{self.name}: {len(self)} runs"
        treatments = self.stored.treatments("planned", "done")
        return run_order_figure(self.stored.space, treatments, title)

    def figures(self) -> Sequence[Figure]:
        """The levels of every factor from run to run."""
        return (self.figure(),)

    def __repr__(self) -> str:
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"<PlannedDesign {self.name!r}: {len(self)} runs, {self.method}{seed}>"

    def _repr_html_(self) -> str:
        return titled_table(repr(self)[1:-1], self.to_frame())
