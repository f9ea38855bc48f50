"""The client over shared memory, for programs of the server's user on the server's machine. Linux.

iceoryx2 does not tell a client that its server was killed, so that every wait here has its own end, and a wait that
ends without an answer gives up the ports: the next call opens new ones and finds a server that was restarted.
"""

from __future__ import annotations

import ctypes
import math
import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal, TypeVar

import numpy as np

from . import messages
from . import shm_layout as layout
from .client import DEFAULT_TIMEOUT_S, check_query, checked_timeout
from .errors import DeadlineExceeded, InvalidState, Refused, ResourceExhausted, ServerUnavailable, Violation
from .forces import Array, BoxQuantity, Effect, Forces, Quantity, named_effect
from .local import SessionStream, flags, session_numbers
from .shm_link import BATCH, JACOBIAN, SINGLE, VEHICLE, Link, Lost, Service, memory, vehicles
from .state import LEVELS_AT, PER_WHEEL, TOLD_AT, WHEELS_END, State
from .vehicle import Vehicle

_T = TypeVar("_T")


class ShmClient:
    """Asks the server of a namespace (`shm.namespace` in its settings); connects with the first call.

    `wait` is "block", which sleeps until the server wakes it, or "spin", which polls without pause: faster by the time
    it takes to wake up, for the price of a core. Several threads may share a client, one call at a time. It must not be
    used in a child that was forked after its first call.
    """

    def __init__(
        self,
        namespace: str = "wade",
        *,
        wait: Literal["block", "spin"] = "block",
        timeout_s: float = DEFAULT_TIMEOUT_S,
    ):
        if wait not in ("block", "spin"):
            raise ValueError(f'wait must be "block" or "spin", got {wait!r}')
        self.namespace = namespace
        self._blocks = wait == "block"
        self._timeout_s = checked_timeout(timeout_s)
        self._lock = threading.Lock()
        self._link: Link | None = None
        self._sequence = 0
        # its sessions are the same on the services with derivatives and without
        self._owner = secrets.randbits(63) + 1
        self._sessions = session_numbers()

    def evaluate(self, vehicle: str, state: State, *, timeout_s: float | None = None) -> Forces:
        """The forces on one vehicle in one state."""
        check_query(vehicle, state)
        return self._evaluate(vehicle, state, state.sessions(None), timeout_s)

    def _evaluate(self, vehicle: str, state: State, session: int, timeout_s: float | None) -> Forces:
        timeout_s, end = self._end(timeout_s)
        floats, flagged = state.floats(), flags(state)

        def write(address: int, wake_key: int) -> None:
            who = self._sequence, wake_key, session, flagged
            ctypes.memmove(address, _query(who, floats, self._owner), layout.QUERY.itemsize)

        service, dtype = (JACOBIAN, layout.JACOBIAN_ANSWER) if state.jacobian else (SINGLE, layout.ANSWER)
        with self._lock:
            page = self._exchange(vehicle, service, write, lambda address: _read(address, dtype), end, timeout_s)
        answer, jacobian = (page["answer"], page["jacobian"]) if state.jacobian else (page, None)
        _check(answer["status"], answer, None, _wheels(floats))
        return _forces(answer, jacobian)

    def evaluate_batch(
        self, vehicle: str, states: State, *, surfaces: bool = True, timeout_s: float | None = None
    ) -> Forces:
        """The forces in N states of one vehicle, which travel 256 at a time, and alone with derivatives."""
        check_query(vehicle, states)
        timeout_s, end = self._end(timeout_s)
        rows, flagged = states.rows(), flags(states)
        length = states.length(rows)
        sessions = np.broadcast_to(states.sessions(length), length)
        wheels = {name: rows[name].shape[1] for name in PER_WHEEL if name in rows}
        with self._lock:
            forces: Forces | None = None
            start = 0
            while start < length:
                chunk = slice(start, min(start + (1 if states.jacobian else layout.MAX_BATCH), length))

                def write(address: int, wake_key: int, chunk: slice = chunk) -> None:
                    write = _write_row if states.jacobian else _write_batch
                    who = self._sequence, wake_key, self._owner
                    write(address, who, flagged, sessions, rows, chunk)

                def read(address: int, forces: Forces | None = forces, chunk: slice = chunk) -> Forces:
                    read = _read_row if states.jacobian else _read_batch
                    return read(address, forces, length, chunk, surfaces, wheels)

                service = JACOBIAN if states.jacobian else BATCH
                answered = self._exchange(vehicle, service, write, read, end, timeout_s)
                if forces is not None and answered is not forces:
                    # a bundle that was exchanged on the way would mix two versions in one answer: from the start again,
                    # without moving on those runs that have moved
                    moved = np.arange(length) < chunk.stop
                    rows["time_step_s"] = np.where(moved, np.float32(0.0), rows["time_step_s"])
                    forces, start = None, 0
                else:
                    forces, start = answered, chunk.stop
        assert forces is not None, "rows() refuses an empty batch"
        return forces

    def stream(self, vehicle: str) -> SessionStream:
        """A stream of states of one vehicle: a run of its own, whose states need no session. As fast as a call."""
        return SessionStream(self, vehicle)

    def vehicles(self, *, timeout_s: float | None = None) -> list[str]:
        """Names of the vehicles that are served. This asks the system, not the server, and does not wait."""
        self._end(timeout_s)
        return vehicles(self.namespace)

    def vehicle(self, name: str, *, timeout_s: float | None = None) -> Vehicle:
        """Surfaces, dimensions, mass and training domain of a vehicle, without its mesh."""
        timeout_s, end = self._end(timeout_s)

        def write(address: int, wake_key: int) -> None:
            query = np.frombuffer(memory(address, layout.QUERY.itemsize), layout.QUERY)
            query[...] = layout.UNSET_QUERY
            query["sequence"], query["wake_key"], query["owner"] = self._sequence, wake_key, self._owner

        with self._lock:
            return messages.vehicle_of_bytes(self._exchange(name, VEHICLE, write, _read_description, end, timeout_s))

    def close(self) -> None:
        """Gives up the ports. A call after it opens new ones."""
        with self._lock:
            self._link = None

    def __enter__(self) -> ShmClient:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _end(self, timeout_s: float | None) -> tuple[float, float]:
        timeout_s = self._timeout_s if timeout_s is None else checked_timeout(timeout_s)
        return timeout_s, time.monotonic() + timeout_s

    def _exchange(
        self,
        vehicle: str,
        service: Service,
        write: Callable[[int, int], None],
        read: Callable[[int], _T],
        end: float,
        timeout_s: float,
    ) -> _T:
        """One request, written by `write` (address, wake key), and what `read` (address) makes of the response."""
        if time.monotonic() >= end:
            raise DeadlineExceeded(timeout_s)
        self._sequence += 1
        try:
            try:
                response = self._connected().exchange(vehicle, service, write, end, timeout_s)
            except Lost:
                # a server that was restarted is found by new ports
                self._link = None
                response = self._connected().exchange(vehicle, service, write, end, timeout_s)
        except Lost:
            link, self._link = self._connected(), None
            raise link.why_not(vehicle) from None
        except (DeadlineExceeded, ServerUnavailable):
            self._link = None
            raise
        return read(response.payload_ptr)

    def _connected(self) -> Link:
        if self._link is None:
            self._link = Link(self.namespace, self._blocks)
        return self._link


_PER_ROW = {
    "water_level_m": layout.HAS_WATER_LEVEL,
    "bed_clearance_m": layout.HAS_BED_CLEARANCE,
    "bed": layout.HAS_BED,
}


def _query(who: tuple[int, int, int, int], floats: list[float], owner: int) -> bytes:
    # in the order of the layout
    stated, told = floats[:TOLD_AT], floats[TOLD_AT:]
    (heading, depth_rate, *wheels), (level, clearance, bed, *wave) = told[:WHEELS_END], told[WHEELS_END:LEVELS_AT]
    *levels, exponent, time_step = told[LEVELS_AT:]
    values = (*stated, time_step, heading, depth_rate, level, clearance, bed, *wheels, *levels)
    moving = (*wave, exponent)
    try:
        return layout.QUERY_STRUCT.pack(*who, *values, owner, *moving)
    except OverflowError:
        # beyond single precision: infinite, which the server refuses and names
        limit = float(np.finfo(np.float32).max)
        values, moving = (
            tuple(math.copysign(math.inf, x) if abs(x) > limit else x for x in part) for part in (values, moving)
        )
        return layout.QUERY_STRUCT.pack(*who, *values, owner, *moving)


def _read(address: int, dtype: np.dtype[Any]) -> np.void:
    page: np.void = np.frombuffer(ctypes.string_at(address, dtype.itemsize), dtype)[0]
    return page


def _read_description(address: int) -> bytes:
    answer = np.frombuffer(memory(address, layout.VEHICLE_ANSWER.itemsize), layout.VEHICLE_ANSWER)[0]
    if answer["status"] == layout.STATUS_TOO_LONG:
        raise ResourceExhausted("the description has no room in shared memory; gRPC gives it", None)
    description: bytes = answer["description"][: int(answer["len"])].tobytes()
    return description


def _write_batch(
    address: int, who: tuple[int, int, int], flags: int, sessions: Any, rows: dict[str, Array], chunk: slice
) -> None:
    batch = np.frombuffer(memory(address, layout.BATCH_QUERY.itemsize), layout.BATCH_QUERY)[0]
    count = chunk.stop - chunk.start
    header, queries = batch["header"], batch["queries"][:count]
    header["sequence"], header["wake_key"], _ = who
    header["flags"], header["count"] = 0, count
    _write_queries(queries, flags, sessions, rows, chunk)


def _write_row(
    address: int, who: tuple[int, int, int], flags: int, sessions: Any, rows: dict[str, Array], chunk: slice
) -> None:
    query = np.frombuffer(memory(address, layout.QUERY.itemsize), layout.QUERY)
    _write_queries(query, flags, sessions, rows, chunk)
    query["sequence"], query["wake_key"], query["owner"] = who


def _write_queries(queries: Any, flags: int, sessions: Any, rows: dict[str, Array], chunk: slice) -> None:
    # the place holds what an earlier batch left
    queries[...] = layout.UNSET_QUERY
    queries["session"] = sessions[chunk]
    queries["flags"] = flags
    for name, flag in _PER_ROW.items():
        if name in rows:
            # of a row of a batch NaN says that it states none
            queries["flags"] &= ~np.where(np.isnan(rows[name][chunk]), flag, 0).astype(np.uint64)
    for name, array in rows.items():
        place = queries[name][:, : array.shape[1]] if name in PER_WHEEL else queries[name]
        place[...] = array[chunk]


def _forces(answer: np.void, jacobian: Array | None) -> Forces:
    surfaces, flags = answer["surfaces"][: _surface_count(answer)], int(answer["flags"])
    has_base = flags & layout.HAS_DAMPING != 0
    effects, effect_force, effect_moment, left_out, effect_surface_force, effects_outside = _effects(answer, surfaces)
    return Forces(
        force_n=answer["force_n"],
        moment_nm=answer["moment_nm"],
        about_m=answer["about_m"],
        uncertainty_n=answer["force_deviation_n"],
        moment_uncertainty_nm=answer["moment_deviation_nm"],
        surface_force_n=surfaces["force_n"],
        surface_point_m=surfaces["point_m"],
        surface_couple_nm=surfaces["couple_nm"] if has_base else _NO_VECTORS,
        wetted_fraction=surfaces["wetted_fraction"],
        outside=answer["outside"][:_QUANTITIES],
        effects=effects,
        effect_force_n=effect_force,
        effect_moment_nm=effect_moment,
        effect_left_out=left_out,
        effect_surface_force_n=effect_surface_force,
        effects_outside=effects_outside,
        added_mass=answer["added_mass"].reshape(6, 6) if flags & layout.HAS_ADDED_MASS else None,
        jacobian=None if jacobian is None else jacobian.reshape(6, layout.JACOBIAN_COLUMNS),
        damping=answer["damping"].reshape(6, 6) if has_base else None,
        water_level_m=answer["water_level_m"] if has_base else None,
        bed_clearance_m=answer["bed_clearance_m"] if has_base else None,
        bed=answer["bed"] if has_base else None,
        shaft_power_w=answer["shaft_power_w"] if flags & layout.HAS_SHAFT_POWER else None,
        session_begins=_YES if flags & layout.SESSION_BEGINS else _NO,
        bundle_version=int(answer["bundle_version"]),
        provenance=answer["provenance"].decode(errors="ignore"),
        compute_ns=int(answer["compute_ns"]),
    )


_YES, _NO = np.True_, np.False_
_QUANTITIES, _BOX_QUANTITIES = len(Quantity), len(BoxQuantity)
_NO_VECTORS = np.empty((0, 3), np.float32)
_NO_BOX = np.zeros(_BOX_QUANTITIES, np.float32)
_NO_EFFECTS: tuple[Any, ...] = ((), _NO_VECTORS, _NO_VECTORS, np.empty(0, np.uint8), _NO_VECTORS, _NO_BOX)


def _effects(answer: np.void, surfaces: Any) -> tuple[Any, ...]:
    """Names, forces, moments, why left out, shares on surfaces, distance from the box."""
    effects = answer["effects"][: _effect_count(answer)]
    if not len(effects):
        return _NO_EFFECTS
    left_out, box = effects["left_out"].astype(np.uint8), answer["effects_outside"][:_BOX_QUANTITIES]
    return _named(effects), effects["force_n"], effects["moment_nm"], left_out, surfaces["effect_force_n"], box


def _read_batch(
    address: int, forces: Forces | None, length: int, chunk: slice, with_surfaces: bool, wheels: dict[str, int]
) -> Forces:
    """Adds the answers to a chunk to those before it, or to new forces where there are none of this bundle."""
    batch = np.frombuffer(memory(address, layout.BATCH_ANSWER.itemsize), layout.BATCH_ANSWER)[0]
    index = int(batch["index"]) % layout.MAX_BATCH
    _check(batch["status"], batch["answers"][index], chunk.start + index, wheels)
    return _read_answers(batch["answers"], int(batch["compute_ns"]), forces, length, chunk, with_surfaces)


def _read_row(
    address: int, forces: Forces | None, length: int, chunk: slice, with_surfaces: bool, wheels: dict[str, int]
) -> Forces:
    page = np.frombuffer(memory(address, layout.JACOBIAN_ANSWER.itemsize), layout.JACOBIAN_ANSWER)
    answer = page["answer"]
    _check(answer["status"][0], answer[0], chunk.start, wheels)
    read = _read_answers(answer, int(answer["compute_ns"][0]), forces, length, chunk, with_surfaces)
    if read.jacobian is None:
        read = replace(read, jacobian=np.empty((length, 6, layout.JACOBIAN_COLUMNS), np.float32))
    assert read.jacobian is not None
    read.jacobian[chunk] = page["jacobian"].reshape(1, 6, -1)
    return read


def _read_answers(
    answers: Any, compute_ns: int, forces: Forces | None, length: int, chunk: slice, with_surfaces: bool
) -> Forces:
    answers = answers[: chunk.stop - chunk.start]
    if forces is None or forces.bundle_version != answers[0]["bundle_version"]:
        forces = _empty(answers[0], length, _surface_count(answers[0]) if with_surfaces else 0)
    forces.force_n[chunk], forces.moment_nm[chunk] = answers["force_n"], answers["moment_nm"]
    forces.uncertainty_n[chunk] = answers["force_deviation_n"]
    forces.moment_uncertainty_nm[chunk] = answers["moment_deviation_nm"]
    forces.outside[chunk] = answers["outside"][:, :_QUANTITIES]
    count = forces.wetted_fraction.shape[1]
    if count:
        surfaces = answers["surfaces"][:, :count]
        forces.surface_force_n[chunk], forces.surface_point_m[chunk] = surfaces["force_n"], surfaces["point_m"]
        forces.wetted_fraction[chunk] = surfaces["wetted_fraction"]
        if forces.surface_couple_nm.shape[1]:
            forces.surface_couple_nm[chunk] = surfaces["couple_nm"]
    for matrix, name in ((forces.added_mass, "added_mass"), (forces.damping, "damping")):
        if matrix is not None:
            matrix[chunk] = answers[name].reshape(-1, 6, 6)
    for name in ("water_level_m", "bed_clearance_m", "bed", "shaft_power_w"):
        if (values := getattr(forces, name)) is not None:
            values[chunk] = answers[name]
    _read_effects(answers, forces, chunk)
    np.asarray(forces.session_begins)[chunk] = answers["flags"] & layout.SESSION_BEGINS != 0
    forces.compute_ns += compute_ns
    return forces


def _read_effects(answers: Any, forces: Forces, chunk: slice) -> None:
    if not forces.effects:
        return
    effects = answers["effects"][:, : len(forces.effects)]
    forces.effect_force_n[chunk] = effects["force_n"]
    forces.effect_moment_nm[chunk] = effects["moment_nm"]
    forces.effect_left_out[chunk] = effects["left_out"]
    forces.effects_outside[chunk] = answers["effects_outside"][:, :_BOX_QUANTITIES]
    surfaces = forces.effect_surface_force_n.shape[1]
    forces.effect_surface_force_n[chunk] = answers["surfaces"]["effect_force_n"][:, :surfaces]


def _empty(answer: np.void, length: int, surfaces: int) -> Forces:
    def array(*shape: int) -> Array:
        return np.empty((length, *shape), np.float32)

    effects, flags = _named(answer["effects"][: _effect_count(answer)]), int(answer["flags"])
    has_base = flags & layout.HAS_DAMPING != 0
    return Forces(
        force_n=array(3),
        moment_nm=array(3),
        about_m=answer["about_m"].copy(),
        uncertainty_n=array(3),
        moment_uncertainty_nm=array(3),
        surface_force_n=array(surfaces, 3),
        surface_point_m=array(surfaces, 3),
        surface_couple_nm=array(surfaces if has_base else 0, 3),
        wetted_fraction=array(surfaces),
        outside=array(_QUANTITIES),
        effects=effects,
        effect_force_n=array(len(effects), 3),
        effect_moment_nm=array(len(effects), 3),
        effect_left_out=np.empty((length, len(effects)), np.uint8),
        effect_surface_force_n=array(surfaces if effects else 0, 3),
        effects_outside=np.zeros((length, _BOX_QUANTITIES), np.float32),
        added_mass=array(6, 6) if flags & layout.HAS_ADDED_MASS else None,
        jacobian=None,
        damping=array(6, 6) if has_base else None,
        water_level_m=array() if has_base else None,
        bed_clearance_m=array() if has_base else None,
        bed=array() if has_base else None,
        shaft_power_w=array() if flags & layout.HAS_SHAFT_POWER else None,
        session_begins=np.empty(length, bool),
        bundle_version=int(answer["bundle_version"]),
        provenance=answer["provenance"].decode(errors="ignore"),
        compute_ns=0,
    )


def _named(effects: Any) -> tuple[Effect | int, ...]:
    return tuple(named_effect(int(code)) for code in effects["effect"])


def _effect_count(answer: np.void) -> int:
    return min(int(answer["effect_count"]), layout.MAX_EFFECTS)


def _surface_count(answer: np.void) -> int:
    return min(int(answer["surface_count"]), layout.MAX_SURFACES)


def _wheels(floats: list[float]) -> dict[str, int]:
    """How many values of wheels a state has, by field."""
    told = floats[TOLD_AT:]
    values = told[2:WHEELS_END], told[LEVELS_AT : LEVELS_AT + layout.MAX_WHEELS]
    counts = (sum(not math.isnan(value) for value in of_wheels) for of_wheels in values)
    return dict(zip(PER_WHEEL, counts, strict=True))


def _check(status: int, answer: np.void, index: int | None, wheels: dict[str, int]) -> None:
    if status == layout.STATUS_OK:
        return
    field = layout.FIELDS.get(int(answer["field"]))
    problem = layout.PROBLEMS.get(int(answer["problem"]))
    counts = answer["problem"] == layout.PROBLEM_COUNT and answer["flags"] & layout.HAS_WHEEL_COUNT
    if field in PER_WHEEL and counts:
        # the names of the wheels are not in this page
        count = wheels.get(field, 0)
        given = "1 value" if count == 1 else f"{count} values"
        there = {0: "no wheels", 1: "1 wheel"}.get(int(answer["wheel_count"]), f"{answer['wheel_count']} wheels")
        problem = f"has {given}, and the vehicle has {there}"
    if status == layout.STATUS_INVALID_STATE and field and problem:
        at = "" if index is None else f" (state {index} of the batch)"
        raise InvalidState([Violation(field, f"{field} {problem}{at}", index)])
    raise Refused(f"status {status}", "this client does not know it; is it of the server's version?")
