"""The report on a campaign prints its photographs with caption, name and hash, and lists its
documents; what cannot be drawn is listed with the reason."""

from __future__ import annotations

import base64
import hashlib
from datetime import UTC, datetime
from io import BytesIO

import numpy as np
import pypdfium2
import pytest
from PIL import Image
from pyroshock.app.documents.document import Document, Photographs
from pyroshock.app.documents.page import html_of
from pyroshock.app.documents.pdf import pdf_of
from pyroshock.app.operations.people.stored_attachments import add_attachment, remove_attachment
from pyroshock.app.operations.people.subjects import find_subject
from pyroshock.app.operations.report import attached
from pyroshock.app.operations.report.campaign import campaign_document
from pyroshock.schema.person_roles import Person
from pyroshock.schema.session import Store
from support.checks.pdf_layout import words_of
from support.checks.well_formed import Page
from support.records.attached_files import PDF, picture, png_of_size

#: Of the photograph of the plate: no chart of a report is of this colour.
TEAL = (0, 160, 140)
HOSTILE = "<script>alert('x')</script> & a caption"


def reported(store: Store) -> Document:
    with store.reading() as session:
        return campaign_document(session, "hits")


def attach(store: Store, kind: str, subject: str, name: str, content: bytes, caption: str) -> int:
    return store.write(
        lambda session: add_attachment(
            session, find_subject(session, kind, subject), name, content, caption, Person("olaf")
        )
    )


def photograph(size: tuple[int, int] = (1600, 900)) -> bytes:
    into = BytesIO()
    Image.new("RGB", size, TEAL).save(into, "JPEG", quality=95)
    return into.getvalue()


def test_photographs_are_printed_with_caption_name_and_hash_and_documents_are_listed(
    hits: Store,
) -> None:
    plate = photograph()
    attach(hits, "campaign", "hits", "plate.jpg", plate, HOSTILE)
    attach(hits, "impact", "1", "tip.png", picture("PNG", (80, 60)), "the tip")
    attach(hits, "campaign", "hits", "sensor.pdf", PDF, "certificate")
    gone = attach(hits, "campaign", "hits", "gone.png", picture("PNG", (9, 9)), "another")
    hits.write(lambda session: remove_attachment(session, gone, "wrong", Person("emma")))
    document = reported(hits)
    page = Page(html_of(document))
    assert "Photographs and documents" in page.text and page.of("script") == []
    drawn = [image["src"] or "" for image in page.of("img")]
    assert len(drawn) == 2 and all(src.startswith("data:image/jpeg;base64,") for src in drawn)
    with Image.open(BytesIO(base64.b64decode(drawn[0].partition(",")[2]))) as image:
        assert image.size == (1400, 788)
        assert np.allclose(image.getpixel((700, 400)), TEAL, atol=6)
    today = f"{datetime.now(UTC):%Y-%m-%d}"
    paper = words_of(pdf_of(document))
    for text in (page.text, paper):
        squeezed = "".join(text.split())
        for words in (
            HOSTILE,
            f"plate.jpg, attached to campaign hits by olaf on {today}",
            f"SHA-256{hashlib.sha256(plate).hexdigest()}",
            f"tip.png, attached to impact hits/1/1 by olaf on {today}",
            "sensor.pdf",
            "certificate",
            hashlib.sha256(PDF).hexdigest(),
        ):
            assert "".join(words.split()) in squeezed, words
        assert "gone.png" not in text


def test_the_paper_shows_the_photograph(hits: Store) -> None:
    share_before = teal_share(hits)
    attach(hits, "campaign", "hits", "plate.jpg", photograph(), "the plate")
    # half a page's width by nine sixteenths of that is 7 % of a page, of which there are some
    assert share_before == 0 and teal_share(hits) > 0.01


def teal_share(store: Store) -> float:
    """The share of the pixels of all pages that have the photograph's colour."""
    with pypdfium2.PdfDocument(pdf_of(reported(store))) as document:
        pages = [np.asarray(page.render(scale=1).to_pil().convert("RGB")) for page in document]
    near = [np.abs(page.astype(int) - TEAL).max(axis=2) < 12 for page in pages]
    return sum(page.sum() for page in near) / sum(page.size for page in near)


def test_what_cannot_be_drawn_is_listed_with_the_reason(
    hits: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(attached, "MOST_PHOTOGRAPHS", 1)
    for name, content in (
        ("huge.png", png_of_size(40_000, 30_000)),
        ("damaged.png", png_of_size(600, 400)),
        ("first.png", picture("PNG", (30, 20))),
        ("second.png", picture("PNG", (30, 21))),
    ):
        attach(hits, "campaign", "hits", name, content, "")
    document = reported(hits)
    (section,) = [part for part in document.sections if part.title.startswith("Photographs")]
    (photographs,) = [block for block in section.blocks if isinstance(block, Photographs)]
    assert [photo.facts.partition(",")[0] for photo in photographs.pictures] == ["first.png"]
    text = Page(html_of(document)).text
    assert "huge.png is listed and not printed: a picture of 40000 × 30000 pixels" in text
    assert "damaged.png is listed and not printed: the picture is damaged" in text
    assert "second.png is listed and not printed: a report has at most 1." in text
    assert "huge.png" in words_of(pdf_of(document))


def test_a_campaign_without_attachments_has_no_such_section(hits: Store) -> None:
    assert "Photographs and documents" not in Page(html_of(reported(hits))).text
