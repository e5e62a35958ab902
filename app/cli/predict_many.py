"""`predict --plan` and `predict --shots`: every shot of a plan or of a table, on this machine or a cluster."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from .common import note, print_table, write_json
from .completion import plan_names

if TYPE_CHECKING:
    from ...schema.session import Store
    from ..predictions.batch import Foretold
    from ..predictions.rows import ShotRow

MANY = (
    click.option(
        "--plan",
        metavar="NAME",
        default=None,
        help="Every run of a plan in place of one shot.",
        shell_complete=plan_names,
    ),
    click.option(
        "--shots",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        default=None,
        metavar="FILE.csv",
        help="Every row of a table with the columns of runs.csv.",
    ),
    click.option("--out", type=click.Path(path_type=Path), metavar="FILE", help="Their figures: .csv or .parquet."),
    click.option("--spectra", type=click.Path(path_type=Path), metavar="FILE", help="Their spectra, the same."),
)
#: Of a table on a screen: what names a shot, and what matters of it.
_SHOWN = ("run", "repetition", "tip_material", "bullet_mass_kg", "tank_pressure_bar")
_FIGURES = ("velocity_m_s", "contact_time_s", "peak_force_n")


@dataclass(frozen=True)
class Many:
    """Where the shots stand, and where what is foretold of them goes."""

    plan: str | None
    shots: Path | None
    out: Path | None
    spectra: Path | None

    @property
    def asked(self) -> bool:
        """Whether there is a table. Raises `ValueError` for options that go with one, without it."""
        if self.plan is None and self.shots is None and (self.out or self.spectra):
            raise ValueError("--out and --spectra go with --plan or --shots; one shot prints, or --json FILE")
        return self.plan is not None or self.shots is not None

    def rows(self, store: Store | None) -> list[ShotRow]:
        """Raises `ValueError` for plan and file at once, `LookupError` for a plan without a store."""
        from ..predictions.rows import rows_of_file, rows_of_plan

        if self.plan is None:
            assert self.shots is not None
            return rows_of_file(self.shots)
        if self.shots is not None:
            raise ValueError("--plan and --shots: expected one of them")
        if store is None:
            raise LookupError(f"no plan {self.plan!r}: there is no store")
        return rows_of_plan(store, self.plan)

    def tell(self, found: list[Foretold], json_to: str | None) -> None:
        """Into the files that were asked for; as JSON or a table where no file takes the figures."""
        from ..finite import finite
        from ..predictions.batch import write_figures, write_spectra

        if self.spectra is not None:
            note(f"written: {self.spectra}, {write_spectra(self.spectra, found)} lines")
        if self.out is not None:
            note(f"written: {self.out}, {write_figures(self.out, found)} shots")
        if json_to is not None:
            write_json([finite({**shot.figures, "srs": list(shot.spectrum)}) for shot in found], json_to)
        elif self.out is None:
            print_table((_short(shot) for shot in found), "")


def refuse_typed(*names: str) -> None:
    """Options that a table takes the place of would be passed over in silence. Raises `ValueError` that names them."""
    source = click.get_current_context().get_parameter_source
    typed = [f"--{name.replace('_', '-')}" for name in names if source(name) is ParameterSource.COMMANDLINE]
    if typed:
        raise ValueError(f"{', '.join(typed)}: of one shot; with --plan or --shots leave it out")


def _short(each: Foretold) -> dict[str, object]:
    row: dict[str, object] = {name: each.figures[name] for name in _SHOWN if name in each.figures}
    for name in _FIGURES:
        low, high = (each.figures[f"predicted_{name}_{end}"] for end in ("low", "high"))
        row |= {name: each.figures[f"predicted_{name}"], f"{name} 90 %": f"{low:.4g} to {high:.4g}"}
    return row | {name: each.figures[name] for name in ("rests_on_shots", "extrapolation")}
