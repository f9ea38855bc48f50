"""What the water does to a ground vehicle that drives into it, asked of a `wade` server.

`connect(address)` gives a client: `GrpcClient` or `ShmClient`, which have the same methods and types;
`wade.aio.GrpcClient` is for asyncio, and `InProcess` needs no server. A `State` goes in,
`Forces` come out, each for one vehicle or as arrays for N. Body frame: x forward, y left, z up; SI units, radians; the
fields are named as on the wire, with their unit. Errors are `WadeError`s.
"""

from typing import TYPE_CHECKING, Any

from .address import connect
from .attitude import gravity_from_quaternion, gravity_from_roll_pitch, heading_from_quaternion
from .channel import Tls
from .client import Client, Stream
from .errors import (
    DeadlineExceeded,
    InvalidState,
    LayoutMismatch,
    PermissionDenied,
    Refused,
    ResourceExhausted,
    ServerUnavailable,
    Unauthenticated,
    UnknownVehicle,
    Violation,
    WadeError,
)
from .forces import BoxQuantity, Effect, Forces, LeftOut, Quantity
from .in_process import InProcess
from .latency import Latency, Percentiles
from .rpc import GrpcClient
from .stability import Foot, Ford, Stability, StabilityModes
from .state import GroundContact, Physics, State
from .vehicle import ActiveEffect, EffectParameter, RegionLimit, Reloaded, Surface, Vehicle
from .version import VERSION as __version__
from .world import state_in_world, wrench_in_world

if TYPE_CHECKING:
    from .shm import ShmClient

__all__ = [
    "ActiveEffect",
    "BoxQuantity",
    "Client",
    "DeadlineExceeded",
    "Effect",
    "EffectParameter",
    "Foot",
    "Forces",
    "Ford",
    "GroundContact",
    "GrpcClient",
    "InProcess",
    "InvalidState",
    "Latency",
    "LayoutMismatch",
    "LeftOut",
    "Percentiles",
    "PermissionDenied",
    "Physics",
    "Quantity",
    "Refused",
    "RegionLimit",
    "Reloaded",
    "ResourceExhausted",
    "ServerUnavailable",
    "ShmClient",
    "Stability",
    "StabilityModes",
    "State",
    "Stream",
    "Surface",
    "Tls",
    "Unauthenticated",
    "UnknownVehicle",
    "Vehicle",
    "Violation",
    "WadeError",
    "__version__",
    "connect",
    "gravity_from_quaternion",
    "gravity_from_roll_pitch",
    "heading_from_quaternion",
    "state_in_world",
    "wrench_in_world",
]


def __getattr__(name: str) -> Any:
    """`ShmClient` is loaded when it is asked for: it needs iceoryx2, which gRPC alone does not."""
    if name == "ShmClient":
        from .shm import ShmClient

        return ShmClient
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
