"""The messages of proto/ to and from the types of this package.

The generated messages would turn every number of an array into a Python object. On the wire a packed array of floats is
a string of bytes like any other, so the messages here are the generated ones with each such array declared as bytes:
numpy reads and writes them as they are.
"""

from __future__ import annotations

from typing import Any

import grpc
import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.descriptor import FieldDescriptor, FileDescriptor
from google.protobuf.message import Message
from google.rpc import error_details_pb2, status_pb2

from .errors import (
    DeadlineExceeded,
    InvalidState,
    Refused,
    ResourceExhausted,
    ServerUnavailable,
    UnknownVehicle,
    Violation,
    WadeError,
)
from .forces import Forces, Quantity
from .state import VECTORS, State
from .v1 import hydrodynamics_pb2
from .vehicle import Surface, Vehicle

_FLOATS = (FieldDescriptor.TYPE_FLOAT, FieldDescriptor.TYPE_DOUBLE)


def _with_arrays_as_bytes(file: FileDescriptor) -> dict[str, type[Message]]:
    proto = descriptor_pb2.FileDescriptorProto()
    file.CopyToProto(proto)
    for message in proto.message_type:
        for field in message.field:
            if field.label == FieldDescriptor.LABEL_REPEATED and field.type in _FLOATS:
                field.label = FieldDescriptor.LABEL_OPTIONAL
                field.type = FieldDescriptor.TYPE_BYTES
    # a pool of its own: in the default one the names are taken by the generated messages
    pool = descriptor_pool.DescriptorPool()
    pool.Add(proto)
    classes: dict[str, type[Message]] = message_factory.GetMessageClassesForFiles([proto.name], pool)
    return classes


_SERVICE = hydrodynamics_pb2.DESCRIPTOR.services_by_name["Hydrodynamics"]
_PACKAGE = hydrodynamics_pb2.DESCRIPTOR.package
_MESSAGES = _with_arrays_as_bytes(hydrodynamics_pb2.DESCRIPTOR)


def _new(name: str, **fields: Any) -> Any:
    return _MESSAGES[f"{_PACKAGE}.{name}"](**fields)


def calls(channel: Any) -> dict[str, Any]:
    """The service's methods by name, on a channel of `grpc` or of `grpc.aio`."""
    kinds = {(False, False): "unary_unary", (True, True): "stream_stream"}
    return {
        method.name: getattr(channel, kinds[method.client_streaming, method.server_streaming])(
            f"/{_SERVICE.full_name}/{method.name}",
            request_serializer=_MESSAGES[method.input_type.full_name].SerializeToString,
            response_deserializer=_MESSAGES[method.output_type.full_name].FromString,
        )
        for method in _SERVICE.methods
    }


def evaluate_request(vehicle: str, state: State) -> Message:
    """A single state; raises `InvalidState` for a wrong shape."""
    depth, density, *vectors = state.floats()
    request = _new("EvaluateRequest", vehicle=vehicle)
    message = request.state
    message.depth_m = depth
    message.ground_contact = state.ground_contact
    if not state.is_default("density_kgpm3"):
        message.density_kgpm3 = density
    for i, name in enumerate(VECTORS):
        if not state.is_default(name):
            vector = getattr(message, name)
            vector.x, vector.y, vector.z = vectors[3 * i : 3 * i + 3]
    return request


def evaluate_batch_request(vehicle: str, states: State, surfaces: bool) -> tuple[Message, int]:
    """A batch and its length; raises `InvalidState` for a wrong shape."""
    rows = states.rows()
    arrays = {
        name: row.astype("<f4", copy=False).tobytes() for name, row in rows.items() if not states.is_default(name)
    }
    request = _new(
        "EvaluateBatchRequest",
        vehicle=vehicle,
        ground_contact=states.ground_contact,
        omit_surfaces=not surfaces,
        **arrays,
    )
    return request, len(rows["depth_m"])


def list_vehicles_request() -> Message:
    """Asks for the vehicles that are served."""
    return _new("ListVehiclesRequest")


def get_vehicle_request(vehicle: str, mesh: bool) -> Message:
    """Asks for all about one vehicle."""
    return _new("GetVehicleRequest", vehicle=vehicle, include_mesh=mesh)


def forces(response: Any) -> Forces:
    """The answer to a single state."""
    wrench = response.wrench
    vectors = (wrench.force_n, wrench.moment_nm, wrench.about_m, response.uncertainty_n)
    net = np.array([(v.x, v.y, v.z) for v in vectors], np.float32)
    return Forces(
        force_n=net[0],
        moment_nm=net[1],
        about_m=net[2],
        uncertainty_n=net[3],
        surface_force_n=_floats(response.surface_force_n, -1, 3),
        surface_point_m=_floats(response.surface_point_m, -1, 3),
        wetted_fraction=_floats(response.wetted_fraction, -1),
        outside=_outside(response.outside, 1)[0],
        bundle_version=response.bundle_version,
        provenance=response.provenance,
        compute_ns=response.compute_ns,
    )


def batch_forces(response: Any, length: int) -> Forces:
    """The answer to a batch of this length."""
    wetted = _floats(response.wetted_fraction, length, len(response.wetted_fraction) // (4 * length))
    return Forces(
        force_n=_floats(response.force_n, length, 3),
        moment_nm=_floats(response.moment_nm, length, 3),
        about_m=_vector(response.about_m),
        uncertainty_n=_floats(response.uncertainty_n, length, 3),
        surface_force_n=_floats(response.surface_force_n, *wetted.shape, 3),
        surface_point_m=_floats(response.surface_point_m, *wetted.shape, 3),
        wetted_fraction=wetted,
        outside=_outside(response.outside, length),
        bundle_version=response.bundle_version,
        provenance=response.provenance,
        compute_ns=response.compute_ns,
    )


def _floats(data: bytes, *shape: int) -> np.ndarray:
    return np.frombuffer(data, "<f4").reshape(shape)


def _vector(v: Any) -> np.ndarray:
    return np.array((v.x, v.y, v.z), np.float32)


def _outside(found: Any, length: int) -> np.ndarray:
    dense = np.zeros((length, len(Quantity)), np.float32)
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
        mesh_stl=response.mesh_stl,
        face_surface=np.array(response.face_surface, np.int64),
    )


def error(failure: Any, at: str, timeout_s: float) -> WadeError:
    """The error that a failed call stands for, with what the server attached to it."""
    code, message = failure.code(), failure.details() or ""
    if code is grpc.StatusCode.UNAVAILABLE:
        return ServerUnavailable(at, message)
    if code is grpc.StatusCode.OK:
        return ServerUnavailable(at, "the server ended the stream")
    if code is grpc.StatusCode.DEADLINE_EXCEEDED:
        return DeadlineExceeded(timeout_s)
    for detail in _details(failure):
        if isinstance(detail, error_details_pb2.BadRequest):
            return InvalidState([_violation(v.field, v.description) for v in detail.field_violations])
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


def _violation(field: str, description: str) -> Violation:
    """`state.depth_m` of a single state, `depth_m[3]` of the fourth of a batch."""
    name, _, index = field.removeprefix("state.").rstrip("]").partition("[")
    return Violation(name, description, int(index) if index else None)
