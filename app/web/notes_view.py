"""The notes and tags of one thing, as every page shows them."""

from __future__ import annotations

from jinja2 import Environment, pass_environment
from markupsafe import Markup
from starlette.requests import Request

from ..operations.people.stored_notes import notes_on as stored_notes_on
from ..operations.people.stored_notes import tags_on
from ..operations.people.subjects import find_subject


@pass_environment
def notes_on(environment: Environment, request: Request, kind: str, text: object) -> Markup:
    """The section with notes and tags, and the forms for new ones; empty for what the store does
    not know, such as a model of another registry.

    Parameters:
        environment: The environment of the templates, which Jinja passes.
        request: The request of the page.
        kind: What it is: campaign, run, impact or model.
        text: Its name, as `find_subject` takes it.
    """
    with request.app.state.store.reading() as session:
        try:
            subject = find_subject(session, kind, str(text))
        except LookupError:  # the page tells of something that is not stored: it takes no notes
            return Markup("")
        notes, tags = stored_notes_on(session, subject), tags_on(session, subject)
    section = environment.get_template("notes_on.html").render(
        subject=subject, notes=notes, tags=tags, csrf=request.state.csrf
    )
    return Markup(section)  # noqa: S704  # a template of ours, which escapes
