"""What a page offers and its reader's role lacks: the controls of such a form are disabled, with
the sentence that says which role it needs; a button within a line of text and a link to a page that
would be refused are left out.

Each form is held against the route that it is sent to, so that a page need not know who reads it,
and a new form is treated by being there. Routes refuse on their own; this is for people.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape, unescape
from typing import Any
from urllib.parse import urlsplit

from ...schema.person_roles import READER, Person
from .role_needs import need_of

_FORM = re.compile(r"<form (?P<words>[^>]*)>(?P<content>.*?)</form>", re.DOTALL)
_LINK = re.compile(r"<a (?P<words>[^>]*)>(?P<content>.*?)</a>", re.DOTALL)
_WORD = re.compile(r'([a-z-]+)="([^"]*)"')
#: Of what is marked within a page.
LACKING = "lacking-role"
#: The path of a route, and its role.
_Need = tuple[re.Pattern[str], str]


class FormRoles:
    """Which role the form or the page of an address needs, by the routes that take it."""

    def __init__(self, routes: Iterable[Any]) -> None:
        self._forms: list[_Need] = []
        #: By the first part of their paths: a page may have thousands of links.
        self._pages: dict[str, list[_Need]] = {}
        for route in routes:
            methods = getattr(route, "methods", None) or ()
            if "POST" in methods:
                self._forms.append((route.path_regex, need_of(route, "POST").role))
            if "GET" in methods and (role := need_of(route, "GET").role) != READER:
                begin = route.path.split("/")[1]
                self._pages.setdefault(begin, []).append((route.path_regex, role))

    def marked(self, page: str, person: Person, path: str) -> str:
        """The page as a person may use it.

        Parameters:
            page: HTML, whose forms do not lie within each other.
            person: Who reads it.
            path: Its own path, to which a form without an address is sent.
        """

        def form(match: re.Match[str]) -> str:
            words = dict(_WORD.findall(match["words"]))
            if words.get("method", "get").lower() != "post":
                return match[0]
            role = _role_of(self._forms, words.get("action", path))
            if role is None or person.may(role):
                return match[0]
            if "inline" in words.get("class", "").split():
                return ""
            sentence = escape(
                f"This needs the role {role}, and you have the role {person.role}. An "
                "administrator of the laboratory can give it."
            )
            return (
                f'<p class="quiet {LACKING}">{sentence}</p><form {match["words"]}>'
                f'<fieldset disabled class="{LACKING}">{match["content"]}</fieldset></form>'
            )

        def link(match: re.Match[str]) -> str:
            address = dict(_WORD.findall(match["words"])).get("href", "")
            begin = address.split("?")[0].split("/")[1:2]
            role = _role_of(self._pages.get("".join(begin), ()), address)
            if role is None or person.may(role):
                return match[0]
            return "" if "button" in match["words"] else match["content"]

        return _LINK.sub(link, _FORM.sub(form, page))


def _role_of(needs: Iterable[_Need], address: str) -> str | None:
    """The role that an address of HTML needs; None of one that no route takes."""
    path = urlsplit(unescape(address)).path
    return next((role for pattern, role in needs if pattern.match(path)), None)
