"""A map learned on campaigns of the user's own design: its settings, its repetitions, its noise.

The cause of each is drawn by the priors: nothing, an effect by the library's law with an error of its form, two
effects, or a way to stray that is none of them; all before a background of the bank and the noise of the campaign's
own means. What a campaign shows is drawn from the tables that weigh it, so that a hundred of them cost a minute, not
hours. The map starts from the one that comes with the software, which knows how far a bench's laws are from the
library's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .calibration import CalibrationMap, shipped
from .evidence.astray import AMPLITUDES
from .evidence.form import SHARES, form_modes
from .evidence.scene import SMALLEST, Scene
from .evidence.weighing import weigh
from .verdict import NONE, UNKNOWN

if TYPE_CHECKING:
    from .hypotheses import Priors

Floats = NDArray[np.float64]
#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]

_TRIES = 200


def own_map(
    scene: Scene, priors: Priors, campaigns: int, seed: int, progress: Progress | None = None
) -> CalibrationMap:
    """The map for this design, learned on so many simulated campaigns; the same seed, the same map.

    Raises `ValueError` for fewer than one.
    """
    if campaigns < 1:
        raise ValueError(f"campaigns to calibrate on = {campaigns}: expected at least 1")
    found: list[tuple[dict[str, float], str]] = []
    for z, slope, truth in simulated(scene, priors, campaigns, np.random.default_rng([seed, campaigns])):
        found.append((weigh(with_gap(scene, z, slope), priors).log_joint, truth))
        if progress:
            progress(len(found), campaigns, "campaigns of this design")
    usual = shipped(scene.gap.stages)
    source = f"{campaigns} simulated campaigns of this design, drawn to what was learned on {usual.source}"
    return CalibrationMap.learned(found, source, towards=usual)


def with_gap(scene: Scene, z: Floats, slope: Floats) -> Scene:
    """The same campaign with other means and slopes (`Creep`), in tolerances (N,) and (d,)."""
    return replace(scene, cells=replace(scene.cells, z=z, creep=replace(scene.cells.creep, slope=slope)))


def simulated(
    scene: Scene, priors: Priors, campaigns: int, rng: np.random.Generator
) -> Iterator[tuple[Floats, Floats, str]]:
    """Means less simulated (N,) and slopes (d,) in tolerances, and the hypothesis that is true."""
    slopes = scene.cells.creep.noise
    modes = form_modes(scene)
    shares = np.array([priors.none, priors.singles, priors.pairs, priors.unknown])
    for _ in range(campaigns):
        kind = int(rng.choice(4, p=shares))
        change, truth = _caused(scene, kind, modes, rng)
        under = scene.before[int(rng.integers(len(scene.before)))]
        n = len(scene.cells.z)
        slope = slopes.lower @ rng.standard_normal(len(slopes.lower))
        yield change[:n] + under.lower @ rng.standard_normal(n), change[n:] + slope, truth


def _caused(scene: Scene, kind: int, modes: Floats, rng: np.random.Generator) -> tuple[Floats, str]:
    """(N + d,): what it does to means and slopes."""
    nothing = np.zeros(len(scene.cells.z) + len(scene.cells.creep.slope))
    wanted = {1: 1, 2: 2}.get(kind, 0)
    if kind == 0 or len(scene.ids) < wanted:
        return nothing, NONE
    if kind == 3:
        return _stray(scene, rng), UNKNOWN
    for _ in range(_TRIES):
        names = sorted(rng.choice(len(scene.ids), wanted, replace=False).tolist())
        change = sum((_acting(scene, scene.ids[i], modes, rng) for i in names), np.zeros(len(scene.cells.z)))
        if _largest(scene, change) > SMALLEST:  # two may cancel each other
            return np.append(change, nothing[len(change) :]), "+".join(scene.ids[i] for i in names)
    return nothing, NONE


def _acting(scene: Scene, name: str, modes: Floats, rng: np.random.Generator) -> Floats:
    """(N,): an effect of a likely size, its law a little wrong in half of the cases, as evidence has it."""
    index = int(rng.choice(scene.sheets(name)))
    surface, mass = scene.surfaces[index], np.exp(scene.log_prior[index])
    point = int(rng.choice(len(mass), p=mass / mass.sum()))
    change = scene.cells.take(np.tensordot(surface.basis[point], surface.nodes, axes=1))
    share = float(rng.choice([0.0, *SHARES]))
    return np.asarray(change * (1 + share * modes @ rng.standard_normal(modes.shape[1])))


def _stray(scene: Scene, rng: np.random.Generator) -> Floats:
    """(N + d,): stage, course and manner alike, as evidence weighs them."""
    strays = scene.strays(0)
    ways = list(range(len(strays.names)))
    for part in range(3):
        names = list(dict.fromkeys(strays.names[way][part] for way in ways))
        name = names[int(rng.integers(len(names)))]
        ways = [way for way in ways if strays.names[way][part] == name]
    way, amplitude = ways[int(rng.integers(len(ways)))], float(rng.choice(AMPLITUDES))
    root, least = strays.roots(way), float(strays.least[way])
    alone = root.shape[1] == 1
    size = np.array([_beyond(least, amplitude, rng)]) if alone else amplitude * rng.standard_normal(root.shape[1])
    both, n = root @ size, len(scene.cells.z)
    return np.append(scene.before[0].lower @ both[:n], scene.cells.creep.noise.lower @ both[n:])


def _beyond(least: float, amplitude: float, rng: np.random.Generator) -> float:
    """A normal number that is larger than `least`, of either sign."""
    from scipy.special import ndtr, ndtri

    low = float(ndtr(-least / amplitude))
    size = -amplitude * float(ndtri(low * max(float(rng.random()), 1e-12)))
    return size if rng.random() < 0.5 else -size


def _largest(scene: Scene, change: Floats) -> float:
    sizes = (change[scene.kernels.stage == name] for name in scene.gap.stages)
    return max(float(np.sqrt((size**2).mean())) for size in sizes if size.size)
