"""What supports do to a plate whose table does not know where they are."""

from __future__ import annotations

import numpy as np

from ..record import Floats
from .plate_columns import Columns

#: Springs at four places: the share of a mode's motion there has this standard deviation about the mean. A square of a
#: normal number has sqrt(2), its mean over four places half of that.
_UNEVEN = 0.7
#: Half of the springs that couple two modes, by which they turn into each other; a mode cannot turn into more than all.
_COUPLED, _WHOLE = 0.5, 1.5
_DB = 20 / np.log(10)


def frequency_spread(frequency_hz: Floats, support_hz: float) -> Floats:
    """(K,): standard deviations of ln frequency about the law of evenly spread springs."""
    return np.asarray(_UNEVEN * 0.5 * support_hz**2 / (frequency_hz**2 + support_hz**2))


def loose_supports(columns: Columns, support_hz: float) -> Floats:
    """(d,): standard deviations about the law of evenly spread springs, of springs somewhere with the same mean.

    Frequencies: each mode feels them by its own motion there. Amplitudes: modes turn into one another by first-order
    perturbation, (support / (f_k^2 - f_l^2)) for two modes. Lines of a spectrum are as open as the mode next to them.
    """
    f, squared = columns.frequency_hz, support_hz**2
    rises = frequency_spread(f, support_hz)
    apart = np.abs(f[:, None] ** 2 - f[None, :] ** 2)
    np.fill_diagonal(apart, np.inf)
    turned = np.minimum(_COUPLED * np.sqrt((squared**2 / np.maximum(apart, squared) ** 2).sum(axis=1)), _WHOLE)
    nearest = np.abs(np.log(columns.spectra.lines_hz[:, None] / f[None, :])).argmin(axis=1)
    sensors = len(columns.signals.channels)
    laid = columns.laid(
        rises[None],
        np.zeros((1, f.size)),
        np.broadcast_to(turned, (1, sensors, f.size)),
        np.broadcast_to(_DB * turned[nearest], (1, sensors, nearest.size)),
        np.zeros((1, sensors, len(columns.spectra.windows))),
        np.zeros((1, sensors)),
    )
    return np.asarray(laid[0])
