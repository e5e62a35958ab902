"""pyroshock: experiment database, models and digital twin for pyroshock testing.

    import pyroshock as ps

    store = ps.open("sqlite:///lab.db")

The names below are the public interface (`__all__`); CONTRIBUTING.md tells how they may change. Each is imported when
it is first used, so that `import pyroshock` costs nothing.
"""

from __future__ import annotations

# Nothing is imported here, so that `python -m pyroshock` closes the working directory before any import looks into it.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .app.library.errors import InvalidValueError, NotFoundError, PyroshockError, StorageError
    from .app.library.plans import PlannedDesign
    from .app.library.spectra import srs
    from .app.library.store import ExperimentStore
    from .app.library.store import open_experiment_store as open
    from .app.library.twin import shipped_twin

__version__ = "0.1.0"

#: Public name -> (module, name there).
_PUBLIC = {
    "ExperimentStore": (".app.library.store", "ExperimentStore"),
    "InvalidValueError": (".app.library.errors", "InvalidValueError"),
    "NotFoundError": (".app.library.errors", "NotFoundError"),
    "PlannedDesign": (".app.library.plans", "PlannedDesign"),
    "PyroshockError": (".app.library.errors", "PyroshockError"),
    "StorageError": (".app.library.errors", "StorageError"),
    "open": (".app.library.store", "open_experiment_store"),
    "shipped_twin": (".app.library.twin", "shipped_twin"),
    "srs": (".app.library.spectra", "srs"),
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
