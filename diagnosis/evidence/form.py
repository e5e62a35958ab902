"""An effect whose law is a little wrong: its change may be off by a share that varies smoothly over the factors.

Benches do not obey the library's laws to the last digit. Without this, an effect that is strong enough is refused for
the form of its law, and the gap is called unknown. Marginalised as a linear error in proportion to the fitted change,
by Woodbury's identity.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .background import LENGTH
from .factors import smooth
from .scene import Scene, Seen
from .singles import OnSurface, summed
from .surface import Surface, basis
from .whitening import Whitening

Floats = NDArray[np.float64]

#: Standard deviations of the share, each as likely as none.
SHARES = (0.15,)
#: What a law leaves open is taken from where the effect is likeliest, so often.
_ROUNDS = 3
#: Less of it, in tolerances, is nothing.
_LEAST = 0.05
#: So many directions of the error are kept.
_DIRECTIONS = 24


def with_form_error(scene: Scene, index: int, plain: OnSurface, whitened: list[Floats], modes: Floats) -> OnSurface:
    """The evidence as the mean of that without and those with an error of the law's form. `modes`: `form_modes`.

    What a law leaves open belongs to it: it is in all of them, and looked for again where the effect is likeliest then.
    """
    surface = plain.surface
    if surface.loose is None:
        row = surface.basis[plain.best[0]]
        return _formed(scene, index, plain, whitened, _errors(scene, surface, row, modes), kept=True)
    for _ in range(_ROUNDS):
        row = surface.basis[plain.best[0]]
        own = _open(scene, surface, row)
        both = np.concatenate([own, *_errors(scene, surface, row, modes)], axis=1)
        plain = _formed(scene, index, plain, whitened, [own, both], kept=False)
    return plain


def left_open(scene: Scene, sheets: Sequence[tuple[Surface, Floats]], modes: Floats, *, errors: bool) -> list[Floats]:
    """Of several effects at once, each at its place u (p,): directions (N, q) of what their laws leave open, and with
    `errors` those with errors of their forms too, each as likely as the other."""
    rows = [(surface, basis(u[None], surface.knots)[0]) for surface, u in sheets]
    loose = [_open(scene, surface, row) for surface, row in rows if surface.loose is not None]
    own = np.concatenate(loose, axis=1) if loose else np.zeros((len(scene.cells.z), 0))
    if not errors:
        return [own]
    each = zip(*(_errors(scene, surface, row, modes) for surface, row in rows), strict=True)
    return [own, *(np.concatenate([own, *both], axis=1) for both in each)]


def _errors(scene: Scene, surface: Surface, row: Floats, modes: Floats) -> list[Floats]:
    """`row` (K,) are weights of the surface's nodes."""
    change = scene.cells.take(np.tensordot(row, surface.nodes, axes=1))
    return [share * change[:, None] * modes for share in SHARES]


def _formed(
    scene: Scene, index: int, plain: OnSurface, whitened: list[Floats], errors: list[Floats], *, kept: bool
) -> OnSurface:
    columns = [
        _moved(plain, scene.seen[index][b], white, error, whitened[b])
        for error in errors
        for b, white in enumerate(scene.before)
    ]
    found = [plain.log_likelihood] if kept else []
    return summed(plain.surface, plain.log_prior, np.concatenate([*found, np.stack(columns, 1)], axis=1))


def _open(scene: Scene, surface: Surface, row: Floats) -> Floats:
    """(N, q): a column for each observable that the law leaves open, by one factor for all configurations."""
    assert surface.loose is not None
    cells = scene.cells
    sizes = np.abs(cells.take(np.tensordot(row, surface.loose, axes=1)))
    columns = np.unique(cells.observable[sizes > _LEAST])
    return np.asarray(sizes[:, None] * (cells.observable[:, None] == columns[None, :]))


def _moved(plain: OnSurface, seen: Seen, white: Whitening, directions: Floats, zw: Floats) -> Floats:
    """(M,) log likelihoods with C + U U' for C."""
    from scipy.linalg import cho_factor, cho_solve

    u = white.white(directions)
    factor = cho_factor(np.eye(u.shape[1]) + u.T @ u)
    half_log = float(np.log(np.diag(factor[0])).sum())
    across, along = u.T @ seen.nodes, u.T @ zw
    basis = plain.surface.basis
    linear = basis @ (seen.nodes.T @ zw - across.T @ cho_solve(factor, along))
    lost = cho_solve(factor, across)
    square = seen.square - np.einsum("mk,mk->m", basis @ (across.T @ lost), basis)
    constant = zw @ zw - along @ cho_solve(factor, along)
    return np.asarray(white.log_norm - half_log - 0.5 * (constant - 2 * linear + square))


def form_modes(scene: Scene) -> Floats:
    """(N, q): the largest directions of a kernel that is smooth over factors and partly shared between observables."""
    from scipy.linalg import eigh

    rows = np.unique(scene.cells.configuration)
    over = eigh(smooth(scene.kernels.distance[np.ix_(rows, rows)], LENGTH))
    columns, at = np.unique(scene.cells.observable, return_index=True)
    between = eigh(0.3 + 0.7 * scene.kernels.observables[np.ix_(at, at)])
    values = np.outer(np.maximum(over[0], 0), np.maximum(between[0], 0))
    top = np.argsort(values.ravel())[::-1][:_DIRECTIONS]
    i, j = np.unravel_index(top, values.shape)
    c, o = np.searchsorted(rows, scene.cells.configuration), np.searchsorted(columns, scene.cells.observable)
    return np.asarray(over[1][c][:, i] * between[1][o][:, j] * np.sqrt(values.ravel()[top]))
