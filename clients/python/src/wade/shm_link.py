"""A client's node, events and ports in iceoryx2, which last until the server is lost."""

from __future__ import annotations

import ctypes
import os
import resource
import secrets
import time
from collections.abc import Callable
from typing import Any

import iceoryx2 as iox
import numpy as np

from . import shm_layout as layout
from .errors import DeadlineExceeded, LayoutMismatch, Refused, ResourceExhausted, ServerUnavailable, UnknownVehicle

#: What iceoryx2 raises where a port broke; it has no common base.
_FAILURES = (
    iox.EventOpenError,
    iox.ListenerCreateError,
    iox.LoanError,
    iox.NodeCreationFailure,
    iox.NotifierCreateError,
    iox.ReceiveError,
    iox.RequestSendError,
    iox.RequestResponseOpenError,
)


class Service:
    """A service of a vehicle: its name, its types, and where the status and the flags of an answer lie."""

    def __init__(
        self,
        name: Callable[[str, str], str],
        types: tuple[type[ctypes.Structure], type[ctypes.Structure]],
        answer: np.dtype[Any],
    ):
        self.name, self.types = name, types
        self.status_at, self.flags_at = (layout.fields(answer)[field][1] for field in ("status", "flags"))


SINGLE = Service(layout.evaluate_name, (layout.Query, layout.Answer), layout.ANSWER)
#: Its answer begins with that of a single state.
JACOBIAN = Service(layout.evaluate_jacobian_name, (layout.Query, layout.JacobianAnswer), layout.ANSWER)
#: Its query is not read.
VEHICLE = Service(layout.vehicle_name, (layout.Query, layout.VehicleAnswer), layout.VEHICLE_ANSWER)
BATCH = Service(layout.evaluate_batch_name, (layout.BatchQuery, layout.BatchAnswer), layout.BATCH_ANSWER)

#: What servers of the first day do not have.
_LATER = {JACOBIAN: "derivatives", VEHICLE: "descriptions"}

# its log would go to standard output, and says of every server that is not there that it is not there
iox.set_log_level_from_env_or(iox.LogLevel.Fatal)


class Lost(Exception):
    """No server is connected to the port any more."""


def vehicles(namespace: str) -> list[str]:
    """Names of the vehicles that the server of a namespace tells of. Reads one file and asks nobody.

    Raises `ServerUnavailable` where no server lives, `LayoutMismatch` where it is of another layout.
    """
    name, pattern = iox.ServiceName.new(layout.served_name(namespace)), iox.MessagingPattern.Event
    try:
        details = iox.Service.details(name, iox.config.global_config(), pattern, iox.ServiceType.Ipc)
    except iox.ServiceDetailsError as failure:
        raise ServerUnavailable(_at(namespace), str(failure)) from None
    if details is None or not any(isinstance(node, iox.NodeState.Alive) for node in details.nodes()):
        raise ServerUnavailable(
            _at(namespace), "no server; is wade serve running with shared memory and this namespace?"
        )

    def told(key: str) -> str:
        return " ".join(value.to_string() for value in details.attributes().key_values(iox.AttributeKey.new(key)))

    if told(layout.SERVED_LAYOUT) != layout.VERSION:
        raise LayoutMismatch(layout.VERSION, told(layout.SERVED_LAYOUT))
    return told(layout.SERVED_VEHICLES).split()


def _at(namespace: str) -> str:
    return f"shared memory, namespace {namespace!r}"


#: Room in /dev/shm that a client's ports take with the first batch of 256 states [bytes]: 1.4 MB were measured.
_ROOM = 2 << 20
#: Descriptors that they take: 35 were measured, with the port for derivatives.
_DESCRIPTORS = 40


def _check_room() -> None:
    """Raises `ResourceExhausted` where there is no room: a write to a page without memory would end the program."""
    shared = os.statvfs("/dev/shm")
    free = shared.f_bavail * shared.f_frsize
    if free < _ROOM:
        raise ResourceExhausted(
            f"/dev/shm has {free >> 10} kB free, and a client needs {_ROOM >> 10} kB: free some or enlarge it "
            "(docker --shm-size, mount -o remount,size=)",
            None,
        )
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    used = len(os.listdir("/proc/self/fd"))
    if limit != resource.RLIM_INFINITY and limit < used + _DESCRIPTORS:
        raise ResourceExhausted(
            f"{used} of {limit} file descriptors are open, and a client needs {_DESCRIPTORS}: raise the limit "
            "(ulimit -n, LimitNOFILE=)",
            None,
        )


def _config() -> Any:
    """The settings of a client's node: what others left that were killed is for servers to clear away."""
    config = iox.config.global_config()
    config.global_cfg.node.cleanup_dead_nodes_on_creation = False
    config.global_cfg.node.cleanup_dead_nodes_on_destruction = False
    return config


class Link:
    """What a client holds open in one namespace. Raises the errors of the package, and `Lost`."""

    def __init__(self, namespace: str, blocks: bool):
        self._namespace = namespace
        # what the server's last answer said: waking it would be of no use
        self._server_polls = False
        # names this client's listener among all others'; 0 where the client polls
        self._wake_key = secrets.randbits(63) + 1 if blocks else 0
        self._ports: dict[tuple[str, Service], Any] = {}
        _check_room()
        try:
            # the signals belong to the program
            builder = iox.NodeBuilder.new().config(_config()).signal_handling_mode(iox.SignalHandlingMode.Disabled)
            self._node = builder.create(iox.ServiceType.Ipc)
        except _FAILURES as failure:
            raise ServerUnavailable(
                self._at(), f"no node: {failure}; /tmp/iceoryx2 serves the user who owns it"
            ) from None
        self._wake: Any = None
        self._listener: Any = None

    def exchange(
        self, vehicle: str, service: Service, write: Callable[[int, int], None], end: float, timeout_s: float
    ) -> Any:
        """Sends what `write` puts at the address of a request, and gives the response, which lies in shared memory."""
        try:
            port = self._ports.get((vehicle, service)) or self._open(vehicle, service)
            request = port.loan_uninit()
            write(request.payload_ptr, self._wake_key)
            pending = request.assume_init().send()
            if pending.number_of_server_connections == 0:
                raise Lost
            if not self._server_polls:
                self._notify()
            response = self._await(pending, end, timeout_s)
            flags = ctypes.c_uint64.from_address(response.payload_ptr + service.flags_at).value
            self._server_polls = bool(flags & layout.SERVER_POLLS)
            status = ctypes.c_uint32.from_address(response.payload_ptr + service.status_at).value
            if status == layout.STATUS_NOT_SERVED:
                raise self._not_served(vehicle)
            return response
        except _FAILURES as failure:
            raise ServerUnavailable(self._at(), str(failure)) from None

    def why_not(self, vehicle: str, service: Service = SINGLE) -> Exception:
        """The reason why there is no server for a vehicle."""
        try:
            served = vehicles(self._namespace)
        except (LayoutMismatch, ServerUnavailable) as failure:
            return failure
        if vehicle not in served:
            return UnknownVehicle(vehicle, f"vehicle {vehicle!r} is not served; there are: {', '.join(served)}")
        if (what := _LATER.get(service)) is not None:
            return Refused(f"no {what}", "over shared memory the server has none; it is of an earlier version")
        return ServerUnavailable(self._at(), f"the server has not opened {vehicle}")

    def _not_served(self, vehicle: str) -> UnknownVehicle:
        """The error of a vehicle that was unloaded while its ports stayed open."""
        try:
            served = [name for name in vehicles(self._namespace) if name != vehicle]
        except (LayoutMismatch, ServerUnavailable):
            served = []
        message = f"vehicle {vehicle!r} is not served any more; there are: {', '.join(served) or 'none'}"
        return UnknownVehicle(vehicle, message)

    def _at(self) -> str:
        return _at(self._namespace)

    def _exchange_service(self, vehicle: str, service: Service) -> Any:
        name = service.name(self._namespace, vehicle)
        try:
            builder = self._node.service_builder(iox.ServiceName.new(name))
            return builder.request_response(*service.types).open()
        except iox.SemanticStringError:
            raise self.why_not(vehicle) from None
        except iox.RequestResponseOpenError as failure:
            if str(failure) == "DoesNotExist":
                raise self.why_not(vehicle, service) from None
            if str(failure) == "IncompatibleRequestOrResponseType":
                raise LayoutMismatch(layout.VERSION, f"{name} with other types") from None
            raise

    def _open(self, vehicle: str, kind: Service) -> Any:
        service = self._exchange_service(vehicle, kind)
        if self._wake is None:
            self._open_events()
        try:
            port = service.client_builder().create()
        except iox.ClientCreateError as failure:
            message = f"no place for another client of {vehicle}: {failure}; the server's limit is shm.max_clients"
            raise ResourceExhausted(message, None) from None
        self._ports[vehicle, kind] = port
        return port

    def _open_events(self) -> None:
        def event(name: str) -> Any:
            return self._node.service_builder(iox.ServiceName.new(name)).event().open()

        self._wake = event(layout.wake_name(self._namespace)).notifier_builder().create()
        if self._wake_key:
            name = iox.PortName.new(layout.listener_name(self._wake_key))
            self._listener = event(layout.done_name(self._namespace)).listener_builder().name(name).create()

    def _notify(self) -> None:
        try:
            self._wake.notify()
        except iox.NotifierNotifyError:
            # the server looks for requests now and then without being woken
            pass

    def _await(self, pending: Any, end: float, timeout_s: float) -> Any:
        while True:
            response = pending.receive()
            if response is not None:
                return response
            left = end - time.monotonic()
            if left <= 0.0:
                raise DeadlineExceeded(timeout_s)
            if self._listener is not None:
                self._sleep(left)

    def _sleep(self, left: float) -> None:
        try:
            # less than a microsecond would mean no limit to the system call
            self._listener.timed_wait(iox.Duration.from_secs_f64(max(left, 1e-6)))
        except iox.ListenerWaitError:
            # a signal, most likely; whatever it was, the answer is looked for until the end
            time.sleep(min(left, 1e-4))


def memory(address: int, size: int) -> Any:
    """The bytes at an address, without a copy, for as long as their owner lives."""
    return (ctypes.c_char * size).from_address(address)
