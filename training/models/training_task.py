"""One model on one split of one dataset: what makes it this training and no other."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Any

import numpy as np

#: Raised by hand when training gives other numbers than before: what was trained earlier is then
#: trained anew.
TRAINING_VERSION = 6


@dataclass(frozen=True)
class TrainingTask:
    """`settings` are those of the unfitted model, as JSON holds them; `split` its text. `package`
    are name and version of the package that adds the model; "" for one that is shipped."""

    model: str
    settings: dict[str, Any]
    dataset_hash: str
    split: str
    seed: int
    package: str = ""

    @property
    def key(self) -> str:
        """The same for the same training, whenever and wherever it is done."""
        parts = [
            TRAINING_VERSION,
            self.model,
            self.settings,
            self.dataset_hash,
            self.split,
            self.seed,
            *self._of_package,
        ]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    @property
    def training_key(self) -> str:
        """The same for every split of one training: they are the figures of one version."""
        parts = [
            TRAINING_VERSION,
            self.model,
            self.settings,
            self.dataset_hash,
            self.seed,
            *self._of_package,
        ]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    @property
    def _of_package(self) -> list[str]:
        return [self.package] if self.package else []

    @property
    def rng(self) -> np.random.Generator:
        """Fresh at each call; independent of the other models, so that each comes out alike alone
        and among all."""
        return rng_of(self.model, self.dataset_hash, self.split, self.seed)


def rng_of(what: str, dataset_hash: str, split: str, seed: int) -> np.random.Generator:
    """Random numbers of their own for everything that draws some."""
    digest = hashlib.sha256(f"{what}\n{dataset_hash}\n{split}".encode()).digest()
    return np.random.default_rng([seed, *np.frombuffer(digest, dtype="<u4").tolist()])
