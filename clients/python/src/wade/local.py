"""What the clients on this machine have in common: the flags of a state, and streams that are sessions by number."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Protocol

from . import shm_layout as layout
from .forces import Forces
from .state import GroundContact, Physics, State


def session_numbers() -> Iterator[int]:
    """Numbers of streams, above those that a caller is likely to choose."""
    return itertools.count(1 << 63)


def flags(state: State) -> int:
    """The flags of a state, or of a batch."""
    flags = layout.DRY_CONTACT if state.ground_contact == GroundContact.DRY else 0
    if state.implicit_added_mass:
        flags |= layout.IMPLICIT_ADDED_MASS
    if state.jacobian:
        flags |= layout.JACOBIAN
    if state.heading_rad is not None:
        flags |= layout.HAS_HEADING
    if state.depth_rate_mps is not None:
        flags |= layout.HAS_DEPTH_RATE
    if state.wheel_speed_radps is not None:
        flags |= layout.HAS_WHEEL_SPEEDS
    if state.water_level_m is not None:
        flags |= layout.HAS_WATER_LEVEL
    if state.bed_clearance_m is not None:
        flags |= layout.HAS_BED_CLEARANCE
    if state.bed is not None:
        flags |= layout.HAS_BED
    if state.wheel_water_level_m is not None:
        flags |= layout.HAS_WHEEL_LEVELS
    if state.has_wave():
        flags |= layout.HAS_WAVE
    if state.current_exponent is not None:
        flags |= layout.HAS_CURRENT_EXPONENT
    if state.physics == Physics.HYDROSTATIC:
        flags |= layout.HYDROSTATIC
    elif state.physics == Physics.QUASI_STEADY:
        flags |= layout.QUASI_STEADY
    elif state.physics == Physics.FULL:
        flags |= layout.FULL
    return flags


class _Client(Protocol):
    _sessions: Iterator[int]

    def _evaluate(self, vehicle: str, state: State, session: int, timeout_s: float | None) -> Forces: ...


class SessionStream:
    """One answer a state, in order: a run, in which effects remember.

    A call that fails ends the run, and the next begins another.
    """

    def __init__(self, client: _Client, vehicle: str):
        self._client, self._vehicle = client, vehicle
        self._session = next(client._sessions)

    def evaluate(self, state: State, *, timeout_s: float | None = None) -> Forces:
        """The forces in one state."""
        try:
            return self._client._evaluate(self._vehicle, state, state.sessions(None) or self._session, timeout_s)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Ends the run; its memory is dropped in time."""
        self._session = next(self._client._sessions)

    def __enter__(self) -> SessionStream:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()
