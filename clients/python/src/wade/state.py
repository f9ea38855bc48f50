"""What a client tells the server: the state of a vehicle in the water, or of N vehicles at once."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InvalidState, Violation


class GroundContact(IntEnum):
    """Whether water reaches under the contact patches of the tires. The values are those of the wire."""

    #: Full Archimedes.
    WETTED = 1
    #: No water pressure under the contact patches.
    DRY = 2


_REST = (0.0, 0.0, 0.0)
_FRESH_WATER = 1000.0
_LEVEL = (0.0, 0.0, -1.0)

#: Fields with one number a state, and those with three, in the order of `State.floats`.
SCALARS = ("depth_m", "density_kgpm3")
VECTORS = (
    "velocity_mps",
    "current_mps",
    "angular_velocity_radps",
    "acceleration_mps2",
    "angular_acceleration_radps2",
    "gravity_direction",
)


@dataclass(slots=True, kw_only=True, eq=False)
class State:
    """One state, or N of them for a batch. Body frame: x forward, y left, z up; SI units.

    In a single state a vector is any sequence of three numbers. In a batch `depth_m` is `[N]`, a vector is `[N, 3]` or,
    where all have the same, `[3]`, and the density `[N]` or one number. What is left out has the server's default.
    """

    #: Undisturbed water surface above the ground-contact plane at the body origin [m].
    depth_m: ArrayLike
    #: Velocity over ground [m/s]; through the water where there is no current.
    velocity_mps: ArrayLike = _REST
    #: Velocity of the water over ground [m/s].
    current_mps: ArrayLike = _REST
    #: Angular velocity [rad/s].
    angular_velocity_radps: ArrayLike = _REST
    #: Acceleration [m/s2].
    acceleration_mps2: ArrayLike = _REST
    #: Angular acceleration [rad/s2].
    angular_acceleration_radps2: ArrayLike = _REST
    #: Density of the water [kg/m3].
    density_kgpm3: ArrayLike = _FRESH_WATER
    #: Unit vector along gravity (down); see `gravity_from_roll_pitch` and `gravity_from_quaternion`.
    gravity_direction: ArrayLike = _LEVEL
    #: One for the whole batch.
    ground_contact: GroundContact = GroundContact.WETTED

    def is_default(self, name: str) -> bool:
        """True where a field was left out, so that it need not travel."""
        return getattr(self, name) is _DEFAULTS.get(name)

    def floats(self) -> list[float]:
        """The numbers of a single state: the scalars, then three a vector. Raises `InvalidState` for a wrong shape."""
        values = []
        name = ""
        try:
            for name in SCALARS:
                values.append(float(getattr(self, name)))
            for name in VECTORS:
                vector = getattr(self, name)
                if vector is _DEFAULTS[name]:
                    values += vector
                else:
                    x, y, z = vector
                    values += (float(x), float(y), float(z))
        except (TypeError, ValueError):
            expected = "one number" if name in SCALARS else "three numbers"
            raise _wrong(name, f"must be {expected}, got {_describe(getattr(self, name))}") from None
        return values

    def rows(self) -> dict[str, NDArray[np.float32]]:
        """The arrays of a batch in single precision: `[N]` a scalar, `[N, 3]` a vector, in their order.

        Raises `InvalidState` for a wrong shape and for an empty batch.
        """
        depth = _array("depth_m", self.depth_m)
        if depth.ndim != 1 or depth.size == 0:
            raise _wrong(
                "depth_m", f"must have one value a state, [N] with N at least 1, got {_describe(self.depth_m)}"
            )
        rows = {"depth_m": depth}
        for name in (*SCALARS[1:], *VECTORS):
            shape = (depth.size, 3) if name in VECTORS else (depth.size,)
            array = _array(name, getattr(self, name))
            if array.shape not in (shape, shape[1:]):
                raise _wrong(name, f"must have shape {shape} or {shape[1:]}, got {_describe(getattr(self, name))}")
            rows[name] = np.broadcast_to(array, shape)
        return rows


_DEFAULTS: dict[str, Any] = {name: field.default for name, field in State.__dataclass_fields__.items()}


def _array(name: str, value: ArrayLike) -> NDArray[np.float32]:
    try:
        # what single precision cannot hold becomes infinite, which the server refuses
        with np.errstate(over="ignore"):
            return np.asarray(value, dtype=np.float32)
    except (TypeError, ValueError):
        raise _wrong(name, f"must be numbers, got {_describe(value)}") from None


def _describe(value: Any) -> str:
    shape = getattr(value, "shape", None)
    return repr(value)[:60] if shape is None else f"shape {shape}"


def _wrong(name: str, description: str) -> InvalidState:
    return InvalidState([Violation(name, f"{name} {description}")])
