"""`report`: a campaign, a diagnosis or a model as one file to send, print or keep."""

from __future__ import annotations

from pathlib import Path

import click

from ...common.progress import progress_bar
from ..command_line.common import db_option, note, open_command_store, units_option
from ..command_line.completion import subject_names
from ..command_line.next_step import suggest_next


@click.command()
@click.argument("subject", metavar="CAMPAIGN|DIAGNOSIS|MODEL", shell_complete=subject_names)
@db_option
@units_option
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write to FILE.html or FILE.pdf.",
)
def report(subject: str, db: str, out: Path) -> None:
    """Write a report as one file that needs no other file: a page (.html) or a PDF.

    A campaign is given by its name, a diagnosis by diagnosis:ID or diagnosis:CAMPAIGN (its newest),
    a model by NAME@VERSION or models:/NAME@VERSION. A file of the same name is replaced.

    \b
    Example:
        pyroshock report rehearsal --out rehearsal.html
        pyroshock report diagnosis:slow-valve --out gap.pdf
        pyroshock report gp@1 --out gp.pdf
    """
    progress = progress_bar(f"Writing the report on {subject}")
    with open_command_store(db) as store:
        from ...documents.write import check_ending, write_report
        from ...report.dispatch import report_on

        check_ending(out)
        with progress:
            write_report(report_on(store, db, subject), out)
    note(f"written: {out}")
    suggest_next(*_after(subject))


def _after(subject: str) -> tuple[str, ...]:
    """A diagnosis leads to runs that tell its causes apart, a model to its rivals, a campaign to a
    copy of it."""
    kind, _, name = subject.rpartition(":")
    if kind == "diagnosis":
        return ("diagnoses", "list") if name.isdecimal() else ("plan", "discriminate", name)
    return ("compare",) if "@" in name else ("db", "export", name, "--out", f"{name}.pyroshock")
