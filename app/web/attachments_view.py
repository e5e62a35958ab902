"""The photographs and documents of one thing, as every page shows them."""

from __future__ import annotations

from jinja2 import Environment, pass_environment
from markupsafe import Markup
from starlette.requests import Request

from ..operations.people.attachments import MOST_BYTES
from ..operations.people.stored_attachments import attachments_on as stored_attachments_on
from ..operations.people.subjects import find_subject


@pass_environment
def attachments_on(environment: Environment, request: Request, kind: str, text: object) -> Markup:
    """The section with the pictures and the documents, and the form for a new one; empty for what
    the store does not know.

    Parameters:
        environment: The environment of the templates, which Jinja passes.
        request: The request of the page.
        kind: What it is: campaign, run, impact or plan.
        text: Its name, as `find_subject` takes it.
    """
    with request.app.state.store.reading() as session:
        try:
            subject = find_subject(session, kind, str(text))
        except LookupError:  # the page tells of something that is not stored: nothing is attached
            return Markup("")
        attachments = stored_attachments_on(session, subject)
    there = [attachment for attachment in attachments if attachment.removed_at is None]
    section = environment.get_template("attachments_on.html").render(
        subject=subject,
        pictures=[attachment for attachment in there if attachment.is_shown],
        documents=[attachment for attachment in there if not attachment.is_shown],
        removed=[attachment for attachment in attachments if attachment.removed_at is not None],
        most_bytes=MOST_BYTES,
        csrf=request.state.csrf,
    )
    return Markup(section)  # noqa: S704  # a template of ours, which escapes


#: Unit -> its bytes, the largest first.
_UNITS = (("MB", 10**6), ("kB", 10**3))


def size_words(size_bytes: int) -> str:
    """ "4.2 MB", "12 kB", "90 bytes".

    Parameters:
        size_bytes: The size of a file.
    """
    for unit, number in _UNITS:
        if size_bytes >= number:
            share = size_bytes / number
            return f"{share:.1f} {unit}" if share < 10 else f"{share:.0f} {unit}"
    return f"{size_bytes} bytes"
