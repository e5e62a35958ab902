"""What the twin foretells of one shot.

What draws say: a mean, and between what 90 % of them lie.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from ..array_types import Floats
from .contact_interface import Extrapolation, OutOfDomain
from .setting import Setting

#: Ends of a 90 % band.
LOW, HIGH = 0.05, 0.95


@dataclass(frozen=True)
class Quantity:
    """A number with the 5 and the 95 % quantile of its draws, in the unit that its name bears."""

    mean: float
    ci90: tuple[float, float]

    @classmethod
    def of(cls, draws: Floats) -> Self:
        """The mean of draws and the band that 90 % of them lie in.

        Parameters:
            draws: Values (d,) of d random shots, in the unit of the quantity.
        """
        low, high = _ends(draws)
        return cls(float(draws.mean()), (float(low), float(high)))

    def as_json(self) -> dict[str, Any]:
        return {"mean": self.mean, "ci90": list(self.ci90)}


@dataclass(frozen=True, eq=False)
class Band:
    """A series (n,) with the 5 and the 95 % quantile of its draws at each point alone."""

    mean: Floats
    lower: Floats
    upper: Floats

    @classmethod
    def of(cls, draws: Floats) -> Self:
        """The mean of draws at each point and the band that 90 % of them lie in.

        Parameters:
            draws: Series (d, n) of d random shots with n points each, in one unit.
        """
        lower, upper = _ends(draws)
        return cls(draws.mean(axis=0), lower, upper)

    def as_json(self) -> dict[str, Any]:
        return {
            "mean": self.mean.tolist(),
            "lower": self.lower.tolist(),
            "upper": self.upper.tolist(),
        }


def _ends(draws: Floats) -> Floats:
    """Quantiles (2, ...) over the first axis; Hazen's, at which mid-quantiles of strata stand."""
    return np.asarray(np.quantile(draws, (LOW, HIGH), axis=0, method="hazen"))


def stratified_normals(count: int, columns: int, rng: np.random.Generator) -> Floats:
    """Standard normal numbers (count, columns), each column the mid-quantiles of `count` equal
    strata, shuffled.

    Means and quantiles of 64 such draws scatter less than those of 64 independent ones.

    Parameters:
        count: How many draws.
        columns: How many normal numbers a draw has.
        rng: Generator that shuffles each column.

    Source:
        Latin hypercube: McKay, Beckman and Conover, Technometrics 21 (1979) 239.
    """
    from scipy.special import ndtri

    strata = np.tile(ndtri((np.arange(count) + 0.5) / count)[:, None], (1, columns))
    return np.asarray(rng.permuted(strata, axis=0))


@dataclass(frozen=True)
class RestsOn:
    """What stands behind the bands: how many measured shots the contact has learned from, and the
    model or law.

    `sentence` says it in one plain line for a person.
    """

    shots: int
    model: str
    sentence: str


@dataclass(frozen=True, eq=False)
class ShotDraws:
    """The d random shots behind the bands, as the sensors would show them, SI: arrays (d,);
    accelerations are (d, sensors), spectra (d, sensors, lines)."""

    velocity_m_s: Floats
    contact_time_s: Floats
    peak_force_n: Floats
    impulse_n_s: Floats
    peak_acceleration_m_s2: Floats
    spectra_m_s2: Floats


@dataclass(frozen=True, eq=False)
class Prediction:
    """One setting's shot, as the bench's sensors would show it: means and 90 % bands over d draws.

    `force_n` is over equal phases of the contact, `time_s` (p,) those phases of the mean contact.
    `spectra_m_s2` and the rows of `accelerations_m_s2` (d, sensors, n), from the beginning of
    contact on, go with `sensors`: none for a twin without a plate. Accelerations and their peaks
    are of the band up to `acceleration_band_hz`, the highest mode of the plate, whatever lines the
    spectra have. `models` says for each stage what answered, `outside` where it was asked beyond
    its domain, `extrapolation` which quantities lie beyond what was recorded. `draws` are the
    random shots of the bands.
    """

    setting: Setting
    velocity_m_s: Quantity
    contact_time_s: Quantity
    compression_time_s: Quantity
    peak_force_n: Quantity
    impulse_n_s: Quantity
    time_s: Floats
    force_n: Band
    sensors: tuple[str, ...]
    sampling_rate_hz: float
    acceleration_band_hz: float
    accelerations_m_s2: Floats
    frequency_hz: Floats
    q: float
    spectra_m_s2: Mapping[str, Band]
    models: Mapping[str, str]
    outside: tuple[OutOfDomain, ...]
    extrapolation: tuple[Extrapolation, ...]
    rests_on: RestsOn
    draws: ShotDraws

    def acceleration(self, sensor: str, until_s: float = 0.01) -> tuple[Floats, Band]:
        """The acceleration of one sensor over time, made when asked for.

        Parameters:
            sensor: Name of the sensor.
            until_s: End of the series, from the beginning of contact; 0.01 s by default.

        Returns:
            Time (n,) in s and the band of the acceleration in m/s2.

        Raises:
            LookupError: For a sensor there is none of.
        """
        samples = int(until_s * self.sampling_rate_hz) + 1
        draws = self.accelerations_m_s2[:, self.index(sensor), :samples]
        return np.arange(draws.shape[1]) / self.sampling_rate_hz, Band.of(draws)

    def peak_acceleration_m_s2(self, sensor: str) -> Quantity:
        """The largest acceleration of one sensor either way, in the band up to
        `acceleration_band_hz`.

        Parameters:
            sensor: Name of the sensor.

        Raises:
            LookupError: For a sensor there is none of.
        """
        return Quantity.of(np.abs(self.accelerations_m_s2[:, self.index(sensor)]).max(axis=1))

    def index(self, sensor: str) -> int:
        """The place of a sensor among `sensors`, from 0.

        Parameters:
            sensor: Name of the sensor.

        Raises:
            LookupError: For a sensor there is none of; the message names those there are.
        """
        if sensor not in self.sensors:
            raise LookupError(
                f"no sensor {sensor!r}; there are: {', '.join(self.sensors) or 'none'}"
            )
        return self.sensors.index(sensor)

    def as_json(self) -> dict[str, Any]:
        """Plain data with the keys of `predict --json`."""
        numbers = (
            "velocity_m_s",
            "contact_time_s",
            "peak_force_n",
            "impulse_n_s",
            "compression_time_s",
        )
        return {
            **{name: getattr(self, name).as_json() for name in numbers},
            "force": {"time_s": self.time_s.tolist(), **self.force_n.as_json()},
            "acceleration": {name: self._acceleration_json(name) for name in self.sensors} or None,
            "srs": self._srs_json(),
            "models": dict(self.models),
            "outside_domain": [
                {"predictor": o.predictor, "value": o.value, "range": o.range} for o in self.outside
            ],
            "extrapolation": [asdict(extrapolation) for extrapolation in self.extrapolation],
            "rests_on": asdict(self.rests_on),
        }

    def _acceleration_json(self, sensor: str) -> dict[str, Any]:
        time, band = self.acceleration(sensor)
        peak = self.peak_acceleration_m_s2(sensor).as_json()
        return {
            "peak_m_s2": peak,
            "band_hz": [0.0, self.acceleration_band_hz],
            "time_s": time.tolist(),
            **band.as_json(),
        }

    def _srs_json(self) -> dict[str, Any] | None:
        if not self.sensors:
            return None
        spectra = {name: band.as_json() for name, band in self.spectra_m_s2.items()}
        return {"unit": "m/s2", "q": self.q, "frequency_hz": self.frequency_hz.tolist(), **spectra}
