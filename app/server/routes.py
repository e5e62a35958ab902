"""Every router of the web application: a new feature's `api` and `pages` get a word here."""

from __future__ import annotations

from ..diagnose import api as diagnose_api
from ..diagnose import pages as diagnose_pages
from ..impacts import api as impacts_api
from ..impacts import pages as impacts_pages
from ..ingest import api as ingest_api
from ..ingest import pages as ingest_pages
from ..ingest import removal_pages
from ..plan import api as plan_api
from ..plan import pages as plan_pages
from ..predict import api as predict_api
from ..predict import pages as predict_pages
from ..report import pages as report_pages
from ..train import api as train_api
from ..train import pages as train_pages
from ..tune import api as tune_api
from ..tune import pages as tune_pages
from ..validate import api as validate_api
from ..validate import pages as validate_pages
from ..web import csrf, jobs_api, jobs_pages

_API = (
    ingest_api,
    csrf,
    diagnose_api,
    impacts_api,
    jobs_api,
    train_api,
    predict_api,
    tune_api,
    plan_api,
    validate_api,
)
_PAGES = (
    ingest_pages,
    impacts_pages,
    diagnose_pages,
    jobs_pages,
    train_pages,
    predict_pages,
    tune_pages,
    plan_pages,
    removal_pages,
    report_pages,
    validate_pages,
)
API = tuple(module.router for module in _API)
PAGES = tuple(module.router for module in _PAGES)
