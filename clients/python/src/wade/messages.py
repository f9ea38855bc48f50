"""The messages of proto/ to and from the types of this package.

The generated messages would turn every number of an array into a Python object. On the wire a packed array of floats is
a string of bytes like any other, and one of enumerations a string of a byte each, so the messages here are those that
were generated, with each such array declared as bytes: numpy reads and writes them as they are.
"""

from __future__ import annotations

import math
from typing import Any

import grpc
import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor import FieldDescriptor, FileDescriptor
from google.protobuf.message import Message
from google.rpc import error_details_pb2, status_pb2

from .channel import Endpoint
from .errors import (
    DeadlineExceeded,
    InvalidState,
    PermissionDenied,
    Refused,
    ResourceExhausted,
    ServerUnavailable,
    Unauthenticated,
    UnknownVehicle,
    Violation,
    WadeError,
)
from .forces import BoxQuantity, Forces, Quantity, named_effect
from .latency import Latency, Percentiles
from .stability import Foot, Ford, Stability, StabilityModes
from .state import TIME_STEP_AT, TOLD_AT, VECTORS, WHEELS_END, State
from .v1 import admin_pb2, hydrodynamics_pb2
from .vehicle import ActiveEffect, EffectParameter, RegionLimit, Reloaded, Surface, Vehicle

# packed enumerations and truth values too: a value below 128 is one byte
_PACKED = (
    FieldDescriptor.TYPE_FLOAT,
    FieldDescriptor.TYPE_DOUBLE,
    FieldDescriptor.TYPE_ENUM,
    FieldDescriptor.TYPE_BOOL,
)


def _with_arrays_as_bytes(file: FileDescriptor) -> dict[str, type[Message]]:
    proto = descriptor_pb2.FileDescriptorProto()
    file.CopyToProto(proto)
    for message in proto.message_type:
        for field in message.field:
            if field.label == FieldDescriptor.LABEL_REPEATED and field.type in _PACKED:
                field.label = FieldDescriptor.LABEL_OPTIONAL
                field.type = FieldDescriptor.TYPE_BYTES
                field.ClearField("type_name")
    # a pool of its own: in the default one the names are taken by the generated messages
    pool = descriptor_pool.DescriptorPool()
    pool.Add(proto)
    classes: dict[str, type[Message]] = message_factory.GetMessageClassesForFiles([proto.name], pool)
    return classes


_SERVICES = (
    hydrodynamics_pb2.DESCRIPTOR.services_by_name["Hydrodynamics"],
    admin_pb2.DESCRIPTOR.services_by_name["Admin"],
)
_PACKAGE = hydrodynamics_pb2.DESCRIPTOR.package
_MESSAGES = _with_arrays_as_bytes(hydrodynamics_pb2.DESCRIPTOR) | _with_arrays_as_bytes(admin_pb2.DESCRIPTOR)


def _new(name: str, **fields: Any) -> Any:
    return _MESSAGES[f"{_PACKAGE}.{name}"](**fields)


def calls(channel: Any) -> dict[str, Any]:
    """The methods of the services by name, on a channel of `grpc` or of `grpc.aio`."""
    kinds = {(False, False): "unary_unary", (True, True): "stream_stream"}
    return {
        method.name: getattr(channel, kinds[method.client_streaming, method.server_streaming])(
            f"/{service.full_name}/{method.name}",
            request_serializer=_MESSAGES[method.input_type.full_name].SerializeToString,
            response_deserializer=_MESSAGES[method.output_type.full_name].FromString,
        )
        for service in _SERVICES
        for method in service.methods
    }


def evaluate_request(vehicle: str, state: State) -> Message:
    """A single state; raises `InvalidState` for a wrong shape and for a session."""
    values = state.floats()
    _without_session(state)
    request = _new("EvaluateRequest", vehicle=vehicle)
    message = request.state
    if state.depth_m is not None:
        message.depth_m = values[0]
    message.ground_contact = state.ground_contact
    if not state.is_default("density_kgpm3"):
        message.density_kgpm3 = values[1]
    for i, name in enumerate(VECTORS):
        if not state.is_default(name):
            vector = getattr(message, name)
            vector.x, vector.y, vector.z = values[2 + 3 * i : 5 + 3 * i]
    told = values[TOLD_AT:TIME_STEP_AT]
    (heading, rate, *wheels), (water_level, bed_clearance, bed, *moving) = told[:WHEELS_END], told[WHEELS_END:]
    if state.water_level_m is not None:
        message.water_level_m = water_level
    if state.bed_clearance_m is not None:
        message.bed_clearance_m = bed_clearance
    if state.bed is not None:
        message.bed = bed
    if state.physics is not None:
        message.physics = state.physics
    if state.heading_rad is not None:
        message.heading_rad = heading
    if state.depth_rate_mps is not None:
        message.depth_rate_mps = rate
    if state.wheel_speed_radps is not None:
        message.wheel_speed_radps = _of_wheels(wheels)
    _set_moving(message, state, moving)
    if values[TIME_STEP_AT] != 0.0:
        message.time_step_s = values[TIME_STEP_AT]
    if state.implicit_added_mass:
        message.implicit_added_mass = True
    if state.jacobian:
        message.jacobian = True
    return request


def _of_wheels(values: list[float]) -> bytes:
    with np.errstate(over="ignore"):
        return np.array([value for value in values if not math.isnan(value)], "<f4").tobytes()


def _set_moving(message: Any, state: State, moving: list[float]) -> None:
    """Sets how the water moves beside its current."""
    kx, ky, kz, amplitude, phase, *levels, exponent = moving
    if state.has_wave():
        message.wave_vector_radpm.x, message.wave_vector_radpm.y, message.wave_vector_radpm.z = kx, ky, kz
        message.wave_amplitude_m, message.wave_phase_rad = amplitude, phase
    if state.wheel_water_level_m is not None:
        message.wheel_water_level_m = _of_wheels(levels)
    if state.current_exponent is not None:
        message.current_exponent = exponent


def evaluate_batch_request(vehicle: str, states: State, surfaces: bool) -> tuple[Message, int]:
    """A batch and its length; raises `InvalidState` for a wrong shape, and for a session and its time step."""
    rows = states.rows()
    _without_session(states)
    if rows.pop("time_step_s").any():
        raise InvalidState([Violation("time_step_s", _NO_SESSION.format("time_step_s"))])
    arrays = {
        name: row.astype("<f4", copy=False).tobytes() for name, row in rows.items() if not states.is_default(name)
    }
    request = _new(
        "EvaluateBatchRequest",
        vehicle=vehicle,
        ground_contact=states.ground_contact,
        omit_surfaces=not surfaces,
        implicit_added_mass=states.implicit_added_mass,
        physics=states.physics or 0,
        jacobian=states.jacobian,
        **arrays,
    )
    return request, states.length(rows)


_NO_SESSION = "{} must be left out: over gRPC a stream is a run of states, and there is no other; or use shared memory"


def _without_session(state: State) -> None:
    if not state.is_default("session") and np.any(np.asarray(state.session)):
        raise InvalidState([Violation("session", _NO_SESSION.format("session"))])


def list_vehicles_request() -> Message:
    """Asks for the vehicles that are served."""
    return _new("ListVehiclesRequest")


def get_vehicle_request(vehicle: str, mesh: bool) -> Message:
    """Asks for all about one vehicle."""
    return _new("GetVehicleRequest", vehicle=vehicle, include_mesh=mesh)


def get_stability_request(vehicle: str, ford: Ford) -> Message:
    """Asks how a vehicle stands at each pair of a depth and a speed."""
    request = _new(
        "GetStabilityRequest",
        vehicle=vehicle,
        depth_m=np.ravel(ford.depth_m).astype("<f4").tobytes(),
        speed_mps=np.ravel(ford.speed_mps).astype("<f4").tobytes(),
        heading_rad=ford.heading_rad,
        density_kgpm3=ford.density_kgpm3,
        ground_contact=ford.ground_contact,
        bed=ford.bed,
        normal_forces=ford.normal_forces,
    )
    if ford.friction is not None:
        request.friction_min, request.friction_max = np.broadcast_to(ford.friction, 2)
    request.roll_pitch.roll_rad, request.roll_pitch.pitch_rad = ford.roll_pitch_rad
    return request


def get_latency_request() -> Message:
    """Asks for percentiles."""
    return _new("GetLatencyRequest")


def reload_request(vehicle: str) -> Message:
    """Asks an administrator's favor: empty is every vehicle."""
    return _new("ReloadRequest", vehicle=vehicle)


def forces(response: Any, session_begins: bool = False) -> Forces:
    """The answer to a single state."""
    wrench = response.wrench
    deviations = (response.uncertainty_n, response.moment_uncertainty_nm)
    net = _vectors((wrench.force_n, wrench.moment_nm, wrench.about_m, *deviations))
    base = response.base if response.HasField("base") else None
    return Forces(
        force_n=net[0],
        moment_nm=net[1],
        about_m=net[2],
        uncertainty_n=net[3],
        moment_uncertainty_nm=net[4],
        surface_force_n=_floats(response.surface_force_n, -1, 3),
        surface_point_m=_floats(response.surface_point_m, -1, 3),
        surface_couple_nm=_floats(response.surface_couple_nm, -1, 3),
        wetted_fraction=_floats(response.wetted_fraction, -1),
        outside=_outside(response.outside, 1, len(Quantity))[0],
        effects=tuple(named_effect(load.effect) for load in response.effects),
        effect_force_n=_vectors([load.force_n for load in response.effects]),
        effect_moment_nm=_vectors([load.moment_nm for load in response.effects]),
        effect_left_out=np.array([load.left_out for load in response.effects], np.uint8),
        effect_surface_force_n=_floats(response.effect_surface_force_n, -1, 3),
        effects_outside=_outside(response.effects_outside, 1, len(BoxQuantity))[0],
        added_mass=_floats(response.added_mass, 6, 6) if response.added_mass else None,
        jacobian=_floats(response.jacobian, 6, 11) if response.jacobian else None,
        damping=_floats(base.damping, 6, 6) if base else None,
        water_level_m=np.array(base.water_level_m, np.float32) if base else None,
        bed_clearance_m=np.array(base.bed_clearance_m, np.float32) if base else None,
        bed=np.array(base.bed, np.float32) if base else None,
        shaft_power_w=np.array(base.shaft_power_w, np.float32) if base else None,
        session_begins=np.bool_(session_begins),
        bundle_version=response.bundle_version,
        provenance=response.provenance,
        compute_ns=response.compute_ns,
    )


def batch_forces(response: Any, length: int) -> Forces:
    """The answer to a batch of this length."""
    wetted = _floats(response.wetted_fraction, length, len(response.wetted_fraction) // (4 * length))
    effects = len(response.effects)
    couples = wetted.shape[1] if response.surface_couple_nm else 0
    base = list(response.base)

    def of_base(name: str) -> np.ndarray | None:
        return np.array([getattr(one, name) for one in base], np.float32) if base else None

    moved = _floats(response.effect_surface_force_n, length, len(response.effect_surface_force_n) // (12 * length), 3)
    return Forces(
        force_n=_floats(response.force_n, length, 3),
        moment_nm=_floats(response.moment_nm, length, 3),
        about_m=_vector(response.about_m),
        uncertainty_n=_floats(response.uncertainty_n, length, 3),
        moment_uncertainty_nm=_floats(response.moment_uncertainty_nm, length, 3),
        surface_force_n=_floats(response.surface_force_n, *wetted.shape, 3),
        surface_point_m=_floats(response.surface_point_m, *wetted.shape, 3),
        surface_couple_nm=_floats(response.surface_couple_nm, length, couples, 3),
        wetted_fraction=wetted,
        outside=_outside(response.outside, length, len(Quantity)),
        # packed enumerations: a byte each
        effects=tuple(named_effect(code) for code in response.effects),
        effect_force_n=_floats(response.effect_force_n, length, effects, 3),
        effect_moment_nm=_floats(response.effect_moment_nm, length, effects, 3),
        effect_left_out=np.frombuffer(response.effect_left_out, np.uint8).reshape(length, effects),
        effect_surface_force_n=moved,
        effects_outside=_outside(response.effects_outside, length, len(BoxQuantity)),
        added_mass=_floats(response.added_mass, length, 6, 6) if response.added_mass else None,
        jacobian=_floats(response.jacobian, length, 6, 11) if response.jacobian else None,
        damping=_floats(b"".join(one.damping for one in base), length, 6, 6) if base else None,
        water_level_m=of_base("water_level_m"),
        bed_clearance_m=of_base("bed_clearance_m"),
        bed=of_base("bed"),
        shaft_power_w=of_base("shaft_power_w"),
        session_begins=np.zeros(length, bool),
        bundle_version=response.bundle_version,
        provenance=response.provenance,
        compute_ns=response.compute_ns,
    )


def _floats(data: bytes, *shape: int) -> np.ndarray:
    return np.frombuffer(data, "<f4").reshape(shape)


def _vector(v: Any) -> np.ndarray:
    return np.array((v.x, v.y, v.z), np.float32)


def _vectors(vectors: Any) -> np.ndarray:
    return np.array([(v.x, v.y, v.z) for v in vectors], np.float32).reshape(-1, 3)


def _outside(found: Any, length: int, quantities: int) -> np.ndarray:
    dense = np.zeros((length, quantities), np.float32)
    if found:
        # on the wire 0 stands for no quantity
        columns = np.array([outside.quantity for outside in found]) - 1
        if columns.max() >= dense.shape[1]:
            # a quantity of a newer server: it must not pass for being inside
            dense = np.zeros((length, columns.max() + 1), np.float32)
        dense[[outside.index for outside in found], columns] = [outside.excess for outside in found]
    return dense


def vehicle(response: Any) -> Vehicle:
    """All about one vehicle."""
    summary = response.summary
    known = {int(quantity) + 1: quantity for quantity in Quantity}
    boxed = {int(quantity) + 1: quantity for quantity in BoxQuantity}
    return Vehicle(
        name=summary.name,
        bundle_version=summary.bundle_version,
        provenance=summary.provenance,
        length_m=response.length_m,
        width_m=response.width_m,
        height_m=response.height_m,
        z0_m=response.z0_m,
        mass_kg=response.mass_kg,
        center_of_mass_m=_vector(response.center_of_mass_m),
        inertia_kgm2=np.frombuffer(response.inertia_kgm2, "<f8").reshape(3, 3),
        surfaces=tuple(
            Surface(s.name, s.kind, _vector(s.centroid_m), _vector(s.normal), s.area_m2) for s in response.surfaces
        ),
        domain={known[r.quantity]: (r.minimum, r.maximum) for r in response.domain if r.quantity in known},
        effects=tuple(_active_effect(effect) for effect in response.effects),
        effects_validity={
            boxed[r.quantity]: (r.minimum, r.maximum) for r in response.effects_validity if r.quantity in boxed
        },
        mesh_stl=response.mesh_stl,
        face_surface=np.array(response.face_surface, np.int64),
    )


def _active_effect(effect: Any) -> ActiveEffect:
    return ActiveEffect(
        effect=named_effect(effect.effect),
        name=effect.name,
        equation=effect.equation,
        parameters=tuple(EffectParameter(p.name, p.value, p.std, p.unit) for p in effect.parameters),
        provisional=effect.provisional,
        region=tuple(_region_limit(limit) for limit in effect.region),
    )


def _region_limit(limit: Any) -> RegionLimit:
    def border(numbers: Any) -> tuple[float, float] | None:
        return (numbers[0], numbers[1]) if len(numbers) == 2 else None

    return RegionLimit(limit.quantity, limit.unit, border(limit.above), border(limit.at_most))


def stability(response: Any, ford: Ford) -> Stability:
    """How a vehicle stands at each pair of a depth and a speed."""
    shape = ford.shape

    def modes(modes: Any) -> StabilityModes:
        return StabilityModes(
            floats=_floats(modes.floats, *shape),
            slides=_floats(modes.slides, *shape),
            topples=_floats(modes.topples, *shape),
            steers=_floats(modes.steers, *shape) if modes.steers else None,
        )

    forces = response.normal_force_n
    return Stability(
        probability=modes(response.probability),
        margin=modes(response.margin),
        friction_needed=_floats(response.friction_needed, *shape),
        normal_force_n=_floats(forces, *shape, len(response.feet)) if forces else None,
        feet=tuple(Foot(foot.surface, foot.x_m, foot.y_m) for foot in response.feet),
        in_domain=np.frombuffer(response.in_domain, np.bool_).reshape(shape),
        friction=(response.friction_min, response.friction_max),
        bundle_version=response.bundle_version,
        provenance=response.provenance,
        compute_ns=response.compute_ns,
    )


def vehicle_of_bytes(data: bytes) -> Vehicle:
    """The same as `vehicle` of a message as it travels."""
    return vehicle(_MESSAGES[f"{_PACKAGE}.GetVehicleResponse"].FromString(data))


def stability_of_bytes(data: bytes, ford: Ford) -> Stability:
    """The same of a message as it travels."""
    return stability(_MESSAGES[f"{_PACKAGE}.GetStabilityResponse"].FromString(data), ford)


def latencies(response: Any) -> tuple[Latency, ...]:
    """Percentiles of each transport and vehicle."""

    def percentiles(p: Any) -> Percentiles:
        return Percentiles(p.count, p.p50_us, p.p95_us, p.p99_us, p.p99_9_us, p.max_us)

    return tuple(
        Latency(at.transport, at.vehicle, percentiles(at.since_start), percentiles(at.window), response.window_s)
        for at in response.latencies
    )


def reloaded(response: Any) -> tuple[Reloaded, ...]:
    """What each bundle came to."""
    return tuple(Reloaded(found.vehicle, found.bundle_version, found.refusal) for found in response.vehicles)


def error(failure: Any, endpoint: Endpoint, timeout_s: float) -> WadeError:
    """The error that a failed call stands for, with what the server attached to it."""
    code, message = failure.code(), failure.details() or ""
    if code is grpc.StatusCode.UNAVAILABLE:
        return ServerUnavailable(endpoint.address, endpoint.explained(message))
    if code is grpc.StatusCode.OK:
        return ServerUnavailable(endpoint.address, "the server ended the stream")
    if code is grpc.StatusCode.UNAUTHENTICATED:
        return Unauthenticated(message)
    if code is grpc.StatusCode.PERMISSION_DENIED:
        return PermissionDenied(message)
    if code is grpc.StatusCode.DEADLINE_EXCEEDED:
        return DeadlineExceeded(timeout_s)
    for detail in _details(failure):
        if isinstance(detail, error_details_pb2.BadRequest):
            return InvalidState([violation(v.field, v.description) for v in detail.field_violations])
        if isinstance(detail, error_details_pb2.ResourceInfo) and code is grpc.StatusCode.NOT_FOUND:
            return UnknownVehicle(detail.resource_name, message)
        if isinstance(detail, error_details_pb2.RetryInfo) and code is grpc.StatusCode.RESOURCE_EXHAUSTED:
            return ResourceExhausted(message, detail.retry_delay.ToTimedelta().total_seconds())
    if code is grpc.StatusCode.RESOURCE_EXHAUSTED:
        return ResourceExhausted(message, None)
    return Refused(code.name, message)


def _details(failure: Any) -> list[Message]:
    metadata = dict(failure.trailing_metadata() or ())
    status = status_pb2.Status.FromString(metadata.get("grpc-status-details-bin", b""))
    found = []
    for kind in (error_details_pb2.BadRequest, error_details_pb2.ResourceInfo, error_details_pb2.RetryInfo):
        for packed in status.details:
            detail = kind()
            if packed.Unpack(detail):
                found.append(detail)
    return found


def violation(field: str, description: str) -> Violation:
    """A field in the words of the server: `state.depth_m` of a single state, `depth_m[3]` of the fourth of a batch."""
    name, _, index = field.removeprefix("state.").rstrip("]").partition("[")
    return Violation(name, description, int(index) if index else None)
