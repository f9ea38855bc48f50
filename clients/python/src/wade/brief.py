"""Values in few words, for people who print an answer."""

from __future__ import annotations

from typing import Any

import numpy as np


def brief(value: Any) -> str:
    """Up to a matrix's row of numbers with four digits; of more the shape."""
    if value is None or isinstance(value, bool | str):
        return repr(value)
    array = np.asarray(value)
    if array.dtype.kind not in "fiub":
        return repr(value)
    if array.ndim == 0:
        return f"{array[()]:.4g}" if array.dtype.kind == "f" else str(array[()])
    if array.size > 8:
        return f"<{'x'.join(map(str, array.shape))}>"
    return np.array2string(array, precision=4, suppress_small=True, separator=", ").replace("\n", "")
