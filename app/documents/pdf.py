"""A report as a PDF for print: the page of `page`, on A4 with fonts of its own in it, and the same
bytes for the same report.

PlutoPrint sets it. It reads no file and no address: the fonts that the style names are handed to
it, and whatever else a page could name does not exist.
"""

from __future__ import annotations

import base64
import datetime as dt
from io import BytesIO
from threading import Lock
from typing import Any

from .document import Document, Table, clean
from .page import render, stylesheet

#: The library shares the fonts' state among threads.
_ONE_AT_A_TIME = Lock()
#: Of a report without a date, which must have the same bytes each time.
_NO_DATE = dt.date(2000, 1, 1)
#: How the address of a picture begins that is its content.
_PICTURE = "data:image/jpeg;base64,"
#: Points of a page on its side that the columns of a table share, and the room between two.
_ACROSS, _BETWEEN = 770.0, 7.0
#: px by which a page may be too narrow for its content, which rounding is.
_ROUNDING = 1.0
#: Letters of a title that the foot of a page has room for.
_MOST_LETTERS = 60


class MissingPdfError(ValueError):
    """The library that writes PDFs is not installed."""


def pdf_of(document: Document) -> bytes:
    """The PDF. Raises `MissingPdfError` where PlutoPrint or the fonts are not installed."""
    try:
        import plutoprint

        from .pdf_fonts import language_of, needs_cjk, printable, remarks_on_letters
    except ModuleNotFoundError as error:
        if error.name not in ("plutoprint", "manimgx_fonts_cjk"):
            raise
        raise MissingPdfError(
            f"{error.name} is not installed; reports as PDF need it: pip install "
            f"'pyroshock[web]' (or --out FILE.html)"
        ) from error
    words = document.words
    language = language_of(words) if needs_cjk(words) else None
    style = stylesheet("page.css", "paper.css") + _fonts_and_foot(
        language, printable(document.name)
    )
    text = printable(render(document, style, remarks_on_letters(words)))
    blocks = [block for section in document.sections for block in section.blocks]
    most_columns = max(
        (len(block.columns) for block in blocks if isinstance(block, Table)), default=1
    )
    date = document.date or _NO_DATE
    with _ONE_AT_A_TIME:
        book = _fitting_book(text, most_columns)
        book.set_metadata(plutoprint.PDF_METADATA_SUBJECT, clean(document.lead))
        book.set_metadata(plutoprint.PDF_METADATA_CREATOR, "pyroshock")
        for key in ("CREATION_DATE", "MODIFICATION_DATE"):
            name = getattr(plutoprint, f"PDF_METADATA_{key}")
            book.set_metadata(name, f"{date.isoformat()}T00:00:00Z")
        into = BytesIO()
        book.write_to_pdf_stream(into)
    return into.getvalue()


def _fonts_and_foot(language: str | None, name: str) -> str:
    """Where the fonts are, CJK letters in the shapes of `language`, and the foot of each page."""
    faces = [("regular", "DejaVu Sans", 400), ("bold", "DejaVu Sans", 700)]
    if language is not None:
        # each weight has a file of its own: in a common one the first weight would hold for all
        faces += [(language, "CJK", 400), (f"{language}-bold", "CJK bold", 700)]
    fonts = "".join(
        f"@font-face {{ font-family: '{family}'; font-weight: {weight}; src: url(font:{file}); }}\n"
        for file, family, weight in faces
    )
    short = name if len(name) <= _MOST_LETTERS else f"{name[: _MOST_LETTERS - 1]}…"
    return f"{fonts}@page {{ @bottom-left {{ content: {_css_text(short)}; }} }}\n"


def _css_text(text: str) -> str:
    """A string of CSS, in which no letter of `text` ends the string or the style."""
    letters = (
        letter if letter.isascii() and letter.isalnum() else f"\\{ord(letter):06x} "
        for letter in text
    )
    return f'"{"".join(letters)}"'


def _fitting_book(text: str, most_columns: int) -> Any:
    """Upright pages if no table is wider, pages on their side else; at last with columns of one
    width, whose words are broken anywhere."""
    for is_turned in (False, True):
        book = lay_out(text, is_turned)
        if book.get_document_width() <= book.get_viewport_width() + _ROUNDING:
            return book
    width = max(_ACROSS / most_columns - _BETWEEN, 1.0)
    style = f"th, td, td.short, td.num {{ max-width: {width:.1f}pt; white-space: normal; }}"
    return lay_out(text.replace("</style>", f"{style}</style>", 1), is_turned=True)


def lay_out(text: str, is_turned: bool = False) -> Any:
    """A page of HTML as a book of PlutoPrint, upright or on its side."""
    import plutoprint

    from .pdf_fonts import font_file

    class Fonts(plutoprint.ResourceFetcher):
        def fetch_url(self, url: str) -> Any:
            scheme, _, name = url.partition(":")
            if url.startswith(_PICTURE):
                return plutoprint.ResourceData(
                    base64.b64decode(url.removeprefix(_PICTURE)), "image/jpeg"
                )
            if scheme != "font":
                raise ValueError(
                    f"a report names {url!r:.80}; it may name its fonts and pictures alone"
                )
            return plutoprint.ResourceData(font_file(name.partition("-")[0]), "font/ttf")

    size = plutoprint.PAGE_SIZE_A4.landscape() if is_turned else plutoprint.PAGE_SIZE_A4
    book = plutoprint.Book(size, plutoprint.PAGE_MARGINS_NONE, plutoprint.MEDIA_TYPE_PRINT)
    book.custom_resource_fetcher = Fonts()
    book.load_html(text)
    return book
