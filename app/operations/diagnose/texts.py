"""The sentences of a diagnosis as plain text, for documents whose blocks hold texts."""

from __future__ import annotations

from ....diagnosis.verdict import Shrinkage, Verdict, Where
from . import recommendations as advice
from . import statements


def recommendations(verdict: Verdict) -> tuple[str, ...]:
    """What to do next."""
    return tuple(item.text for item in advice.next_steps(verdict))


def next_experiment(verdict: Verdict) -> tuple[str, ...]:
    """What to fire or measure next."""
    return tuple(item.text for item in advice.next_experiment(verdict))


def where_lines(where: Where) -> tuple[str, ...]:
    """Where the error lies."""
    return tuple(item.text for item in statements.where_sentences(where))


def shrinkage_line(entry: Shrinkage, verdict: Verdict) -> str:
    """What one test on configurations that the fit has not seen gave."""
    return statements.held_out_sentence(entry, verdict).text
