"""The documentation's site: `make docs`. Why Sphinx:
docs/decisions/0021-a-site-from-the-same-pages.md."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))  # for `tools`

from pyroshock import __version__

project = "pyroshock"
release = __version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "tools.site",
]
root_doc = "index"
source_suffix = {".md": "markdown"}
exclude_patterns = ["_build", "blind-check", "studies/**", "images"]

# As repository hosts make anchors of headings; four levels are those of the pages.
myst_heading_anchors = 4
smartquotes = False  # signs are shown as they were typed
highlight_language = "text"  # a block that names no language is shown as it stands
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False
napoleon_custom_sections = ["Source"]
default_role = "code"  # docstrings have code between single backticks, as the pages do
add_module_names = False
toc_object_entries = False  # the margin shows headings, not every function
linkcheck_anchors = False  # hosts make theirs by scripts
linkcheck_ignore = [
    r"(?!https?://)",
    r"https?://(127\.0\.0\.1|localhost|server)",
]  # tools/links.py has the rest
linkcheck_timeout = 20

html_theme = "furo"
html_title = f"pyroshock {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_show_copyright = False
html_show_sourcelink = False
html_copy_source = False
