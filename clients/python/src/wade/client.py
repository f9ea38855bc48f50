"""What the clients have in common, for code that takes any of them."""

from __future__ import annotations

import math
from numbers import Real
from typing import Protocol

from .forces import Forces
from .state import State
from .vehicle import Vehicle

#: Longest wait for an answer unless the caller says otherwise [s].
DEFAULT_TIMEOUT_S = 1.0


def checked_timeout(timeout_s: float) -> float:
    """A time to wait: zero or more; zero never waits, so that the call ends in `DeadlineExceeded`."""
    if not (isinstance(timeout_s, Real) and math.isfinite(timeout_s) and timeout_s >= 0):
        raise ValueError(f"timeout_s must be a finite number of seconds, zero or more, got {timeout_s!r}")
    return float(timeout_s)


def check_query(vehicle: object, state: object) -> None:
    """Names the arguments of `evaluate(vehicle, state)` where they are something else."""
    if not (isinstance(vehicle, str) and isinstance(state, State)):
        found = f"{type(vehicle).__name__}, {type(state).__name__}"
        raise TypeError(f"evaluate(vehicle, state) takes the name of a vehicle and a State, got ({found})")


class Stream(Protocol):
    """One answer a state, in order, for one vehicle: a run, in which effects remember and time moves by `time_step_s`.

    A call that fails ends the run, and the next begins it anew.
    """

    def evaluate(self, state: State, *, timeout_s: float | None = None) -> Forces:
        """The forces in one state."""

    def close(self) -> None:
        """Ends the stream."""

    def __enter__(self) -> Stream: ...
    def __exit__(self, *exception: object) -> None: ...


class Client(Protocol):
    """`GrpcClient`, `ShmClient` or `InProcess`. Every call ends within its timeout, with forces or a `WadeError`."""

    def evaluate(self, vehicle: str, state: State, *, timeout_s: float | None = None) -> Forces:
        """The forces on one vehicle in one state."""

    def evaluate_batch(
        self, vehicle: str, states: State, *, surfaces: bool = True, timeout_s: float | None = None
    ) -> Forces:
        """The forces in N states of one vehicle; `surfaces=False` leaves out the arrays per surface."""

    def stream(self, vehicle: str) -> Stream:
        """A stream of states of one vehicle, for a loop that asks at every tick."""

    def vehicles(self, *, timeout_s: float | None = None) -> list[str]:
        """Names of the vehicles that are served."""

    def vehicle(self, name: str, *, timeout_s: float | None = None) -> Vehicle:
        """Surfaces and their names, dimensions, mass and training domain of a vehicle."""

    def close(self) -> None:
        """Lets go of the server. A call after it connects anew."""

    def __enter__(self) -> Client: ...
    def __exit__(self, *exception: object) -> None: ...
