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
    """Moving water on a plane bed, for each pair of a depth and a speed: 100,000 pairs at most.

    Attributes:
        depth_m: Water surface above the bed: a number or `[D]`.
        speed_mps: Speed of the vehicle through the water, zero or more: a number or `[S]`.
        heading_rad: Where the water comes from as seen from the vehicle: 0 ahead, pi/2 from the left, pi from
            behind.
        friction: Friction of the wheels on the bed, or two between which each is as likely; None: 0.32 to 0.90,
            wet roads.
        density_kgpm3: Density of the water [kg/m3].
        roll_pitch_rad: Slope of the bed, and so of the vehicle.
        ground_contact: Whether water reaches under the tires.
        bed: Share of the motion through the water that is motion over the bed: 0 parked in a current to 1
            driving.
        normal_forces: Whether the normal force on each foot is answered too.
    """

    depth_m: ArrayLike
    speed_mps: ArrayLike
    heading_rad: float = 0.0
    friction: float | tuple[float, float] | None = None
    density_kgpm3: float = 1000.0
    roll_pitch_rad: tuple[float, float] = (0.0, 0.0)
    ground_contact: GroundContact = GroundContact.WETTED
    bed: float = 0.0
    normal_forces: bool = False

    @property
    def shape(self) -> tuple[int, ...]:
        """That of the depths and then that of the speeds."""
        return np.shape(self.depth_m) + np.shape(self.speed_mps)


@dataclass(frozen=True, slots=True, eq=False)
class StabilityModes:
    """One array a way in which a vehicle loses its hold, of the shape of the depths and then that of the speeds.

    Attributes:
        floats: The water bears the whole weight.
        slides: The force along the bed is more than friction holds, or it floats.
        topples: It tips over an edge of the area between its wheels.
        steers: Each axle bears weight and needs no more than its own grip; None of a vehicle without wheels or
            tracks.
    """

    floats: NDArray[np.float32]
    slides: NDArray[np.float32]
    topples: NDArray[np.float32]
    steers: NDArray[np.float32] | None


@dataclass(frozen=True, slots=True)
class Foot:
    """A place on which a vehicle stands.

    Attributes:
        surface: Name of the surface.
        x_m: Body frame [m].
    """

    surface: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Stability:
    """How a vehicle stands for each pair of a depth and a speed.

    Every array has the shape of the depths and then that of the speeds: `()` of two numbers, `[D, S]` of two arrays.

    Attributes:
        probability: Probabilities, from the stated deviation of the wrench and the spread of friction.
        margin: 1 dry on level ground, 0 at the limit and negative beyond, with the mean wrench and the least
            friction.
        friction_needed: Friction below which it slides; infinite where it floats.
        normal_force_n: Normal force on each of `feet` [N], with one more axis; None unless asked for.
        feet: Wheels, ends of tracks, or corners of a hull without either.
        in_domain: Whether the state lies inside the training domain.
        friction: Least and greatest friction, as used.
        bundle_version: Version of the bundle that answered.
        provenance: Where the weights come from.
        compute_ns: The server's own time [ns].
    """

    probability: StabilityModes
    margin: StabilityModes
    friction_needed: NDArray[np.float32]
    normal_force_n: NDArray[np.float32] | None
    feet: tuple[Foot, ...]
    in_domain: NDArray[np.bool_]
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
