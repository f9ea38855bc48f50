"""What a client tells the server: the state of a vehicle in the water, or of N vehicles at once."""

from __future__ import annotations

import math
from dataclasses import InitVar, dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .attitude import gravity_from_quaternion, gravity_from_roll_pitch, heading_from_quaternion
from .brief import brief
from .errors import InvalidState, Violation


class GroundContact(IntEnum):
    """Whether water reaches under the contact patches of the tires. The values are those of the wire."""

    #: Full Archimedes.
    WETTED = 1
    #: No water pressure under the contact patches.
    DRY = 2


class Physics(IntEnum):
    """How much of the physical base answers. The values are those of the wire."""

    #: The pressure of still water.
    HYDROSTATIC = 1
    #: And drag and friction of the local velocity.
    QUASI_STEADY = 2
    #: And added mass, entry and the waves that the hull makes.
    FULL = 3


_REST = (0.0, 0.0, 0.0)
_FRESH_WATER = 1000.0
_LEVEL = (0.0, 0.0, -1.0)
_NO_TIME = 0.0

#: Fields with one number a state, and those with three.
SCALARS = ("depth_m", "density_kgpm3")
VECTORS = (
    "velocity_mps",
    "current_mps",
    "angular_velocity_radps",
    "acceleration_mps2",
    "angular_acceleration_radps2",
    "gravity_direction",
)
#: Most wheels whose speeds can be stated.
MAX_WHEELS = 8
#: Fields that may be None, which is not the same as 0: how many numbers each has in `State.floats`.
TOLD = {
    "heading_rad": 1,
    "depth_rate_mps": 1,
    "wheel_speed_radps": MAX_WHEELS,
    "water_level_m": 1,
    "bed_clearance_m": 1,
    "bed": 1,
    "wave_vector_radpm": 3,
    "wave_amplitude_m": 1,
    "wave_phase_rad": 1,
    "wheel_water_level_m": MAX_WHEELS,
    "current_exponent": 1,
}
#: Those of them with a value a wheel, and those that are 0 where they are None.
PER_WHEEL = ("wheel_speed_radps", "wheel_water_level_m")
ZERO = ("wave_vector_radpm", "wave_amplitude_m", "wave_phase_rad", "current_exponent")
#: Those with three numbers.
THREE = (*VECTORS, "wave_vector_radpm")
#: Where the numbers of `State.floats` stand.
TOLD_AT = len(SCALARS) + 3 * len(VECTORS)
TIME_STEP_AT = TOLD_AT + sum(TOLD.values())
#: Place behind the wheels' speeds, and of the wheels' levels, in what stands at `TOLD_AT`.
WHEELS_END = 2 + MAX_WHEELS
LEVELS_AT = TIME_STEP_AT - TOLD_AT - 1 - MAX_WHEELS

_UNTOLD = (math.nan,) * sum(TOLD.values())


@dataclass(slots=True, kw_only=True, eq=False, repr=False)
class State:
    """One state, or N of them for a batch. Body frame: x forward, y left, z up; SI units.

    Exactly one of `depth_m` and `water_level_m` is given; of a vehicle on its side or its back the latter. In a single
    state a vector is any sequence of three numbers. In a batch that one is `[N]`, a vector is `[N, 3]` or, where all
    have the same, `[3]`, and any other number `[N]` or one number; NaN in a row states no level, clearance or bed. What
    is left out has the server's default.

    Attributes:
        depth_m: Undisturbed water surface above the ground-contact plane at the body origin [m]; negative where
            it is below.
        velocity_mps: Velocity over ground [m/s]; through the water where there is no current.
        current_mps: Velocity of the water over ground [m/s].
        angular_velocity_radps: Angular velocity [rad/s].
        acceleration_mps2: Acceleration [m/s2].
        angular_acceleration_radps2: Angular acceleration [rad/s2].
        density_kgpm3: Density of the water [kg/m3].
        gravity_direction: Unit vector along gravity (down). At most one of this, `roll_pitch_rad` and
            `world_from_body` is given.
        roll_pitch_rad: Roll and pitch, `[2]` or `[N, 2]`, which set `gravity_direction`: positive roll lowers the
            right side, positive pitch the nose.
        world_from_body: Quaternion (w, x, y, z) that takes body to world vectors, `[4]` or `[N, 4]`: sets
            `gravity_direction`, and `heading_rad` where that is left out.
        ground_contact: One for the whole batch.
        heading_rad: Angle from the world's x to the body's x [rad]. None: effects that are fixed in the world
            are left out.
        depth_rate_mps: Rate at which the water rises at the body origin [m/s]. None: in a run of states that of
            the depth, else effects that need it are left out.
        wheel_speed_radps: Speed of each wheel or track of the vehicle by axle from the front, left before right
            [rad/s]: of four wheels front left, front right, rear left, rear right; of a track that of its drive
            sprocket. `[W]` or `[N, W]` for W wheels. None: effects that need them are left out.
        water_level_m: Signed height of the still-water plane above the body origin along up [m], in the place
            of `depth_m`.
        bed_clearance_m: Distance from the ground-contact plane down to the bed [m]. None: on the bed until the
            vehicle floats.
        bed: Share of the motion through the water that is motion over the bed, 0 parked to 1 driving. None:
            from velocities.
        wave_vector_radpm: A regular wave about the level, of linear theory: wave number along the direction in which
            it travels [rad/m], `[3]` or `[N, 3]`. For this and the next four the vehicle needs the physical base.
        wave_amplitude_m: Half the height of the wave from trough to crest [m]. None: no wave.
        wave_phase_rad: `k . x - w t` of the wave at the body origin [rad]: a crest at 0, and after it the water falls.
        wheel_water_level_m: Height of the water surface above the body origin along up at each wheel [m], in the order
            of `wheel_speed_radps`; the level is then that at the body origin. Not beside a wave.
        current_exponent: Exponent n of the profile of the current over the height s h over the bed,
            `current_mps (1 + n) s^n`. None: even.
        physics: How much of the physical base answers. One for the whole batch. None: as the server is set, by
            default all of it.
        time_step_s: Time since the state before it in the run [s]. 0: what effects remember stays as it is.
        implicit_added_mass: The caller adds `Forces.added_mass` to a mass matrix of his own: the forces leave
            `-M_A nu_dot` out and keep the rest. One for the whole batch.
        jacobian: Answer with `Forces.jacobian`; refused of a vehicle without the physical base. One for the
            whole batch.
        session: Over shared memory, the number of a run of states that follow each other, for effects that
            remember (waves, flooding): one an environment, `[N]` in a batch. A run in batches is another than
            that of the same number in single calls. 0: none. A stream is a run without a number; over gRPC
            there is no other.
    """

    depth_m: ArrayLike | None = None
    velocity_mps: ArrayLike = _REST
    current_mps: ArrayLike = _REST
    angular_velocity_radps: ArrayLike = _REST
    acceleration_mps2: ArrayLike = _REST
    angular_acceleration_radps2: ArrayLike = _REST
    density_kgpm3: ArrayLike = _FRESH_WATER
    gravity_direction: ArrayLike = _LEVEL
    ground_contact: GroundContact = GroundContact.WETTED
    heading_rad: ArrayLike | None = None
    depth_rate_mps: ArrayLike | None = None
    wheel_speed_radps: ArrayLike | None = None
    water_level_m: ArrayLike | None = None
    bed_clearance_m: ArrayLike | None = None
    bed: ArrayLike | None = None
    wave_vector_radpm: ArrayLike | None = None
    wave_amplitude_m: ArrayLike | None = None
    wave_phase_rad: ArrayLike | None = None
    wheel_water_level_m: ArrayLike | None = None
    current_exponent: ArrayLike | None = None
    physics: Physics | None = None
    time_step_s: ArrayLike = _NO_TIME
    implicit_added_mass: bool = False
    jacobian: bool = False
    session: ArrayLike = 0
    roll_pitch_rad: InitVar[ArrayLike | None] = None
    world_from_body: InitVar[ArrayLike | None] = None

    def __post_init__(self, roll_pitch_rad: ArrayLike | None, world_from_body: ArrayLike | None) -> None:
        if roll_pitch_rad is None and world_from_body is None:
            return
        given = {"roll_pitch_rad": roll_pitch_rad, "world_from_body": world_from_body}
        if not self.is_default("gravity_direction"):
            given["gravity_direction"] = self.gravity_direction
        attitudes = [name for name, value in given.items() if value is not None]
        if len(attitudes) > 1:
            raise _wrong(attitudes[1], f"and {attitudes[0]} are both given: give one of the two")
        if roll_pitch_rad is not None:
            angles = _of_length("roll_pitch_rad", roll_pitch_rad, 2)
            self.gravity_direction = gravity_from_roll_pitch(angles[..., 0], angles[..., 1])
        if world_from_body is not None:
            quaternion = _of_length("world_from_body", world_from_body, 4)
            self.gravity_direction = gravity_from_quaternion(quaternion)
            if self.heading_rad is None:
                self.heading_rad = heading_from_quaternion(quaternion)

    def __repr__(self) -> str:
        """The fields that were given."""
        given = (name for name in self.__slots__ if not self.is_default(name))
        return f"State({', '.join(f'{name}={brief(getattr(self, name))}' for name in given)})"

    def is_default(self, name: str) -> bool:
        """True where a field was left out, so that it need not travel."""
        return getattr(self, name) is _DEFAULTS.get(name)

    def has_wave(self) -> bool:
        """True where a field of the wave is given."""
        return not (self.wave_vector_radpm is None and self.wave_amplitude_m is None and self.wave_phase_rad is None)

    def floats(self) -> list[float]:
        """The numbers of a single state: the scalars, three a vector, what is told or NaN, the time step.

        Behind the last wheel there is NaN.

        Raises `InvalidState` for a wrong shape.
        """
        values = []
        name = ""
        try:
            for name in SCALARS:
                value = getattr(self, name)
                values.append(math.nan if value is None else float(value))
            for name in VECTORS:
                vector = getattr(self, name)
                if vector is _DEFAULTS[name]:
                    values += vector
                else:
                    x, y, z = vector
                    values += (float(x), float(y), float(z))
            if all(getattr(self, name) is None for name in TOLD):
                values += _UNTOLD
            else:
                for name, count in TOLD.items():
                    values += _told(name, getattr(self, name), count)
            name = "time_step_s"
            values.append(float(getattr(self, name)))
        except InvalidState:
            raise
        except (TypeError, ValueError):
            expected = "three numbers" if name in THREE else _NUMBERS_TOLD.get(name, "one number")
            raise _wrong(name, f"must be {expected}, got {_describe(getattr(self, name))}") from None
        return values

    def rows(self) -> dict[str, NDArray[np.float32]]:
        """The arrays of a batch in single precision: `[N]` a scalar, `[N, 3]` a vector, and what is told.

        Raises `InvalidState` for a wrong shape and for an empty batch.
        """
        first = "depth_m" if self.depth_m is not None or self.water_level_m is None else "water_level_m"
        given = getattr(self, first)
        if given is None:
            raise _wrong(first, "must be given, or water_level_m in its place")
        depth = _array(first, given)
        if depth.ndim != 1 or depth.size == 0:
            raise _wrong(first, f"must have one value a state, [N] with N at least 1, got {_describe(given)}")
        rows = {first: depth}
        told = [name for name in TOLD if getattr(self, name) is not None and name != first]
        for name in (*SCALARS[1:], *VECTORS, *told, "time_step_s"):
            array = _array(name, getattr(self, name))
            shape = (depth.size, 3) if name in THREE else (depth.size,)
            if name in PER_WHEEL:
                shape = (depth.size, _wheels(name, array.shape))
            if array.shape not in (shape, shape[1:]):
                raise _wrong(name, f"must have shape {shape} or {shape[1:]}, got {_describe(getattr(self, name))}")
            rows[name] = np.broadcast_to(array, shape)
            if name in PER_WHEEL and np.isnan(array).any():
                index = int(np.isnan(rows[name]).any(axis=1).argmax())
                description = f"{name} must be finite (state {index} of the batch)"
                raise InvalidState([Violation(name, description, index)])
        return rows

    @staticmethod
    def length(rows: dict[str, NDArray[np.float32]]) -> int:
        """Number of states in the arrays of `rows`."""
        return len(next(iter(rows.values())))

    def sessions(self, length: int | None) -> Any:
        """The number of the run of a single state (`length` None), or `[N]` of them. Raises `InvalidState`."""
        if self.session is _DEFAULTS["session"]:
            return 0
        array = np.asarray(self.session)
        shapes = ((),) if length is None else ((), (length,))
        if array.shape not in shapes or array.dtype.kind not in "iu" or (array < 0).any():
            expected = "a whole number, 0 or greater" + ("" if length is None else f", or [{length}] of them")
            raise _wrong("session", f"must be {expected}, got {_describe(self.session)}")
        return int(array) if length is None else array.astype(np.uint64)


_DEFAULTS: dict[str, Any] = {name: field.default for name, field in State.__dataclass_fields__.items()}


_NUMBERS_TOLD = dict.fromkeys(PER_WHEEL, f"1 to {MAX_WHEELS} numbers, one a wheel")


def _told(name: str, value: Any, count: int) -> tuple[float, ...]:
    if value is None:
        return (0.0 if name in ZERO else math.nan,) * count
    if count == 1:
        return (float(value),)
    numbers = tuple(float(number) for number in value)
    if name not in PER_WHEEL:
        if len(numbers) != count:
            raise ValueError
        return numbers
    if not 1 <= len(numbers) <= count:
        raise ValueError
    # which is what stands behind the last wheel
    if any(math.isnan(number) for number in numbers):
        raise _wrong(name, "must be finite")
    return numbers + (math.nan,) * (count - len(numbers))


def _wheels(name: str, shape: tuple[int, ...]) -> int:
    """How many wheels the values of a batch are for."""
    wheels = shape[-1] if len(shape) in (1, 2) else 0
    if not 1 <= wheels <= MAX_WHEELS:
        expected = f"[N, W] or [W] with W from 1 to {MAX_WHEELS}"
        raise _wrong(name, f"must have one value a wheel, {expected}, got shape {shape}")
    return wheels


def _of_length(name: str, value: ArrayLike, count: int) -> NDArray[np.float64]:
    """A vector of so many numbers, or rows of them."""
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        raise _wrong(name, f"must be numbers, got {_describe(value)}") from None
    if array.ndim not in (1, 2) or array.shape[-1] != count:
        raise _wrong(name, f"must have shape [{count}] or [N, {count}], got {_describe(value)}")
    return array


def _array(name: str, value: ArrayLike) -> NDArray[np.float32]:
    try:
        # what single precision cannot hold becomes infinite, which the server refuses
        with np.errstate(over="ignore"):
            return np.asarray(value, dtype=np.float32)
    except (TypeError, ValueError):
        if row := _odd_row(value):
            raise _wrong(name, f"state {row[0]} of the batch has {row[1]} values, state 0 has {row[2]}") from None
        raise _wrong(name, f"must be numbers, got {_describe(value)}") from None


def _odd_row(value: Any) -> tuple[int, int, int] | None:
    """The first row that is not as long as row 0: its place, its length, and that of row 0."""
    if not isinstance(value, list | tuple) or not all(isinstance(row, list | tuple) for row in value):
        return None
    lengths = [len(row) for row in value]
    return next(((at, own, lengths[0]) for at, own in enumerate(lengths) if own != lengths[0]), None)


def _describe(value: Any) -> str:
    shape = getattr(value, "shape", None)
    return repr(value)[:60] if shape is None else f"shape {shape}"


def _wrong(name: str, description: str) -> InvalidState:
    return InvalidState([Violation(name, f"{name} {description}")])
