"""A document as a file: the ending of its name says which form."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...files.atomic_write import write_bytes
from .document import Document


def write_report(document: Document, out: Path) -> None:
    """Write it as its ending says, in the place of what was there; whole or not at all.

    Raises `ValueError` for another ending and where PDFs cannot be written, `OSError`.
    """
    check_ending(out)
    content = report_content(document, out.suffix.lower())
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(out, content)


def report_content(document: Document, ending: str) -> bytes:
    """It as ".html" or ".pdf". Raises `ValueError` where PDFs cannot be written."""
    return _WRITERS[ending](document)


def check_ending(out: Path) -> None:
    """Raises `ValueError` for a file that no report can be written to."""
    if out.suffix.lower() not in _WRITERS:
        raise ValueError(
            f"cannot write {out.name!r}; expected a name that ends in {' or '.join(_WRITERS)}"
        )


def _html(document: Document) -> bytes:
    from .page import html_of

    return html_of(document).encode()


def _pdf(document: Document) -> bytes:
    from .pdf import pdf_of

    return pdf_of(document)


_WRITERS: dict[str, Callable[[Document], bytes]] = {".html": _html, ".pdf": _pdf}
