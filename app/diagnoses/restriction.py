"""Which effects a diagnosis considers when a user names some: `diagnose --with EFFECT` and `--without EFFECT`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ...twin.effects import catalogue

_ONLY, _WITHOUT = "The diagnosis considers only", "The diagnosis does not consider"


def considered_effects(
    campaign: str, detectable: Sequence[str], only: Sequence[str] = (), without: Sequence[str] = ()
) -> tuple[str, ...]:
    """The effects of `detectable` that are left when a diagnosis is restricted to `only` (empty: to none), less those
    of `without`, in the order of `detectable`: the ids that the campaign's channels can show.

    Raises `LookupError` for an id that is not in the catalogue, `ValueError` for one that the campaign cannot show,
    and where no effect is left; each names what there is.
    """
    check_effects(only, without)
    for option, names in (("--with", only), ("--without", without)):
        if hidden := [name for name in names if name not in detectable]:
            raise ValueError(
                f"{option} {hidden[0]}: the channels of {campaign} cannot show this effect; they can show "
                f"{_list(detectable)}"
            )
    effects = tuple(name for name in detectable if (not only or name in only) and name not in without)
    if not effects:
        raise ValueError(
            f"--with and --without leave no effect to consider for {campaign}; its channels can show "
            f"{_list(detectable)}"
        )
    return effects


def check_effects(only: Sequence[str] = (), without: Sequence[str] = ()) -> None:
    """Raises `LookupError` for an id that is not in the catalogue, with those that are."""
    for option, names in (("--with", only), ("--without", without)):
        if unknown := [name for name in names if name not in catalogue()]:
            raise LookupError(f"{option} {unknown[0]!r}: the catalogue has no such effect; it has {_list(catalogue())}")


def restriction_sentences(only: Sequence[str] = (), without: Sequence[str] = ()) -> tuple[str, ...]:
    """What a report says under its assumptions of a restriction; nothing where there is none."""
    sentences = []
    if only:
        sentences.append(f"{_ONLY} {_list(dict.fromkeys(only))} (--with), and no other effect.")
    if without:
        sentences.append(f"{_WITHOUT} {_list(dict.fromkeys(without))} (--without).")
    return tuple(sentences)


def restrictions_among(assumptions: Sequence[str]) -> tuple[str, ...]:
    """Those sentences of a report's assumptions that say which effects were not considered."""
    return tuple(sentence for sentence in assumptions if sentence.startswith((_ONLY, _WITHOUT)))


def _list(names: Iterable[str]) -> str:
    return ", ".join(names) or "no effect"
