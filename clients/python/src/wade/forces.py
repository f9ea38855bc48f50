"""What the server answers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from .brief import brief

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
    #: Distance to the nearest state that was learnt from, over what is usual among these [-]. Beyond 1 the learnt part
    #: of the answer fades, beyond 3 the known physics alone is left.
    DISTANCE = 7


class Effect(IntEnum):
    """A physical effect that can be added to a model; the values are those of the wire."""

    ADDED_MASS = 1
    LINEAR_DAMPING = 2
    DRAG_COEFFICIENT_ERROR = 3
    ROTATION = 4
    CURRENT = 5
    WATER_LEVEL_OFFSET = 6
    DENSITY_ERROR = 7
    HULL_FLOODING = 8
    WATER_ENTRY_SLAMMING = 9
    WAVE_MEMORY = 10
    CHANNEL_BLOCKAGE = 11
    SQUAT = 12
    WHEEL_PADDLE_THRUST = 13
    BED_MOTION = 14
    HULL_LIFT = 27


class LeftOut(IntEnum):
    """Why an effect has no load in an answer; the values are those of the wire, and 0 is that it has one."""

    #: It remembers, and the state belongs to no run: as at rest and dry.
    NO_SESSION = 1
    NO_HEADING = 2
    NO_WHEEL_SPEEDS = 3
    NO_DEPTH_RATE = 4
    #: The state has a current of its own.
    CURRENT_STATED = 5


class BoxQuantity(IntEnum):
    """A quantity of the box in which effects were seen; the columns of `Forces.effects_outside`."""

    #: [m]
    DEPTH = 0
    #: Speed through the water [m/s].
    SPEED = 1
    #: [m/s2]
    ACCELERATION = 2
    #: [rad/s]
    ANGULAR_SPEED = 3
    #: [kg/m3]
    DENSITY = 4


@dataclass(slots=True, eq=False, repr=False)
class Forces:
    """What the water does to the vehicle, body frame, in single precision; arrays may be read-only.

    Shapes are those of a single state with K surfaces, in the order of `Vehicle.surfaces`, and E effects; in the answer
    to a batch each array has N rows of them. The bits are the same whatever the transport, alone or in a batch.

    Attributes:
        force_n: Net force [N], `[3]`.
        moment_nm: Net moment about `about_m` [N m], `[3]`.
        about_m: Reference point of the moments, the center of mass [m]: `[3]`, for a batch too.
        uncertainty_n: One standard deviation of the net force [N], `[3]`.
        moment_uncertainty_nm: One standard deviation of the net moment [N m], `[3]`.
        surface_force_n: Force of the model on each surface [N], `[K, 3]`; K is 0 where the surfaces were left
            out.
        surface_point_m: Point at which it acts [m], `[K, 3]`.
        surface_couple_nm: Moment of its load about that point [N m], `[K, 3]`; K is 0 of a bundle without the
            physical base.
        wetted_fraction: Share of each surface under water, `[K]`.
        outside: How far each `Quantity` lies outside the training domain, in its unit: negative below, positive
            above, 0 within.
        effects: The effects that were added to the model: a number that this client does not know is of a newer
            server.
        effect_force_n: Force of each effect [N], `[E, 3]`: with those of the surfaces they sum to `force_n`.
        effect_moment_nm: Moment of each effect about `about_m` [N m], `[E, 3]`.
        effect_left_out: Why an effect has no load: a `LeftOut`, or 0 where it has one; `[E]`.
        effect_surface_force_n: Share of the effects' forces that acts on each surface [N], `[K, 3]`: a part of
            `effect_force_n`, not to be added to it. K is 0 where there are no effects.
        effects_outside: How far each `BoxQuantity` lies outside the box in which the effects were seen; above
            it they are as at its edge.
        added_mass: Added mass and inertia about `about_m` [kg, kg m, kg m2], `[6, 6]`, forces first. The wrench
            is `-M_A nu_dot`, with the rates of the body components of the velocity of the center of mass and of
            the angular velocity. None of a bundle without the physical base or such an effect.
        jacobian: Derivatives of the wrench about `about_m`, force first, `[6, 11]`: by the velocity over ground
            [m/s] in columns 0 to 2, the angular velocity [rad/s] in 3 to 5, the water level [m] in 6, the
            attitude [rad] in 7 to 9 and the density [kg/m3] in 10, each with the others held. The attitude is a
            small turn of the body about its axes, which leaves the body components of the motion and the water
            level as they are. None where `State.jacobian` did not ask for them.
        damping: Linear damping by waves about `about_m` [kg/s, kg m/s, kg m2/s], `[6, 6]`: the wrench is `-B
            nu`. Zero in a run of states, whose memory has it. None of a bundle without the physical base, as
            what follows.
        water_level_m: Height of the still water above the body's origin along up, as used [m].
        bed_clearance_m: Distance from the ground-contact plane down to the bed, as used [m].
        bed: Share of the motion through the water that is motion over the bed, as used.
        shaft_power_w: Power that the shafts of the wheels put in [W]. None of a server that does not state it,
            too.
        session_begins: True where a run of states begins with this one: effects remember nothing yet. In the
            middle of a run it says that the server has forgotten it.
        bundle_version: Version of the bundle that answered.
        provenance: Where the weights come from, such as "analytic"; over shared memory the first 64 bytes of
            it.
        compute_ns: The server's own time [ns], for the whole batch.
    """

    force_n: Array
    moment_nm: Array
    about_m: Array
    uncertainty_n: Array
    moment_uncertainty_nm: Array
    surface_force_n: Array
    surface_point_m: Array
    surface_couple_nm: Array
    wetted_fraction: Array
    outside: Array
    effects: tuple[Effect | int, ...]
    effect_force_n: Array
    effect_moment_nm: Array
    effect_left_out: NDArray[np.uint8]
    effect_surface_force_n: Array
    effects_outside: Array
    added_mass: Array | None
    jacobian: Array | None
    damping: Array | None
    water_level_m: Array | None
    bed_clearance_m: Array | None
    bed: Array | None
    shaft_power_w: Array | None
    session_begins: NDArray[np.bool_] | np.bool_
    bundle_version: int
    provenance: str
    compute_ns: int

    def __repr__(self) -> str:
        """The net wrench and how far it can be trusted; every field is an attribute."""
        rows = self.force_n.shape[:-1]
        shown = [f"[{rows[0]}]"] if rows else []
        names = ("force_n", "uncertainty_n", "moment_nm")
        shown += [f"{name}={brief(getattr(self, name))}" for name in names]
        shown.append(f"in_domain={brief(self.in_domain)}")
        if self.effects:
            shown.append(f"effects={len(self.effects)}")
        return f"Forces({', '.join(shown)}, bundle_version={self.bundle_version})"

    @property
    def in_domain(self) -> NDArray[np.bool_] | np.bool_:
        """True where no quantity lies outside the training domain: one value, or `[N]` for a batch."""
        inside: NDArray[np.bool_] | np.bool_ = np.logical_not(np.any(self.outside, axis=-1))
        return inside


_KNOWN = {int(effect): effect for effect in Effect}


def named_effect(code: int) -> Effect | int:
    """The effect of a number of the wire."""
    return _KNOWN.get(code, code)
