"""Every router of the window; a new theme is a file in `pages` or `api` and a word here."""

from __future__ import annotations

from .api import campaigns as campaigns_api
from .api import csrf as csrf_api
from .api import diagnoses as diagnoses_api
from .api import impacts as impacts_api
from .api import ingest as ingest_api
from .api import jobs as jobs_api
from .api import models as models_api
from .api import plans as plans_api
from .api import predict as predict_api
from .api import removal as removal_api
from .api import spectra as spectra_api
from .api import training as training_api
from .api import validate as validate_api
from .pages import campaigns as campaigns_pages
from .pages import compare as compare_pages
from .pages import diagnoses as diagnoses_pages
from .pages import impacts as impacts_pages
from .pages import ingest as ingest_pages
from .pages import jobs as jobs_pages
from .pages import models as models_pages
from .pages import plans as plans_pages
from .pages import removal as removal_pages
from .pages import reports as reports_pages
from .pages import twin as twin_pages
from .pages import validations as validations_pages

_API = (
    campaigns_api,
    csrf_api,
    diagnoses_api,
    impacts_api,
    ingest_api,
    jobs_api,
    models_api,
    predict_api,
    plans_api,
    removal_api,
    spectra_api,
    training_api,
    validate_api,
)
_PAGES = (
    campaigns_pages,
    compare_pages,
    diagnoses_pages,
    impacts_pages,
    ingest_pages,
    jobs_pages,
    models_pages,
    twin_pages,
    plans_pages,
    removal_pages,
    reports_pages,
    validations_pages,
)
API = tuple(module.router for module in _API)
PAGES = tuple(module.router for module in _PAGES)
