"""The model in this process: no server, no transport.

The compiled module `wade_native` evaluates it with the code of the server, so that the answers have the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from . import messages
from .client import check_query, checked_timeout
from .errors import DeadlineExceeded, InvalidState, UnknownVehicle, Violation, WadeError
from .forces import Array, Effect, Forces, named_effect
from .local import SessionStream, flags, session_numbers
from .stability import DEFAULT_TIMEOUT_S as MAP_TIMEOUT_S
from .stability import Ford, Stability
from .state import SCALARS, TOLD, VECTORS, ZERO, State
from .vehicle import Vehicle
from .version import VERSION

if TYPE_CHECKING:
    import wade_native

_INSTALL = "in a checkout of wade, with Rust: pip install ./clients/python/native"

#: How many numbers each field has in a state, in the order of `State.floats`.
_WIDTHS = dict.fromkeys(SCALARS, 1) | dict.fromkeys(VECTORS, 3) | TOLD | {"time_step_s": 1}
_NUMBERS = sum(_WIDTHS.values())


class InProcess:
    """Evaluates the vehicles of a folder; without one, those of wade's usual folder or those that wade carries.

    A vehicle is read with its first call. Several threads may share a client, but a vehicle answers one call at a
    time; a batch leaves the other threads of Python running. `timeout_s` is there for the other clients: nothing is
    waited for here, and 0 alone is refused as by them.
    """

    def __init__(self, vehicles: str | PathLike[str] | None = None):
        self._native = _native()
        try:
            self._library = self._native.Library(vehicles)
        except self._native.UnreadableVehicle as error:
            raise WadeError(str(error)) from None
        self._vehicles: dict[str, _Vehicle] = {}
        self._sessions = session_numbers()

    def evaluate(self, vehicle: str, state: State, *, timeout_s: float | None = None) -> Forces:
        """The forces on one vehicle in one state."""
        check_query(vehicle, state)
        return self._evaluate(vehicle, state, state.sessions(None), timeout_s)

    def _evaluate(self, vehicle: str, state: State, session: int, timeout_s: float | None) -> Forces:
        _check(timeout_s)
        numbers, known = state.floats(), self._vehicle(vehicle)
        try:
            answer = known.native.evaluate(numbers, flags(state), session)
        except self._native.InvalidState as invalid:
            raise InvalidState([Violation(*invalid.args)]) from None
        return known.forces(np.frombuffer(answer, known.rows[True, state.jacobian])[0], _as_it_is)

    def evaluate_batch(
        self, vehicle: str, states: State, *, surfaces: bool = True, timeout_s: float | None = None
    ) -> Forces:
        """The forces in N states of one vehicle, any number of them."""
        check_query(vehicle, states)
        _check(timeout_s)
        rows = states.rows()
        length = states.length(rows)
        # a number that is not given is not a number
        numbers = np.full((length, _NUMBERS), np.nan, "<f4")
        start = 0
        for name, width in _WIDTHS.items():
            if name in ZERO:
                numbers[:, start : start + width] = 0.0
            if name in rows:
                row = rows[name].reshape(length, -1)
                numbers[:, start : start + row.shape[1]] = row
            start += width
        sessions = b""
        if not states.is_default("session"):
            sessions = np.broadcast_to(states.sessions(length), length).astype("<u8").tobytes()
        known = self._vehicle(vehicle)
        try:
            answer = known.native.evaluate_batch(numbers.tobytes(), flags(states), sessions, surfaces)
        except self._native.InvalidState as invalid:
            raise InvalidState([Violation(*invalid.args)]) from None
        return known.forces(np.frombuffer(answer, known.rows[surfaces, states.jacobian]), np.ascontiguousarray)

    def stability(self, vehicle: str, ford: Ford, *, timeout_s: float = MAP_TIMEOUT_S) -> Stability:
        """Whether a vehicle that stands in moving water floats, slides, topples or can be steered."""
        request = messages.get_stability_request(vehicle, ford)
        _check(timeout_s)
        try:
            answer = self._vehicle(vehicle).native.stability(request.SerializeToString())
        except self._native.InvalidState as invalid:
            field, description, _ = invalid.args
            raise InvalidState([messages.violation(field, description)]) from None
        return messages.stability_of_bytes(answer, ford)

    def stream(self, vehicle: str) -> SessionStream:
        """A stream of states of one vehicle: a run of its own, whose states need no session. As fast as a call."""
        return SessionStream(self, vehicle)

    def vehicles(self, *, timeout_s: float | None = None) -> list[str]:
        """Names of the vehicles there are."""
        _check(timeout_s)
        try:
            names: list[str] = self._library.names()
        except self._native.UnreadableVehicle as error:
            raise WadeError(str(error)) from None
        return names

    def vehicle(self, name: str, *, timeout_s: float | None = None) -> Vehicle:
        """Surfaces, dimensions, mass and training domain of a vehicle, without its mesh."""
        _check(timeout_s)
        return messages.vehicle_of_bytes(self._vehicle(name).native.description())

    def close(self) -> None:
        """Drops the vehicles and their sessions. A call after it reads them again."""
        self._vehicles = {}

    def __enter__(self) -> InProcess:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _vehicle(self, name: str) -> _Vehicle:
        known = self._vehicles.get(name)
        if known is None:
            try:
                # of two threads that come first, both get the one that was there first
                known = self._vehicles.setdefault(name, _Vehicle.of(self._library.vehicle(name)))
            except self._native.UnknownVehicle as error:
                raise UnknownVehicle(name, str(error)) from None
            except self._native.UnreadableVehicle as error:
                raise WadeError(str(error)) from None
        return known


@dataclass(frozen=True, slots=True)
class _Vehicle:
    """A vehicle, and what all of its answers have in common."""

    native: wade_native.Vehicle
    #: A state's answer: with the arrays per surface or without, and with derivatives or without.
    rows: dict[tuple[bool, bool], np.dtype[Any]]
    has_added_mass: bool
    has_base: bool
    effects: tuple[Effect | int, ...]
    about_m: Array
    version: int
    provenance: str

    @classmethod
    def of(cls, native: wade_native.Vehicle) -> _Vehicle:
        kinds = [(surfaces, jacobian) for surfaces in (True, False) for jacobian in (True, False)]
        rows = {kind: np.dtype(native.columns(*kind)) for kind in kinds}
        names = rows[True, False].names or ()
        about = np.array(native.about_m, np.float32)
        about.flags.writeable = False
        return cls(
            native=native,
            rows=rows,
            has_added_mass="added_mass" in names,
            has_base="damping" in names,
            effects=tuple(named_effect(code) for code in native.effects),
            about_m=about,
            version=native.version,
            provenance=native.provenance,
        )

    def forces(self, answer: Any, array: Callable[[Any], Any]) -> Forces:
        """A row, or N of them."""

        def of_base(name: str) -> Any:
            return array(answer[name]) if self.has_base else None

        return Forces(
            force_n=array(answer["force_n"]),
            moment_nm=array(answer["moment_nm"]),
            about_m=self.about_m,
            uncertainty_n=array(answer["uncertainty_n"]),
            moment_uncertainty_nm=array(answer["moment_uncertainty_nm"]),
            surface_force_n=array(answer["surface_force_n"]),
            surface_point_m=array(answer["surface_point_m"]),
            surface_couple_nm=array(answer["surface_couple_nm"]),
            wetted_fraction=array(answer["wetted_fraction"]),
            outside=array(answer["outside"]),
            effects=self.effects,
            effect_force_n=array(answer["effect_force_n"]),
            effect_moment_nm=array(answer["effect_moment_nm"]),
            effect_left_out=answer["effect_left_out"].astype(np.uint8),
            effect_surface_force_n=array(answer["effect_surface_force_n"]),
            effects_outside=array(answer["effects_outside"]),
            added_mass=array(answer["added_mass"]) if self.has_added_mass else None,
            jacobian=array(answer["jacobian"]) if "jacobian" in answer.dtype.names else None,
            damping=of_base("damping"),
            water_level_m=of_base("water_level_m"),
            bed_clearance_m=of_base("bed_clearance_m"),
            bed=of_base("bed"),
            shaft_power_w=of_base("shaft_power_w"),
            session_begins=answer["session_begins"] != 0,
            bundle_version=self.version,
            provenance=self.provenance,
            compute_ns=int(np.sum(answer["compute_ns"])),
        )


def _as_it_is(column: Any) -> Any:
    return column


def _check(timeout_s: float | None) -> None:
    if timeout_s is not None and checked_timeout(timeout_s) == 0.0:
        raise DeadlineExceeded(0.0)


def _native() -> Any:
    try:
        import wade_native
    except ImportError as error:
        raise ImportError(f"wade.InProcess needs the compiled module wade_native ({error}); {_INSTALL}") from None
    if wade_native.VERSION != VERSION:
        raise ImportError(f"wade_native is of version {wade_native.VERSION}, this client needs {VERSION}; {_INSTALL}")
    return wade_native
