"""Freezing the pulses of campaigns for training."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal
from urllib.parse import quote

from pydantic import Field, ValidationInfo, field_validator

from ....schema.person_roles import ENGINEER
from ..faults import about
from ..fields import Names, Presentation, Seed, request_field, source_of
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Progress, Request, Result, ResultTable

if TYPE_CHECKING:
    from ....dataset.snapshot import Built
    from ....dataset.table import Split

#: Sets of predictors that the software brings along.
SHIPPED = ("hammer", "gun")
#: Campaigns that one dataset is made of at most.
_MOST_CAMPAIGNS = 1000


class DatasetBuilding(Request):
    """Which pulses are frozen under which name."""

    name: str = request_field(
        min_length=1,
        max_length=300,
        help="Name the dataset.",
        presentation=Presentation(positional=True, metavar="NAME"),
    )
    campaigns: Annotated[Names, Field(min_length=1, max_length=_MOST_CAMPAIGNS)] = request_field(
        help="Take the pulses of these campaigns. Repeat the option, or give a list: a,b.",
        presentation=Presentation(
            metavar="CAMPAIGN…", option="from", completion="campaign_names", words=True
        ),
    )
    predictors: str | None = request_field(
        None,
        max_length=1000,
        help="Choose the set of predictors: hammer, gun, or a TOML file of your own. [default: the "
        "kind of the campaigns]",
        presentation=Presentation(metavar="SET"),
    )
    quality: Literal["reject", "warning", "none"] = request_field(
        "reject",
        help="Leave out impacts with this verdict; `warning` leaves out rejected ones, too.",
    )
    extraction: str | None = request_field(
        None,
        max_length=200,
        help="Take the pulses of this extraction. [default: those in use]",
        presentation=Presentation(metavar="FINGERPRINT"),
    )
    velocity: Literal["before-contact", "integrated"] | None = request_field(
        None,
        help="Convert impact velocities to this kind. [default: as they are stored, if all are of "
        "one kind]",
    )
    split: str = request_field(
        "repetitions",
        max_length=1000,
        help="Count the pulses on the two sides of this split.",
    )
    seed: Seed = request_field(0, help="Set the seed of the random split.")

    @field_validator("predictors")
    @classmethod
    def _is_no_file_of_the_server(cls, predictors: str | None, info: ValidationInfo) -> str | None:
        if predictors and source_of(info) == "network" and predictors not in SHIPPED:
            raise ValueError(
                f"predictors is {predictors!r}; expected one of {', '.join(SHIPPED)}: a file is "
                "named on the command line"
            )
        return predictors

    @field_validator("split")
    @classmethod
    def _is_known(cls, split: str) -> str:
        from ....dataset.table import check_form

        check_form(split)
        return split


@dataclass(frozen=True, eq=False)
class BuiltDataset(Result):
    """A dataset as it was frozen, or was there already. `split` parts its pulses as asked, or
    `refusal` says why it cannot; `missing` says which facts of the campaigns are missing."""

    built: Built
    name: str
    split: Split | None
    refusal: str
    missing: str

    def notes(self) -> Sequence[str]:
        """Whether it was there already, its size, what was left out, and what was converted."""
        snapshot, counts = self.built.snapshot, self.to_json()
        definition = snapshot.definition
        stated = definition.get("velocity") or {}
        lines = [] if self.built.added else [self._known_already()]
        lines += [self.refusal] if self.refusal else []
        lines += [
            f"dataset {snapshot.name}: {counts['pulses']} pulses, hash {snapshot.hash[:12]}",
            f"  {counts['train']} to learn from, {counts['test']} held out",
            *(f"  left out: {row['impacts']} ({row['reason']})" for row in counts["left_out"]),
        ]
        if len(definition["extractions"]) > 1:
            lines.append(
                "  the pulses are of several extractions; one for all: pyroshock extract CAMPAIGN, "
                "or --extraction"
            )
        if stated.get("converted"):
            lines.append(
                f"  {stated['converted']} impact velocities were converted ({stated['kind']}), "
                f"with a standard uncertainty of {stated['relative_u']:.0%} in the median"
            )
        return [*lines, *([f"  {self.missing}"] if self.missing else [])]

    def _known_already(self) -> str:
        name = self.built.snapshot.name
        other = "" if name == self.name else f" under the name {name}"
        return f"dataset {self.name}: this content is frozen already{other}; nothing was added"

    def tables(self) -> Sequence[ResultTable]:
        """None: the notes say all."""
        return ()

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock dataset build --json` prints it."""
        from .datasets import built_as_json

        return built_as_json(self.built, self.split)

    def address(self) -> str:
        """The page of the dataset."""
        existing = "" if self.built.added else "?existing=true"
        return f"/datasets/{quote(self.built.snapshot.name, safe='')}{existing}"

    def next_command(self) -> Sequence[str]:
        """A training on it."""
        return ("train", self.built.snapshot.name)


def _run(request: DatasetBuilding, laboratory: Laboratory, _: Progress) -> BuiltDataset:
    from ....dataset.predictors import predictors_named
    from ....dataset.selection import missing_in_campaigns, missing_words
    from ....dataset.snapshot import SnapshotError, build_snapshot
    from ....dataset.table import split_of

    store, campaigns = laboratory.store, request.campaigns
    with about("predictors"):
        chosen = predictors_named(request.predictors) if request.predictors else None
    try:
        built = build_snapshot(
            store,
            request.name,
            campaigns,
            chosen,
            request.quality,
            request.extraction,
            request.velocity,
        )
    except (LookupError, ValueError) as error:
        error.__dict__["field"] = "name" if isinstance(error, SnapshotError) else "campaigns"
        raise
    with store.reading() as session:
        missing = missing_words(missing_in_campaigns(session, campaigns, built.snapshot.predictors))
    split, refusal = None, ""
    try:
        split = split_of(built.snapshot.table, request.split, request.seed)
    except (
        ValueError,
        LookupError,
    ) as error:  # it cannot be split so, and is a dataset all the same
        refusal = str(error)
    return BuiltDataset(built, request.name, split, refusal, missing)


DATASET_BUILD = Operation(
    name="dataset-build",
    role=ENGINEER,
    request=DatasetBuilding,
    run=_run,
    help="""Freeze the usable pulses of campaigns under NAME. The same content gives the same
    dataset.

    A velocity that was integrated from the deceleration of the impactor differs from the velocity
    before contact if the plate moves. A dataset has velocities of one kind; --velocity converts the
    others, by each pulse and the plate.""",
    example="""pyroshock dataset build both --from rehearsal,slow-valve --quality warning
pyroshock dataset build before --from rehearsal --velocity before-contact""",
    command=("dataset", "build"),
    route=("POST", "/datasets"),
    form=FormPage("/datasets", "build", "/datasets"),
)
