"""What a request says of the twin that it works with: the same fields, with the same bounds, in
every operation that builds a twin."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field

from .faults import about_field
from .fields import Points, Presentation, TextFile, request_field, text_file
from .laboratory import Laboratory
from .operation import Request

if TYPE_CHECKING:
    from ..twins.building import TwinRequest

#: A name of the store, or of a law.
Word = Annotated[str, Field(max_length=200)]
#: Q of the oscillators of a spectrum: below 0.5 they do not oscillate.
Q = Annotated[float, Field(gt=0.5, le=1000)]


def _without_other_files(bench: TextFile) -> TextFile:
    """A bench names its modal table by its place beside the file: a text has no such place."""
    if bench.path is None:
        from ...files.toml_text import toml_table

        plate = toml_table(bench.text).get("plate")
        if isinstance(plate, dict) and "modes" in plate:
            raise ValueError(
                "bench names another file in [plate] modes, which a text cannot; give the modal "
                "table in the field modes"
            )
    return bench


class TwinFields(Request):
    """Which bench, which plate, and which contact model."""

    campaign: Word | None = request_field(
        None,
        help="Take the bench of this campaign. [default: the newest gun campaign]",
        presentation=Presentation(completion="campaign_names", label="Bench of"),
    )
    plate: Word | None = request_field(
        None,
        help="Name the material of the mounted plate. [default: that of the bench]",
        presentation=Presentation(metavar="MATERIAL", completion="material_names"),
    )
    bench: Annotated[text_file(200_000), AfterValidator(_without_other_files)] | None = (  # type: ignore[valid-type]
        request_field(
            None,
            help="Describe gun and plate by a TOML file.",
            presentation=Presentation(metavar="FILE.toml"),
        )
    )
    modes: text_file(4_000_000) | None = request_field(  # type: ignore[valid-type]
        None,
        help="Read the measured modes of the plate from a CSV file.",
        presentation=Presentation(metavar="FILE.csv"),
    )
    contact: Word | None = request_field(
        None,
        help="Choose the contact model. [default: the model in use, else prior]",
        presentation=Presentation(
            metavar="LAW|prior|registered|MODEL@VERSION", completion="contact_models"
        ),
    )
    adopted: bool = request_field(
        True,
        help="Use the effects that were adopted for the bench after a diagnosis, or omit them.",
    )
    impact_at: Points = request_field(
        (),
        max_length=50,
        help="Place the impact points #1, #2 and so on upon the outline of the plate, in m. The "
        "option can be repeated.",
        presentation=Presentation(metavar="X,Y", argument="impact_points"),
    )
    sensor_at: Points = request_field(
        (),
        max_length=50,
        help="Place the sensors acceleration_1, acceleration_2 and so on upon the plate, in m. The "
        "option can be repeated.",
        presentation=Presentation(metavar="X,Y", argument="sensors"),
    )
    q: Q = request_field(10.0, help="Set Q of the oscillators of the spectrum.")

    @contextmanager
    def twin_request(self, **further: Any) -> Iterator[TwinRequest]:
        """The twin that is asked for, while its files can be read; `further` are fields of
        `TwinRequest` that only some operations set."""
        from ..twins.building import TwinRequest

        with ExitStack() as stack:
            files: dict[str, Any] = {
                name: None if given is None else stack.enter_context(given.as_path())
                for name, given in (("bench", self.bench), ("modes", self.modes))
            }
            yield TwinRequest(
                campaign=self.campaign,
                plate=self.plate,
                contact=self.contact,
                adopted=self.adopted,
                impact_points=self.impact_at,
                sensors=self.sensor_at,
                q=self.q,
                **files,
                **further,
            )

    def check_names(self, laboratory: Laboratory) -> None:
        """Raises `LookupError` for a campaign, a material or a contact model that there is not."""
        from ...dataset.rows import material_named, stored_materials
        from ...schema.listings import get_campaign_id

        with laboratory.store.reading() as session:
            if self.campaign is not None:
                with about_field("campaign"):
                    get_campaign_id(session, self.campaign)
            if self.plate is not None:
                with about_field("plate"):
                    material_named(stored_materials(session), self.plate)
        check_contact_field(self.contact, laboratory)


def check_contact_field(contact: str | None, laboratory: Laboratory) -> None:
    """Raises `LookupError`, with its field, for a contact model that there is not."""
    if contact is None:
        return
    from ..common.model_registry import models_extra
    from ..twins.building import check_contact

    with about_field("contact"), models_extra():
        check_contact(laboratory.db, contact)
