"""Types of NumPy arrays, defined once for every room: what an annotation says of the elements of an
array."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
#: One truth value for each element of something else.
Flags = NDArray[np.bool_]
#: The elements that are selected.
Mask = NDArray[np.bool_]
#: Positions of elements along an axis.
Index = NDArray[np.intp]
#: Positions of rows in a table.
Rows = NDArray[np.intp]
#: Keys of rows in the store.
Ids = NDArray[np.int64]
#: Levels of factors as whole numbers, from 0.
Levels = NDArray[np.int64]
