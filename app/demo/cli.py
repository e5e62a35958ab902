"""`demo`: the main job, on measurements that ship with the software."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..cli.common import json_option, note, open_command_store, print_table, write_json

if TYPE_CHECKING:
    from ...schema.session import Store
    from .demo import GunComparison

#: The rehearsal's run sheet, among the results.
SHEET = "rehearsal-sheet.html"
#: The predicted shot, drawn.
SHOT = "predicted-shot.png"


@click.command()
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results"),
    show_default=True,
    help="Folder of the results.",
)
@click.option("--db", metavar="URL", help="Store to fill. [sqlite:///OUT/demo.db]")
@json_option
def demo(out: Path, db: str | None, json_to: str | None) -> None:
    """Ingest five measured gun shots and a real hammer hit, and hold them against what was published.

    \b
    Example:
        pyroshock demo --out results
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise click.UsageError(f"cannot make the folder {str(out)!r}: {error.strerror}") from error
    url = db or f"sqlite:///{out / 'demo.db'}"
    picture = out / "demo.png"
    with open_command_store(url, create=True) as store:
        from . import demo as job

        for report in job.ingest_examples(store):
            counts = f"{report.recordings} recordings, {report.impacts} impacts, {report.shots} shots"
            note(f"ingested {report.campaign}: {counts}")
        with store.reading() as session:
            comparison = job.compare_with_table_5_1(session)
            hit = job.hit_figures(session)
            job.draw(session, comparison, picture)
        rehearsal = _rehearse(store, out)
        prediction, notes = job.predict_a_shot(store, url)
    from ..predict.tables import plot_prediction, quantity_rows

    plot_prediction(prediction, out / SHOT)
    predicted = list(quantity_rows(prediction))
    if json_to is not None:
        data: dict[str, Any] = {"shots": comparison.rows, "hit": hit}
        data["mean_error_percent"] = comparison.mean_error_percent
        data["stated_mean_error_percent"] = comparison.stated_mean_error_percent
        data["rehearsal"], data["prediction"] = rehearsal, predicted
        write_json(data, json_to)
        return
    click.echo("Five gun shots (Table 3.1), our prediction beside Table 5.1 of the thesis:")
    print_table(comparison.rows, "none")
    for line in _error_lines(comparison):
        click.echo(line)
    click.echo("\nOne hit of a modal hammer, cut from its LabVIEW record:")
    print_table([hit], "none")
    click.echo(
        "\nA campaign before the first real one: planned, played on the virtual bench, ingested, held against its plan:"
    )
    print_table([rehearsal], "none")
    click.echo("\nA shot that was not fired, the same bullet at 0.5 bar, with its 90 % bands:")
    print_table(predicted, "none")
    for line in notes:
        note(line)
    from ...schema.addresses import address_for_display

    address = address_for_display(url)
    files = "\n  ".join(str(out.resolve() / name) for name in ("demo.png", SHOT, SHEET))
    click.echo(f"\nThe results are here:\n  {files}\n  store: {address}")
    command = "pyroshock" if shutil.which("pyroshock") else sys.argv[0]
    click.echo(f"Look around:\n  {command} impacts --db {address}\n  {command} shots --db {address}")
    click.echo(f"As pages, with pyroshock[web]:\n  {command} serve --db {address} --open")


def _error_lines(comparison: GunComparison) -> tuple[str, str]:
    from .demo import DRY_FRICTION, STATED_TRAVEL_M

    gun = comparison.gun
    return (
        f"mean absolute error {comparison.mean_error_percent:.2f} % "
        f"(from the thesis's printed column: {comparison.published_mean_error_percent:.2f} %); the travel of "
        f"{gun.travel_m:.2f} m and the friction of {gun.friction_coefficient:g} were identified from the printed "
        "predictions",
        f"with the stated travel of {STATED_TRAVEL_M:g} m and a friction of {DRY_FRICTION:g}: "
        f"{comparison.stated_mean_error_percent:.2f} %",
    )


def _rehearse(store: Store, out: Path) -> dict[str, Any]:
    from ...doe.plans import read_plan
    from ...doe.sheet import write_sheet
    from ..common.progress import progress_bar
    from ..plan import rehearsal

    with progress_bar(rehearsal.NAME, "recordings") as step:
        came = rehearsal.rehearse(store, out / rehearsal.NAME, step)
    with store.reading() as session:
        write_sheet(read_plan(session, rehearsal.NAME), out / SHEET)
    return came.as_row()
