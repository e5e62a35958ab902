"""`demo`: the whole way from measured shots to a smaller gap, in five chapters."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...schema.addresses import address_for_display
from ..common.progress import progress_bar
from ..doors.command_line.common import (
    json_option,
    note,
    open_command_store,
    print_table,
    write_json,
)
from ..figures.matplotlib_renderer import write_figure

if TYPE_CHECKING:
    from ...schema.session import Store
    from .chapters import TrainedModel
    from .demo import GunComparison

#: The rehearsal's run sheet, among the results.
SHEET = "rehearsal-sheet.html"
#: The predicted shot, drawn.
SHOT = "predicted-shot.png"
#: The picture of each chapter.
PICTURES = {
    1: "demo.png",
    2: "rehearsal.png",
    3: "contact-model.png",
    4: "validation.png",
    5: "diagnosis.png",
}
TITLES = {
    1: "Five measured gun shots beside the thesis",
    2: "A campaign on the virtual bench",
    3: "A contact model",
    4: "Predictions of shots that the twin has not seen",
    5: "A gap between twin and bench",
}
#: The user's own campaign, in the last line.
NEXT = "ingest my-campaign/"


@click.command()
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results"),
    show_default=True,
    help="Write the results to this folder.",
)
@click.option("--db", metavar="URL", help="Fill this store. [default: sqlite:///OUT/demo.db]")
@click.option(
    "--chapters",
    type=click.IntRange(1, len(TITLES)),
    default=len(TITLES),
    show_default=True,
    help="Stop after this number of chapters.",
)
@json_option
def demo(out: Path, db: str | None, chapters: int, json_to: str | None) -> None:
    """Show the product in five chapters.

    The chapters are measured shots beside the thesis, a virtual campaign, a contact model, its
    validation, and a gap that a diagnosis shrinks.

    \b
    Example:
        pyroshock demo --chapters 2
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise click.UsageError(f"cannot make the folder {str(out)!r}: {error.strerror}") from error
    url = db or f"sqlite:///{out / 'demo.db'}"
    with open_command_store(url, create=True) as store:
        story = _Story(store, url, out, silent=json_to is not None)
        for number, chapter in CHAPTERS.items():
            if number <= chapters and number not in story.skipped:
                with story.chapter(number):
                    chapter(story)
    if json_to is not None:
        write_json(story.data, json_to)
        return
    _tell_addresses(out, url, [*PICTURES.values(), SHOT, SHEET])


@dataclass
class _Story:
    """The demo as far as it is told: `data` for --json, and `skipped`, the chapters whose extra is
    not installed."""

    store: Store
    url: str
    out: Path
    silent: bool
    data: dict[str, Any] = field(default_factory=dict)
    skipped: set[int] = field(default_factory=set)

    @contextmanager
    def chapter(self, number: int) -> Iterator[None]:
        """The chapter's heading before, its picture and its seconds after it."""
        blank = "\n" if number > 1 else ""
        self.tell(f"{blank}Chapter {number} of {len(TITLES)}. {TITLES[number]}")
        begun = time.monotonic()
        yield
        if number not in self.skipped:
            self.tell(f"Picture: {self.out / PICTURES[number]} ({time.monotonic() - begun:.0f} s)")

    def picture(self, number: int) -> Path:
        return self.out / PICTURES[number]

    def tell(self, line: str) -> None:
        if not self.silent:
            click.echo(line)

    def table(self, title: str, rows: Sequence[dict[str, Any]]) -> None:
        if not self.silent:
            click.echo(title)
            print_table(rows, "none")


def _measured_shots(story: _Story) -> None:
    from ..operations.predict.figures import prediction_figure
    from ..operations.predict.tables import quantity_rows
    from . import demo as job

    for report in job.ingest_examples(story.store):
        note(f"ingested {report.campaign}: {report.total_words}")
    with story.store.reading() as session:
        comparison = job.compare_with_table_5_1(session)
        hit = job.hit_figures(session)
        write_figure(job.examples_figure(session, comparison), story.picture(1))
    prediction, notes = job.predict_a_shot(story.store, story.url)
    write_figure(prediction_figure(prediction), story.out / SHOT)
    predicted = list(quantity_rows(prediction))
    story.data |= {
        "shots": comparison.rows,
        "hit": hit,
        "mean_error_percent": comparison.mean_error_percent,
        "stated_mean_error_percent": comparison.stated_mean_error_percent,
        "prediction": predicted,
    }
    story.table(
        "Five gun shots (Table 3.1), our prediction beside Table 5.1 of the thesis:",
        comparison.rows,
    )
    for line in _error_lines(comparison):
        story.tell(line)
    story.table("\nOne hit of a modal hammer, cut from its LabVIEW record:", [hit])
    story.table(
        "\nA shot that was not fired, the same bullet at 0.5 bar, with its 90 % bands:", predicted
    )
    if not story.silent:
        for line in notes:
            note(line)


def _error_lines(comparison: GunComparison) -> tuple[str, str]:
    from .demo import DRY_FRICTION, STATED_TRAVEL_M

    gun = comparison.gun
    return (
        f"mean absolute error {comparison.mean_error_percent:.2f} % (from the thesis's printed "
        f"column: {comparison.published_mean_error_percent:.2f} %); the travel of "
        f"{gun.travel_m:.2f} m and the friction of {gun.friction_coefficient:g} were identified "
        "from the printed predictions",
        f"with the stated travel of {STATED_TRAVEL_M:g} m and a friction of {DRY_FRICTION:g}: "
        f"{comparison.stated_mean_error_percent:.2f} %",
    )


def _virtual_campaign(story: _Story) -> None:
    from ...doe.plans import read_plan
    from ...doe.sheet import write_sheet
    from .virtual_campaign import REHEARSAL, campaign_figure, fire_campaign

    with progress_bar(f"Preparing {REHEARSAL.name}", "%") as step:
        result = fire_campaign(story.store, REHEARSAL, story.out / REHEARSAL.name, step)
    with story.store.reading() as session:
        write_sheet(read_plan(session, REHEARSAL.name), story.out / SHEET)
    write_figure(campaign_figure(story.store, REHEARSAL.name), story.picture(2))
    story.data["rehearsal"] = result.as_row()
    repeats = (
        f", and {result.repeat} ask for a repeat because a check rejects their recordings"
        if result.repeat
        else ""
    )
    fired_count = REHEARSAL.fired_runs
    story.tell(
        f"The software plans {result.planned} runs for the virtual bench. It ships the recordings "
        f"of {result.planned - fired_count} of them, and fires the other {fired_count} now. It "
        f"ingests all recordings and links them to the plan: {result.done} of {result.planned} "
        f"runs are done{repeats}."
    )
    story.tell(
        f"The shots have {result.median_ratio:.2f} times the velocity of the nominal gun (median): "
        "the virtual bench has losses that the nominal gun does not have."
    )


def _contact_model(story: _Story) -> None:
    from ..common.model_registry import MissingExtraError
    from .chapters import model_figure, train_model

    try:
        with progress_bar("Training a model", "models") as step:
            model = train_model(story.store, story.url, step)
    except MissingExtraError as error:
        story.skipped |= {3, 4}
        story.tell(f"Chapters 3 and 4 are skipped, since they need the extra `models`: {error}.")
        return
    write_figure(model_figure(story.store, story.url, model), story.picture(3))
    story.data["contact_model"] = model.as_json()
    for sentence in _model_sentences(model):
        story.tell(sentence)


def _model_sentences(model: TrainedModel) -> tuple[str, str]:
    from .chapters import METRIC, MODEL

    error = model.version.metrics[METRIC]
    return (
        f"The software trains the model {MODEL} (Gaussian processes) on usable pulses of the "
        f"campaign, {model.pulses} with those that it withholds. {model.version.label} predicts "
        f"the force of configurations that it has not seen with an error of {100 * error.mean:.1f} "
        f"% of the peak (90 % interval {100 * error.low:.1f} to {100 * error.high:.1f} %).",
        f"{model.decision.sentence}.",
    )


def _validation(story: _Story) -> None:
    from .chapters import validate_model, validation_figure, validation_json

    with progress_bar("Validating the predictions", "shots") as step:
        validation = validate_model(story.store, story.url, step)
    write_figure(validation_figure(validation), story.picture(4))
    story.data["validation"] = validation_json(validation)
    story.tell(
        "The twin predicts each shot of the campaign after it has learned from the shots of other "
        "configurations alone, and each prediction has a 90 % band."
    )
    story.tell(validation.sentence)


def _gap(story: _Story) -> None:
    from ..operations.diagnose.wording import effect_subject
    from .chapters import diagnose_gap, diagnosis_figure, diagnosis_json
    from .virtual_campaign import CHANGED, EFFECT, STRENGTH, fire_campaign

    with progress_bar(f"Ingesting {CHANGED.name}", "%") as step:
        result = fire_campaign(story.store, CHANGED, story.out / CHANGED.name, step)
    with progress_bar(f"Diagnosing {CHANGED.name}", "steps") as step:
        diagnosis = diagnose_gap(story.store, story.url, step)
    write_figure(diagnosis_figure(diagnosis), story.picture(5))
    story.data["diagnosis"] = diagnosis_json(diagnosis)
    story.tell(
        f"The software ships {result.shots} more shots of the virtual bench, for which an effect "
        f"was switched on: {effect_subject(EFFECT)} has {STRENGTH:g} times its usual strength. "
        "The diagnosis does not know this."
    )
    story.tell(diagnosis.sentence)


CHAPTERS = {1: _measured_shots, 2: _virtual_campaign, 3: _contact_model, 4: _validation, 5: _gap}


def _tell_addresses(out: Path, url: str, names: Sequence[str]) -> None:
    """Where everything is, and what to do next."""
    address = address_for_display(url)
    files = "\n  ".join(str(path) for name in names if (path := out.resolve() / name).is_file())
    click.echo(f"\nThe results are here:\n  {files}\n  store: {address}")
    command = "pyroshock" if shutil.which("pyroshock") else "python -m pyroshock"
    click.echo(
        f"Look around:\n  {command} impacts --db {address}\n  {command} shots --db {address}"
    )
    click.echo(f"As pages, with pyroshock[web]:\n  {command} serve --db {address} --open")
    click.echo(f"Next, with your own recordings:\n  {command} {NEXT} --db sqlite:///pyroshock.db")
