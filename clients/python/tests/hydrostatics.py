"""What water does at rest to the Warthog's hull, worked out from its mesh: nothing of it is the server's."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from servers import VEHICLES

GRAVITY, DENSITY, MASS = 9.81, 1000.0, 280.0
#: The contact plane, below the body's origin [m].
Z0 = -0.413


def faces() -> NDArray[np.float64]:
    """Corners of the Warthog's faces, `[faces, 3, 3]`."""
    stl = (VEHICLES / "warthog" / "hull.stl").read_bytes()
    face = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    return np.frombuffer(stl, face, offset=84)["corners"].astype(float)


def volume_below(z: float) -> float:
    """Volume of the hull below a level [m3], by the divergence theorem over the clipped faces."""
    corners = faces() - (0.0, 0.0, z)
    heights = corners[:, :, 2]
    below, straddling = (heights <= 0).all(axis=1), (heights > 0).any(axis=1) & (heights < 0).any(axis=1)
    volume = sum(prism(corners[below]))
    for triangle in corners[straddling]:
        polygon = []
        for a, b in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            if a[2] <= 0:
                polygon.append(a)
            if (a[2] < 0) != (b[2] < 0):
                polygon.append(a + (b - a) * a[2] / (a[2] - b[2]))
        volume += sum(prism(np.array([(polygon[0], b, c) for b, c in pairwise(polygon[1:])])))
    return float(volume)


def prism(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed volume between each triangle and the plane z = 0."""
    up = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[:, 2] / 2
    return np.asarray(up * triangles[:, :, 2].mean(axis=1))


@cache
def floating_depth() -> float:
    """Depth at which the hull displaces its mass [m]."""
    low, high = 0.0, 0.826
    while high - low > 1e-4:
        middle = (low + high) / 2
        low, high = (low, middle) if DENSITY * volume_below(Z0 + middle) > MASS else (middle, high)
    return (low + high) / 2


def waterplane_area() -> float:
    """At that depth [m2]."""
    above, below = (volume_below(Z0 + floating_depth() + step) for step in (0.01, -0.01))
    return (above - below) / 0.02
