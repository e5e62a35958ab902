"""Sphinx extension of the documentation's site: pages filled from the code, links to the
repository's files."""

from __future__ import annotations

from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

from . import docstrings, files, pages


def setup(app: Sphinx) -> ExtensionMetadata:
    """What Sphinx calls."""
    for part in (pages, files, docstrings):
        part.setup(app)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
