"""How a vehicle stands in moving water."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .state import GroundContact

#: Longest wait for an answer unless the caller says otherwise [s]: a map of 100,000 states takes seconds.
DEFAULT_TIMEOUT_S = 60.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Ford:
    """Moving water on a plane bed, for each pair of a depth and a speed: 100,000 pairs at most."""

    #: Water surface above the bed: a number or `[D]`.
    depth_m: ArrayLike
    #: Speed of the vehicle through the water, zero or more: a number or `[S]`.
    speed_mps: ArrayLike
    #: Where the water comes from as seen from the vehicle: 0 ahead, pi/2 from the left, pi from behind.
    heading_rad: float = 0.0
    #: Friction of the wheels on the bed, or two between which each is as likely; None: 0.32 to 0.90, wet roads.
    friction: float | tuple[float, float] | None = None
    density_kgpm3: float = 1000.0
    #: Slope of the bed, and so of the vehicle.
    roll_pitch_rad: tuple[float, float] = (0.0, 0.0)
    ground_contact: GroundContact = GroundContact.WETTED
    #: Share of the motion through the water that is motion over the bed: 0 parked in a current to 1 driving.
    bed: float = 0.0
    #: Whether the normal force on each foot is answered too.
    normal_forces: bool = False

    @property
    def shape(self) -> tuple[int, ...]:
        """That of the depths and then that of the speeds."""
        return np.shape(self.depth_m) + np.shape(self.speed_mps)


@dataclass(frozen=True, slots=True, eq=False)
class StabilityModes:
    """One array a way in which a vehicle loses its hold, of the shape of the depths and then that of the speeds."""

    #: The water bears the whole weight.
    floats: NDArray[np.float32]
    #: The force along the bed is more than friction holds, or it floats.
    slides: NDArray[np.float32]
    #: It tips over an edge of the area between its wheels.
    topples: NDArray[np.float32]
    #: Each axle bears weight and needs no more than its own grip; None of a vehicle without wheels or tracks.
    steers: NDArray[np.float32] | None


@dataclass(frozen=True, slots=True)
class Foot:
    """A place on which a vehicle stands."""

    #: Name of the surface.
    surface: str
    #: Body frame [m].
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Stability:
    """How a vehicle stands for each pair of a depth and a speed.

    Every array has the shape of the depths and then that of the speeds: `()` of two numbers, `[D, S]` of two arrays.
    """

    #: Probabilities, from the stated deviation of the wrench and the spread of friction.
    probability: StabilityModes
    #: 1 dry on level ground, 0 at the limit and negative beyond, with the mean wrench and the least friction.
    margin: StabilityModes
    #: Friction below which it slides; infinite where it floats.
    friction_needed: NDArray[np.float32]
    #: Normal force on each of `feet` [N], with one more axis; None unless asked for.
    normal_force_n: NDArray[np.float32] | None
    #: Wheels, ends of tracks, or corners of a hull without either.
    feet: tuple[Foot, ...]
    #: Whether the state lies inside the training domain.
    in_domain: NDArray[np.bool_]
    #: Least and greatest friction, as used.
    friction: tuple[float, float]
    bundle_version: int
    provenance: str
    compute_ns: int

    def risk(self) -> Any:
        """The greatest of the probabilities to float, to slide, to topple and not to be steered."""
        modes = self.probability
        lost = [modes.floats, modes.slides, modes.topples]
        if modes.steers is not None:
            lost.append(np.subtract(1.0, modes.steers, dtype=np.float32))
        return np.max(lost, axis=0)
