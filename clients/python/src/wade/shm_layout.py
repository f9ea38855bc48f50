"""What lies in shared memory: the counterpart of crates/wade-wire/src/shm/layout.rs, to which the tests hold it.

Little-endian as the machine is. The version is part of the services' names.
"""

from __future__ import annotations

import ctypes
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

VERSION = "v4"
MAX_BATCH = 256
MAX_SURFACES = 64
#: Room for effects, for quantities of a domain, for wheels, for the text of the provenance, and for what is to come.
MAX_EFFECTS = 32
MAX_QUANTITIES = 16
MAX_WHEELS = 8
PROVENANCE_LEN = 64
RESERVED_LEN = 128
DESCRIPTION_LEN = 65_376
RESERVED_LEFT = 120
QUERY_RESERVED = 96

#: Attributes of the service of `served_name`: the version of the layout, and lists of the vehicles that are served.
SERVED_LAYOUT = "layout"
SERVED_VEHICLES = "vehicles"

#: Flag of a query: no water pressure under the contact patches.
DRY_CONTACT = 1
#: Flag of a query: the caller integrates added mass.
IMPLICIT_ADDED_MASS = 2
#: Flags of a query: these fields are set. A field that is not set is NaN.
HAS_HEADING = 4
HAS_DEPTH_RATE = 8
HAS_WHEEL_SPEEDS = 16
HAS_WATER_LEVEL = 32
HAS_BED_CLEARANCE = 64
HAS_BED = 128
HAS_WHEEL_LEVELS = 256
HYDROSTATIC = 512
QUASI_STEADY = 1024
FULL = 2048
#: Flag of a query: the derivatives are asked for, for which `evaluate_jacobian_name` alone has room.
JACOBIAN = 4096
#: Flags of a query: these fields are set. Without them they are not read.
HAS_WAVE = 8192
HAS_CURRENT_EXPONENT = 16384
#: Flag of an answer: the server polls, so that waking it is of no use.
SERVER_POLLS = 1
#: Flag of an answer: the session begins with this query.
SESSION_BEGINS = 2
#: Flags of an answer: it holds these matrices.
HAS_ADDED_MASS = 4
HAS_DAMPING = 8
#: Flag of an answer: `wheel_count` is set.
HAS_WHEEL_COUNT = 16
#: Flag of an answer: `shaft_power_w` is set.
HAS_SHAFT_POWER = 32

STATUS_OK = 0
STATUS_INVALID_STATE = 1
STATUS_NOT_SERVED = 3
STATUS_TOO_LONG = 4

_RESERVED: tuple[str, str, int] = ("reserved", "u1", RESERVED_LEN)

QUERY = np.dtype(
    [
        ("sequence", "<u8"),
        ("wake_key", "<u8"),
        ("session", "<u8"),
        ("flags", "<u8"),
        ("depth_m", "<f4"),
        ("density_kgpm3", "<f4"),
        ("velocity_mps", "<f4", 3),
        ("current_mps", "<f4", 3),
        ("angular_velocity_radps", "<f4", 3),
        ("acceleration_mps2", "<f4", 3),
        ("angular_acceleration_radps2", "<f4", 3),
        ("gravity_direction", "<f4", 3),
        ("time_step_s", "<f4"),
        ("heading_rad", "<f4"),
        ("depth_rate_mps", "<f4"),
        ("water_level_m", "<f4"),
        ("bed_clearance_m", "<f4"),
        ("bed", "<f4"),
        ("wheel_speed_radps", "<f4", MAX_WHEELS),
        ("wheel_water_level_m", "<f4", MAX_WHEELS),
        ("owner", "<u8"),
        ("wave_vector_radpm", "<f4", 3),
        ("wave_amplitude_m", "<f4"),
        ("wave_phase_rad", "<f4"),
        ("current_exponent", "<f4"),
        ("reserved", "u1", QUERY_RESERVED),
    ]
)

EFFECT_ANSWER = np.dtype([("effect", "<u4"), ("left_out", "<u4"), ("force_n", "<f4", 3), ("moment_nm", "<f4", 3)])

SURFACE_ANSWER = np.dtype(
    [
        ("force_n", "<f4", 3),
        ("point_m", "<f4", 3),
        ("couple_nm", "<f4", 3),
        ("effect_force_n", "<f4", 3),
        ("wetted_fraction", "<f4"),
    ]
)

ANSWER = np.dtype(
    [
        ("sequence", "<u8"),
        ("compute_ns", "<u8"),
        ("flags", "<u8"),
        ("status", "<u4"),
        ("field", "<u4"),
        ("problem", "<u4"),
        ("bundle_version", "<u4"),
        ("surface_count", "<u4"),
        ("effect_count", "<u4"),
        ("force_n", "<f4", 3),
        ("moment_nm", "<f4", 3),
        ("about_m", "<f4", 3),
        ("force_deviation_n", "<f4", 3),
        ("moment_deviation_nm", "<f4", 3),
        ("outside", "<f4", MAX_QUANTITIES),
        ("effects_outside", "<f4", MAX_QUANTITIES),
        ("water_level_m", "<f4"),
        ("bed_clearance_m", "<f4"),
        ("bed", "<f4"),
        ("provenance", f"S{PROVENANCE_LEN}"),
        ("effects", EFFECT_ANSWER, MAX_EFFECTS),
        ("surfaces", SURFACE_ANSWER, MAX_SURFACES),
        ("added_mass", "<f4", 36),
        ("damping", "<f4", 36),
        ("wheel_count", "<u4"),
        ("shaft_power_w", "<f4"),
        ("reserved", "u1", RESERVED_LEFT),
    ]
)

#: Columns of the derivatives, and their numbers.
JACOBIAN_COLUMNS = 11
DERIVATIVES = 6 * JACOBIAN_COLUMNS

JACOBIAN_ANSWER = np.dtype([("answer", ANSWER), ("jacobian", "<f4", DERIVATIVES), _RESERVED])

BATCH_HEADER = np.dtype(
    [("sequence", "<u8"), ("wake_key", "<u8"), ("flags", "<u8"), ("count", "<u4"), ("spare", "<u4"), _RESERVED]
)

BATCH_QUERY = np.dtype([("header", BATCH_HEADER), ("queries", QUERY, MAX_BATCH)])

BATCH_ANSWER = np.dtype(
    [
        ("sequence", "<u8"),
        ("compute_ns", "<u8"),
        ("flags", "<u8"),
        ("status", "<u4"),
        ("index", "<u4"),
        ("count", "<u4"),
        ("spare", "<u4"),
        _RESERVED,
        ("answers", ANSWER, MAX_BATCH),
    ]
)

#: Names of the fields that an answer may find wrong, by code.
FIELDS = {
    1: "velocity_mps",
    2: "current_mps",
    3: "angular_velocity_radps",
    4: "acceleration_mps2",
    5: "angular_acceleration_radps2",
    6: "gravity_direction",
    7: "depth_m",
    8: "density_kgpm3",
    9: "world_from_body",
    10: "roll_pitch",
    11: "ground_contact",
    12: "heading_rad",
    13: "depth_rate_mps",
    14: "wheel_speed_radps",
    15: "time_step_s",
    16: "water_level_m",
    17: "bed_clearance_m",
    18: "bed",
    19: "wheel_water_level_m",
    20: "flags",
    21: "physics",
    22: "jacobian",
    23: "wave_vector_radpm",
    24: "wave_amplitude_m",
    25: "wave_phase_rad",
    26: "current_exponent",
}

#: The code of a number of values that does not fit the vehicle.
PROBLEM_COUNT = 7

#: What is wrong with them, by code.
PROBLEMS = {
    1: "must be finite",
    2: "must not be that large",
    3: "must not be negative",
    4: "must be greater than zero",
    5: "must have length 1",
    6: "must be one of the values of its enumeration",
    7: "must have one value for each wheel of the vehicle, or none",
    8: "is set, which this server does not support yet",
    9: "has a value, but its flag is not set",
    10: "must be given, or water_level_m in its place",
    11: "and depth_m are both given: give one of the two",
    12: "means nothing for a vehicle on its side or its back: give water_level_m",
    13: "must lie between 0 (parked) and 1 (driving)",
}


def fields(dtype: np.dtype[Any]) -> dict[str, tuple[np.dtype[Any], int]]:
    """Type and offset of each field of a struct, in order."""
    assert dtype.fields is not None, "a struct has fields"
    return {name: (field[0], field[1]) for name, field in dtype.fields.items()}


#: What a server says of a vehicle: the bytes of a `GetVehicleResponse`.
VEHICLE_ANSWER = np.dtype(
    [
        ("sequence", "<u8"),
        ("flags", "<u8"),
        ("status", "<u4"),
        ("len", "<u4"),
        _RESERVED,
        ("description", "u1", DESCRIPTION_LEN),
    ]
)


def _pack_format(dtype: np.dtype[Any]) -> str:
    # what is reserved becomes zero
    codes = {"<u8": "Q", "<u4": "I", "<f4": "f", "|u1": "x"}
    types = (field for field, _ in fields(dtype).values())
    return "<" + "".join(codes[field.base.str] * int(np.prod(field.shape)) for field in types)


#: A query as bytes: several times faster than through a numpy record.
QUERY_STRUCT = struct.Struct(_pack_format(QUERY))


def _unset() -> NDArray[np.void]:
    query = np.zeros((), QUERY)
    optional = ("heading_rad", "depth_rate_mps", "water_level_m", "bed_clearance_m", "bed")
    for name in ("depth_m", *optional, "wheel_speed_radps", "wheel_water_level_m"):
        query[name] = np.nan
    return query


#: A query that sets nothing: at rest, with everything else NaN that need not be set.
UNSET_QUERY = _unset()


def _payload(name: str, dtype: np.dtype[Any]) -> type[ctypes.Structure]:
    """What iceoryx2 needs to know of a type: its name, size and alignment, which must be those of the server's."""
    words = [("words", ctypes.c_uint64 * (dtype.itemsize // 8))]
    return type(
        name, (ctypes.Structure,), {"_fields_": words, "type_name": staticmethod(lambda: f"wade::{VERSION}::{name}")}
    )


Query = _payload("Query", QUERY)
Answer = _payload("Answer", ANSWER)
JacobianAnswer = _payload("JacobianAnswer", JACOBIAN_ANSWER)
BatchQuery = _payload("BatchQuery", BATCH_QUERY)
BatchAnswer = _payload("BatchAnswer", BATCH_ANSWER)
VehicleAnswer = _payload("VehicleAnswer", VEHICLE_ANSWER)


def evaluate_name(namespace: str, vehicle: str) -> str:
    """Name of a vehicle's service for single states."""
    return f"{namespace}/{VERSION}/evaluate/{vehicle}"


def evaluate_batch_name(namespace: str, vehicle: str) -> str:
    """Name of a vehicle's service for batches."""
    return f"{namespace}/{VERSION}/evaluate_batch/{vehicle}"


def evaluate_jacobian_name(namespace: str, vehicle: str) -> str:
    """Name of a vehicle's service for single states with derivatives."""
    return f"{namespace}/{VERSION}/evaluate_jacobian/{vehicle}"


def vehicle_name(namespace: str, vehicle: str) -> str:
    """Name of the service that describes a vehicle."""
    return f"{namespace}/{VERSION}/vehicle/{vehicle}"


def served_name(namespace: str) -> str:
    """Name of the service whose attributes tell what is served, whatever the version of the layout."""
    return f"{namespace}/served"


def wake_name(namespace: str) -> str:
    """Name of the event service on which clients wake the server."""
    return f"{namespace}/{VERSION}/wake"


def done_name(namespace: str) -> str:
    """Name of the event service on which the server wakes the client whose listener is called `listener_name`."""
    return f"{namespace}/{VERSION}/done"


def listener_name(wake_key: int) -> str:
    """Name of the listener of a client with this wake key."""
    return f"{wake_key:016x}"
