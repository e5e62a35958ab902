"""pyroshock: experiment database, models and digital twin for pyroshock testing.

    import pyroshock as ps

    store = ps.open("sqlite:///lab.db")

The names below are the public interface (`__all__`); CONTRIBUTING.md tells how they may change.
Each is imported when it is first used, so that `import pyroshock` costs nothing.
"""

from __future__ import annotations

# Nothing is imported here, so that `python -m pyroshock` closes the working directory before any
# import looks into it.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .app.common.errors import InvalidValueError, NotFoundError, PyroshockError, StorageError
    from .app.library.experiment_store import ExperimentStore
    from .app.library.laboratory_twin import shipped_twin
    from .app.library.opening import open_experiment_store as open
    from .app.operations.impacts.spectra_service import srs
    from .app.operations.plan.service import PlannedDesign

__version__ = "0.1.0"

#: Public name -> (module, name there).
_PUBLIC = {
    "ExperimentStore": (".app.library.experiment_store", "ExperimentStore"),
    "InvalidValueError": (".app.common.errors", "InvalidValueError"),
    "NotFoundError": (".app.common.errors", "NotFoundError"),
    "PlannedDesign": (".app.operations.plan.service", "PlannedDesign"),
    "PyroshockError": (".app.common.errors", "PyroshockError"),
    "StorageError": (".app.common.errors", "StorageError"),
    "open": (".app.library.opening", "open_experiment_store"),
    "shipped_twin": (".app.library.laboratory_twin", "shipped_twin"),
    "srs": (".app.operations.impacts.spectra_service", "srs"),
}

__all__ = [
    "ExperimentStore",
    "InvalidValueError",
    "NotFoundError",
    "PlannedDesign",
    "PyroshockError",
    "StorageError",
    "__version__",
    "open",
    "shipped_twin",
    "srs",
]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    module, attribute = _PUBLIC[name]
    value = getattr(importlib.import_module(module, __name__), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(set(globals()) | set(_PUBLIC))
