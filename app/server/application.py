"""The application: routes behind the guard, what they share, and what HTTP calls the errors that a
person can mend."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit, urlunsplit

from anyio import to_thread
from fastapi import Depends, FastAPI
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ValidationError
from sqlalchemy.exc import DataError
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.types import ASGIApp

from ... import __version__
from ...schema.addresses import without_secrets
from ...schema.conditions import ConditionError
from ...schema.engine import StoreRoleError
from ...schema.person_roles import RoleNeededError
from ...schema.session import Store
from ..common.errors import is_for_the_user
from ..documents.page import section_style
from ..doors.api import ingest as ingest_api
from ..doors.api import library as library_api
from ..doors.routes import form_router, json_router
from ..jobs.worker import Worker
from ..operations.faults import Fault, RequestError
from ..pages import account as account_pages
from ..pages import api as api_pages
from ..pages import archive as archive_pages
from ..pages import attachments as attachment_pages
from ..pages import campaign_form as campaign_form_pages
from ..pages import campaigns as campaign_pages
from ..pages import compare as compare_pages
from ..pages import compare_models as compare_models_pages
from ..pages import datasets as dataset_pages
from ..pages import diagnose as diagnose_pages
from ..pages import explore as explore_pages
from ..pages import export as export_pages
from ..pages import extract as extract_pages
from ..pages import facts as facts_pages
from ..pages import home as home_pages
from ..pages import impact_lists as impact_list_pages
from ..pages import impacts as impacts_pages
from ..pages import ingest as ingest_pages
from ..pages import jobs as jobs_pages
from ..pages import model_deletion as train_deletion_pages
from ..pages import notes as notes_pages
from ..pages import people as people_pages
from ..pages import plan as plan_pages
from ..pages import predict as predict_pages
from ..pages import removal as removal_pages
from ..pages import report as report_pages
from ..pages import search as search_pages
from ..pages import sign_in as sign_in_pages
from ..pages import train as train_pages
from ..pages import tune as tune_pages
from ..pages import validate as validate_pages
from ..twins.twin_cache import TwinCache
from ..web import csrf
from ..web.accounts import Accounts
from ..web.csrf import require_csrf
from ..web.forms import faults_of, field_of, is_form, where_next
from ..web.guard import Guard
from ..web.jobs import Jobs
from ..web.lacking_roles import FormRoles
from ..web.page_sources import SourceStamps
from ..web.page_words import in_page_words
from ..web.rendering import page
from ..web.role_needs import require_role
from ..web.settings import Settings
from ..web.sign_in import SignIn
from ..web.sign_in_record import SignInRecord
from ..web.sign_on.sign_on import SignOn
from ..web.static_files import send_static, static_files
from ..web.warm_up import warm_up_in_thread
from .compression import Compression
from .page_cache import PageCache

#: A new feature's `api` and `pages` get a word here.
_API = (
    ingest_api,
    library_api,
    csrf,
)
PAGES = (
    home_pages,
    campaign_pages,
    ingest_pages,
    campaign_form_pages,
    facts_pages,
    impact_list_pages,
    impacts_pages,
    compare_pages,
    diagnose_pages,
    jobs_pages,
    api_pages,
    train_pages,
    compare_models_pages,
    dataset_pages,
    train_deletion_pages,
    predict_pages,
    tune_pages,
    plan_pages,
    removal_pages,
    archive_pages,
    explore_pages,
    export_pages,
    extract_pages,
    report_pages,
    validate_pages,
    sign_in_pages,
    account_pages,
    people_pages,
    notes_pages,
    attachment_pages,
    search_pages,
)


def status_of(error: Exception) -> int:
    """400 a filter that cannot be read, 403 what the role of the person or the login may not, 404
    what is not there, 422 what cannot be used, 503 a store or a disk that fails."""
    if isinstance(error, StoreRoleError | RoleNeededError):
        return 403
    if isinstance(error, ConditionError):
        return 400
    if isinstance(error, LookupError):
        return 404
    return 422 if isinstance(error, ValueError | DataError) else 503


class Problem(BaseModel):
    """What is wrong, the value that it is about, and what to do next."""

    detail: str


_WORDS = {
    400: "The body, or a filter, cannot be read",
    401: "A sign-in or a token is needed",
    403: "A write without the token of /api/csrf, or one that the role of the person or of the "
    "server's login forbids",
    404: "There is no such thing in the store",
    413: "The body is too large",
    422: "A value cannot be used",
    503: "The store or the disk fails",
}
#: For `include_router`: every route of the API tells what is wrong in one form.
PROBLEMS: dict[int | str, dict[str, Any]] = {
    status: {"model": Problem, "description": words} for status, words in _WORDS.items()
}
#: Pages that are made at once. More threads than that take turns on the interpreter: each waits
#: longer, and each holds memory.
_THREADS = 4
_ABOUT = """\
The actions of pyroshock for scripts: what the pages show and do. Numbers are SI, units stand in \
the keys.

A write needs the header `X-CSRF-Token`: GET `/api/csrf` tells it, and sets the cookie that it \
belongs to."""


def application(settings: Settings, store: Store, *, warm: bool = False) -> ASGIApp:
    """The whole window over an open store, behind its guard; closing the store is the caller's.

    `warm`: the newest gun's twin is built before anybody asks.
    """
    worker = Worker(store, settings.db, folders=settings.folders) if settings.works else None
    jobs, twins = Jobs(store, worker), TwinCache(store, settings.db)
    sources = SourceStamps(store.engine, settings.db)

    @asynccontextmanager
    async def alive(_: FastAPI) -> AsyncIterator[None]:
        if warm:
            warm_up_in_thread(twins)
        jobs.begin()
        to_thread.current_default_thread_limiter().total_tokens = _THREADS
        yield
        jobs.close()
        sources.close()

    app = FastAPI(
        title="pyroshock",
        version=__version__,
        description=_ABOUT,
        lifespan=alive,
        docs_url=None,  # their pages are fetched from elsewhere
        redoc_url=None,
        openapi_url="/api/openapi.json",
        dependencies=[Depends(require_role), Depends(require_csrf)],
    )
    app.state.settings, app.state.store, app.state.jobs, app.state.twins = (
        settings,
        store,
        jobs,
        twins,
    )
    app.state.sign_in = SignIn(
        settings.token,
        Accounts(store),
        asks_people=settings.lets_in_users,
        takes_passwords=settings.takes_passwords,
        sign_on=None if settings.sign_on is None else SignOn(settings.sign_on),
        record=SignInRecord(store),
    )
    for module in _API:
        app.include_router(module.router, prefix="/api", responses=PROBLEMS)
    app.include_router(json_router(), prefix="/api", responses=PROBLEMS)
    app.include_router(form_router(), include_in_schema=False)
    for module in PAGES:
        app.include_router(module.router, include_in_schema=False)
    app.get("/static/report.css", include_in_schema=False)(_report_style)
    app.get("/static/{name}", include_in_schema=False)(_static)
    _tell_errors(app)
    routes = [*form_router().routes, *(route for module in PAGES for route in module.router.routes)]
    app.state.form_roles = FormRoles(routes)
    pages = PageCache(app, routes, sources)
    return Guard(Compression(pages), settings, app.state.sign_in)


def _static(request: Request, name: str) -> Response:
    """A script, a style or a picture of pages."""
    file = static_files().get(name)
    if file is None:
        raise HTTPException(404, f"no file {name!r} belongs to the pages")
    return send_static(request, file)


def _report_style() -> Response:
    """Of the sections of a report, within a page of ours."""
    return Response(
        section_style(),
        media_type="text/css",
        headers={"cache-control": "max-age=3600"},
    )


def _tell_errors(app: FastAPI) -> None:
    """Errors in words: JSON below /api, a page elsewhere."""

    async def refused(request: Request, error: Exception) -> Response:
        assert isinstance(error, HTTPException)
        return error_response(
            request, error.status_code, str(error.detail), dict(error.headers or {})
        )

    async def unreadable(request: Request, error: Exception) -> Response:
        assert isinstance(error, RequestValidationError)
        return _invalid(request, error.errors())

    async def failed(request: Request, error: Exception) -> Response:
        return error_response(
            request, 500, f"The software has a fault: {type(error).__name__}: {error}"
        )

    app.add_exception_handler(Exception, failed)
    app.add_exception_handler(HTTPException, refused)
    app.add_exception_handler(RequestValidationError, unreadable)

    @app.middleware("http")
    async def mended(request: Request, go_on: Callable[[Request], Awaitable[Response]]) -> Response:
        try:
            answer = await go_on(request)
            return where_next(answer) if is_form(request) and answer.status_code == 303 else answer
        except ValidationError as error:  # of a record that a page makes of its form
            return _invalid(request, error.errors())
        except Exception as error:
            if not is_for_the_user(error):
                raise
            faults = error.faults if isinstance(error, RequestError) else ()
            return error_response(
                request, status_of(error), str(error), field=field_of(error), faults=faults
            )


def _invalid(request: Request, errors: Sequence[Any]) -> Response:
    if is_form(request):
        return JSONResponse({"faults": faults_of(errors)}, 422)
    return error_response(request, 422, "; ".join(map(_complaint, errors)))


def error_response(
    request: Request,
    status: int,
    why: str,
    headers: dict[str, str] | None = None,
    *,
    field: str = "",
    faults: Sequence[Fault] = (),
) -> Response:
    """An error as who asked can read it: a page, JSON for the API, and for a form with the field
    that it is about."""
    why = without_secrets(why)
    listed = [{"field": fault.field, "message": without_secrets(fault.message)} for fault in faults]
    folders = request.app.state.settings.folders
    if is_form(request):
        messages = [
            {**entry, "message": in_page_words(entry["message"], folders)}
            for entry in listed or [{"field": field, "message": why}]
        ]
        return JSONResponse({"faults": messages}, status, headers)
    if request.url.path.startswith("/api"):
        by_field = {"faults": listed} if listed else {}
        return JSONResponse({"detail": why, **by_field}, status, headers)
    answer = page(
        request,
        "error.html",
        status,
        why=in_page_words(why, folders),
        name=HTTPStatus(status).phrase,
        status_code=status,
        back=_page_before(request),
    )
    answer.headers.update(headers or {})
    return answer


def _page_before(request: Request) -> str:
    """The page of ours that led here, empty where there is none."""
    before = urlsplit(request.headers.get("referer", ""))
    ours = (
        before.netloc == request.headers.get("host")
        and before.path
        and before.path != request.url.path
    )
    return urlunsplit(("", "", before.path, before.query, "")) if ours else ""


def _complaint(error: Any) -> str:
    """What pydantic says of one value: where it is, what it was, what was expected."""
    kind, *names = map(str, error["loc"]) if error["loc"] else ("",)
    where = ".".join(names if kind in ("body", "query", "path") else (kind, *names)) or kind
    return f"{where}: {error['msg']}" + (
        f" (was {error['input']!r:.80})" if "input" in error else ""
    )
