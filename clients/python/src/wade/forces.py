"""What the server answers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]


class Quantity(IntEnum):
    """A quantity of which the training domain states a range; the columns of `Forces.outside`."""

    #: Horizontal speed through the water [m/s].
    SPEED = 0
    #: Flow angle [rad]: pi/2 head-on or from behind, 0 from the side.
    ANGLE = 1
    #: [kg/m3]
    DENSITY = 2
    #: [m]
    DEPTH = 3
    #: Angle between body z and up [rad].
    TILT = 4
    #: Speed along body z [m/s].
    VERTICAL_SPEED = 5
    #: [rad/s]
    ANGULAR_SPEED = 6
    #: Distance to the nearest state that was learnt from, over what is usual among these [-].
    DISTANCE = 7


@dataclass(slots=True, eq=False)
class Forces:
    """What the water does to the vehicle, body frame, in single precision; arrays may be read-only.

    Shapes are those of a single state with K surfaces, in the order of `Vehicle.surfaces`; in the answer to a batch
    each array has N rows of them. The bits are the same whatever the transport, alone or in a batch.
    """

    #: Net force [N], `[3]`.
    force_n: Array
    #: Net moment about `about_m` [N m], `[3]`.
    moment_nm: Array
    #: Reference point of the moment, the center of mass [m]: `[3]`, for a batch too.
    about_m: Array
    #: One standard deviation of the net force [N], `[3]`.
    uncertainty_n: Array
    #: Force on each surface [N], `[K, 3]`; K is 0 where the surfaces were left out.
    surface_force_n: Array
    #: Point at which it acts [m], `[K, 3]`.
    surface_point_m: Array
    #: Share of each surface under water, `[K]`.
    wetted_fraction: Array
    #: How far each `Quantity` lies outside the training domain, in its unit: negative below, positive above, 0 within.
    outside: Array
    #: Version of the bundle that answered.
    bundle_version: int
    #: Where the weights come from, such as "analytic".
    provenance: str
    #: The server's own time [ns], for the whole batch.
    compute_ns: int

    @property
    def in_domain(self) -> NDArray[np.bool_] | np.bool_:
        """True where no quantity lies outside the training domain: one value, or `[N]` for a batch."""
        inside: NDArray[np.bool_] | np.bool_ = np.logical_not(np.any(self.outside, axis=-1))
        return inside
