"""One attempt at a job, from its claim to its end, whatever comes in between."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from ...schema.addresses import without_secrets
from ...schema.engine import StoreError
from ...schema.session import Store
from ...schema.transactions import passes
from ..common.model_registry import MissingExtraError
from ..common.user_errors import is_for_the_user
from .claims import Claimed, after
from .heartbeat import Heart, fail, finish, give_back, stopped
from .kind import InterruptedWorkError, NotHereError, RunningJob, StoppedError
from .known_kinds import KINDS
from .lease import FencedStore, LeaseLostError

_log = logging.getLogger("pyroshock.jobs")


@dataclass(frozen=True)
class WorkerContext:
    """Where a worker works: its store with its address, the folders that it may read, and when it is to end."""

    store: Store
    db: str
    lease_s: float
    folders: tuple[Path, ...] = ()
    ending: threading.Event = field(default_factory=threading.Event)


def attempt(bench: WorkerContext, claimed: Claimed) -> bool:
    """Do a job. Whether it is out of this worker's hands for good: False where it must be left to another one.

    Raises nothing but what ends the process (the job goes back first) and `StoreError` where the store is away.
    """
    lease = claimed.lease
    try:
        _do(bench, claimed)
    except LeaseLostError as error:
        _log.warning("%s; nothing more of it is stored", error)
        return True
    except StoppedError:
        _ended(claimed, lambda: stopped(bench.store, lease))
    except (NotHereError, MissingExtraError) as error:
        _handed_back(bench, claimed, f"waits for another worker: {error}")
        return False
    except InterruptedWorkError:
        _handed_back(bench, claimed)
    except Exception as error:
        if isinstance(error, StoreError) and passes(error):  # the store's trouble, not the job's
            _handed_back(bench, claimed)
            raise
        words = _words(error)
        _ended(claimed, lambda: fail(bench.store, lease, words))
    except BaseException:
        _handed_back(bench, claimed)
        raise
    else:
        after(claimed.kind, claimed.arguments, claimed.host)
    return True


def _do(bench: WorkerContext, claimed: Claimed) -> None:
    lease = claimed.lease
    store = FencedStore(bench.store, lease, f"job {lease.job}: {claimed.label}")
    with Heart(bench.store, lease, bench.lease_s, bench.ending, claimed.stop_requested) as heart:
        heart.check()
        kind = KINDS[claimed.kind]
        arguments = kind.read(claimed.arguments)
        ending = kind.do(RunningJob(lease.job, store, bench.db, heart.step, bench.folders), arguments)
        heart.check()
        store.end(lambda session: finish(session, lease, ending(), heart.progress))


def _ended(claimed: Claimed, end: Callable[[], None]) -> None:
    with suppress(LeaseLostError):
        end()
        after(claimed.kind, claimed.arguments, claimed.host)


def _handed_back(bench: WorkerContext, claimed: Claimed, why: str = "") -> None:
    """Where even that fails, the lease passes and another worker sees it."""
    with suppress(LeaseLostError, StoreError):
        give_back(bench.store, claimed.lease, why)


def _words(error: Exception) -> str:
    if is_for_the_user(error):
        return without_secrets(str(error))
    _log.error("a job failed", exc_info=error)
    words = without_secrets(f"{type(error).__name__}: {error}")
    return f"an error of pyroshock itself, {words}; the worker's log has its trace"
