"""All checks of a store, one after another: what one cannot read keeps no other from being made."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from sqlalchemy import Connection, func, select
from sqlalchemy.exc import DBAPIError

from ..engine import first_line
from ..recordings import RecordedChannel, Recording
from ..rows import Progress, ProgressBar
from .checks.attachments import check_attached_pieces, check_attachments
from .checks.cross_table_rules import check_belonging
from .checks.engine_rules import (
    check_database,
    check_pages,
    check_references,
    check_sequences,
    check_tables,
    check_values,
)
from .checks.fingerprints import check_fingerprints
from .checks.predictions import check_predictions
from .checks.pulses import check_pulses
from .checks.rows import check_rows, check_rows_without_bytes
from .checks.series import check_chunks, check_series
from .checks.tombstones import check_tombstones
from .findings import RESTORE, IntegrityFinding, Scope

Check = Callable[[Connection, Scope], Iterator[IntegrityFinding]]

#: Of rows that no campaign has alone.
_SHARED: tuple[Check, ...] = (
    check_tables,
    check_values,
    check_references,
    check_fingerprints,
    check_sequences,
    check_tombstones,
    check_predictions,
)
#: With every byte of every series; and without.
_THOROUGH: tuple[Check, ...] = (
    check_database,
    *_SHARED,
    check_rows,
    check_belonging,
    check_pulses,
    check_series,
    check_attachments,
)
_FAST: tuple[Check, ...] = (
    check_pages,
    *_SHARED,
    check_rows_without_bytes,
    check_belonging,
    check_chunks,
    check_attached_pieces,
)
#: Of one campaign's own rows.
_OF_A_CAMPAIGN: tuple[Check, ...] = (
    check_rows,
    check_rows_without_bytes,
    check_belonging,
    check_chunks,
    check_pulses,
    check_series,
    check_attachments,
    check_attached_pieces,
)


def checks(*, fast: bool = False, of_a_campaign: bool = False) -> tuple[Check, ...]:
    """The checks to make.

    Parameters:
        fast: Whether series and pulses are left unread; by default every byte of every series is
            read.
        of_a_campaign: Whether only those of one campaign's own rows are made; by default all are.
    """
    chosen = _FAST if fast else _THOROUGH
    return tuple(check for check in chosen if check in _OF_A_CAMPAIGN) if of_a_campaign else chosen


#: What reading a value raises that is not what its column says: a text that is no JSON, a number
#: that is a text.
_DAMAGED_VALUES = (ArithmeticError, LookupError, RecursionError, TypeError, ValueError)


def iter_findings(
    connection: Connection,
    chosen: tuple[Check, ...],
    campaign: int | None = None,
    progress: Progress | None = None,
) -> Iterator[IntegrityFinding]:
    """What checks find, in the whole store or in one campaign.

    Parameters:
        connection: A connection to the store.
        chosen: The checks, as `checks` gives them.
        campaign: The key of the campaign; by default (None) the whole store is checked.
        progress: Called with (done, total, what) while series are read, in samples; by default
            progress is not reported.
    """
    scope = Scope(campaign)
    if progress is not None and check_series in chosen:
        scope = Scope(campaign, ProgressBar(progress, _samples(connection, scope)))
    for check in chosen:
        savepoint = (
            connection.begin_nested()
        )  # PostgreSQL answers nothing after an error, up to here
        try:
            yield from check(connection, scope)
        except (DBAPIError, *_DAMAGED_VALUES) as error:
            savepoint.rollback()
            name = check.__name__.removeprefix("check_")
            why = (
                first_line(error)
                if isinstance(error, DBAPIError)
                else f"{type(error).__name__}: {error}"
            )
            yield IntegrityFinding(name, f"could not be looked at: {why}", RESTORE)
        else:
            savepoint.commit()


def _samples(connection: Connection, scope: Scope) -> int:
    query = select(func.sum(RecordedChannel.samples)).join(
        Recording, RecordedChannel.recording_id == Recording.id
    )
    return int(connection.scalar(scope.within(query, Recording.campaign_id)) or 0)
