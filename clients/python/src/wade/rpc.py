"""The client over gRPC: TCP or a Unix socket."""

from __future__ import annotations

import threading
import time
from queue import Empty, SimpleQueue
from typing import Any

import grpc

from . import messages
from .channel import DEFAULT_ADDRESS, Endpoint, Tls
from .client import DEFAULT_TIMEOUT_S, check_query, checked_timeout
from .errors import DeadlineExceeded, ServerUnavailable, WadeError
from .forces import Forces
from .latency import Latency
from .stability import DEFAULT_TIMEOUT_S as MAP_TIMEOUT_S
from .stability import Ford, Stability
from .state import State
from .vehicle import Reloaded, Vehicle


class GrpcClient:
    """Asks a server at `host:port`, `http[s]://host:port` or `unix:PATH`; connects with the first call.

    Several threads may share it.

    `https://` or `tls` encrypts. Every call shows the `token`, by default that of the file WADE_TOKEN_FILE; without
    encryption it goes to this machine alone.

    A call that finds no server fails at once, or as soon as the connection breaks, with `ServerUnavailable`; the next
    one connects anew.
    """

    def __init__(
        self,
        address: str = DEFAULT_ADDRESS,
        *,
        tls: Tls | None = None,
        token: str | None = None,
        timeout_s: float = DEFAULT_TIMEOUT_S,
    ):
        self._endpoint = Endpoint.from_arguments(address, tls, token)
        self.address = self._endpoint.address
        self._timeout_s = checked_timeout(timeout_s)
        self._lock = threading.Lock()
        self._channel: Any = None
        self._calls: dict[str, Any] = {}

    def evaluate(self, vehicle: str, state: State, *, timeout_s: float | None = None) -> Forces:
        """The forces on one vehicle in one state."""
        check_query(vehicle, state)
        return messages.forces(self._call("Evaluate", messages.evaluate_request(vehicle, state), timeout_s))

    def evaluate_batch(
        self, vehicle: str, states: State, *, surfaces: bool = True, timeout_s: float | None = None
    ) -> Forces:
        """The forces in N states of one vehicle, as many as the server's `grpc.max_batch` allows."""
        check_query(vehicle, states)
        request, length = messages.evaluate_batch_request(vehicle, states, surfaces)
        return messages.batch_forces(self._call("EvaluateBatch", request, timeout_s), length)

    def stream(self, vehicle: str) -> GrpcStream:
        """A stream of states of one vehicle: less than half the time of single calls. One thread at a time."""
        return GrpcStream(self, vehicle)

    def vehicles(self, *, timeout_s: float | None = None) -> list[str]:
        """Names of the vehicles that are served."""
        listed = self._call("ListVehicles", messages.list_vehicles_request(), timeout_s)
        return [summary.name for summary in listed.vehicles]

    def vehicle(self, name: str, *, mesh: bool = False, timeout_s: float | None = None) -> Vehicle:
        """Surfaces, dimensions, mass and training domain of a vehicle; the hull's mesh on request."""
        return messages.vehicle(self._call("GetVehicle", messages.get_vehicle_request(name, mesh), timeout_s))

    def stability(self, vehicle: str, ford: Ford, *, timeout_s: float = MAP_TIMEOUT_S) -> Stability:
        """Whether a vehicle that stands in moving water floats, slides, topples or can be steered."""
        request = messages.get_stability_request(vehicle, ford)
        return messages.stability(self._call("GetStability", request, timeout_s), ford)

    def latency(self, *, timeout_s: float | None = None) -> tuple[Latency, ...]:
        """How fast the server is by its own clock, for each transport and vehicle that was asked for."""
        return messages.latencies(self._call("GetLatency", messages.get_latency_request(), timeout_s))

    def reload(self, vehicle: str = "", *, timeout_s: float | None = None) -> tuple[Reloaded, ...]:
        """The administrator's call: the server reads the bundle of a vehicle, or of each, from disk again.

        It swaps in those that are sound; one that is refused leaves the version that is served.
        """
        return messages.reloaded(self._call("Reload", messages.reload_request(vehicle), timeout_s))

    def close(self) -> None:
        """Closes the connection. A call after it connects anew."""
        with self._lock:
            channel, self._channel, self._calls = self._channel, None, {}
        if channel is not None:
            channel.close()

    def __enter__(self) -> GrpcClient:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _call(self, method: str, request: Any, timeout_s: float | None) -> Any:
        timeout_s = self._timeout(timeout_s)
        calls = self._connected()
        try:
            return calls[method](request, timeout=timeout_s, metadata=self._endpoint.metadata)
        except grpc.RpcError as failure:
            raise self._failed(calls, failure, timeout_s) from None

    def _timeout(self, timeout_s: float | None) -> float:
        timeout_s = self._timeout_s if timeout_s is None else checked_timeout(timeout_s)
        if timeout_s == 0.0:
            # grpcio would take it for the next full millisecond
            raise DeadlineExceeded(timeout_s)
        return timeout_s

    def _connected(self) -> dict[str, Any]:
        with self._lock:
            if not self._calls:
                self._channel = self._endpoint.open(grpc)
                self._calls = messages.calls(self._channel)
            return self._calls

    def _failed(self, calls: dict[str, Any], failure: Any, timeout_s: float) -> WadeError:
        error = messages.error(failure, self._endpoint, timeout_s)
        if isinstance(error, ServerUnavailable):
            # dropped rather than closed: closing would cancel what other threads still wait for
            with self._lock:
                if self._calls is calls:
                    self._channel, self._calls = None, {}
        return error


class GrpcStream:
    """One answer a state, in order: a run, in which effects remember.

    A call that fails ends the run, and the next begins it anew.
    """

    def __init__(self, client: GrpcClient, vehicle: str):
        self._client, self._vehicle = client, vehicle
        self._calls: dict[str, Any] = {}
        self._call: Any = None
        self._requests: SimpleQueue[Any] = SimpleQueue()
        self._answers: SimpleQueue[Any] = SimpleQueue()

    def evaluate(self, state: State, *, timeout_s: float | None = None) -> Forces:
        """The forces in one state."""
        try:
            timeout_s = self._client._timeout(timeout_s)
            request = messages.evaluate_request(self._vehicle, state)
        except WadeError:
            self.close()
            raise
        end = time.monotonic() + timeout_s
        begins = self._call is None
        if begins:
            self._open()
        self._requests.put(request)
        try:
            answer = self._answers.get(timeout=max(end - time.monotonic(), 0.0))
        except Empty:
            self.close()
            raise DeadlineExceeded(timeout_s) from None
        except BaseException:
            # interrupted: the answer that is still to come belongs to no later call
            self.close()
            raise
        if isinstance(answer, grpc.RpcError):
            self.close()
            raise self._client._failed(self._calls, answer, timeout_s)
        return messages.forces(answer, begins)

    def close(self) -> None:
        """Ends the stream."""
        call, self._call = self._call, None
        if call is not None:
            self._requests.put(None)
            call.cancel()

    def __enter__(self) -> GrpcStream:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _open(self) -> None:
        self._calls = self._client._connected()
        self._requests, self._answers = SimpleQueue(), SimpleQueue()
        self._call = self._calls["Stream"](iter(self._requests.get, None), metadata=self._client._endpoint.metadata)
        # grpcio can wait for an answer without end only; a queue can be waited for in time
        reader = threading.Thread(target=_read, args=(self._call, self._answers), daemon=True)
        reader.start()


def _read(call: Any, answers: SimpleQueue[Any]) -> None:
    try:
        for answer in call:
            answers.put(answer)
    except grpc.RpcError:
        pass
    # the call itself is the error, also where the server ended it without one
    answers.put(call)
