"""numpy: an ``.npz`` of arrays by name, or an ``.npy`` of a structured array."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import TrialsError
from ..source import NO_CLOCK, Channel, Clock, Conventions, Progress, Series, check_count
from .table import time_column, without_origin

Array = NDArray[np.float64]


class ArraySource:
    """Arrays of equal length; the columns of an array ``p`` of two dimensions are ``p.0``, ``p.1`` and so on."""

    format = "numpy"

    def __init__(self, path: Path, clock: Clock = NO_CLOCK) -> None:
        self.path, self.conventions = path, Conventions()
        try:
            loaded = np.load(path, mmap_mode="r" if path.suffix == ".npy" else None, allow_pickle=False)
        except (ValueError, OSError) as error:
            raise TrialsError(path, "", f"numpy cannot read it: {error}") from None
        if path.suffix == ".npy":
            if loaded.dtype.names is None:
                raise TrialsError(path, "", "the array has no field names: save a structured array, or an .npz")
            pairs = [(name, loaded[name]) for name in loaded.dtype.names]
        else:
            pairs = [(name, loaded[name]) for name in loaded.files]
        self.arrays: dict[str, Array] = {}
        for name, array in pairs:
            if array.dtype.kind in "fiu" and array.ndim == 1:
                self.arrays[name] = array
            elif array.dtype.kind in "fiu" and array.ndim == 2:
                self.arrays.update({f"{name}.{at}": array[:, at] for at in range(array.shape[1])})
        names = list(self.arrays)
        self.time, self.factor = time_column(path, names, [""] * len(names), clock)

    def channels(self) -> list[Channel]:
        return [Channel(name, "", len(array)) for name, array in self.arrays.items() if name != self.time]

    def read(self, names: Sequence[str], progress: Progress) -> dict[str, Series]:
        stamps = self.arrays[self.time]
        check_count(self.path, len(stamps))
        for name in names:
            if len(self.arrays[name]) != len(stamps):
                raise TrialsError(
                    self.path, name, f"it has {len(self.arrays[name])} samples, {self.time} has {len(stamps)}"
                )
        # nanoseconds since 1970 lose their digits as a float: take the origin off first
        t = without_origin(self.path, self.time, np.asarray(stamps - stamps[0], dtype=np.float64), self.factor)
        progress(1.0)
        return {name: Series(t, np.asarray(self.arrays[name], dtype=np.float64)) for name in names}
