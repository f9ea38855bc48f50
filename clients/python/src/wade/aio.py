"""The client over gRPC for asyncio: the same methods, awaited. One event loop."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
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

#: What grpc.aio puts in the place of a call's status where it could not write a message, before or after the status.
_NOT_WRITTEN = "Internal error from Core"
#: How long the status may take from then on: it has been received, and waits in this process [s].
_STATUS_ARRIVES_S = 0.2


class GrpcClient:
    """As `wade.GrpcClient`, with every call a coroutine and `async with` for `with`."""

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
        self._channel: Any = None
        self._calls: dict[str, Any] = {}

    async def evaluate(self, vehicle: str, state: State, *, timeout_s: float | None = None) -> Forces:
        """The forces on one vehicle in one state."""
        check_query(vehicle, state)
        return messages.forces(await self._call("Evaluate", messages.evaluate_request(vehicle, state), timeout_s))

    async def evaluate_batch(
        self, vehicle: str, states: State, *, surfaces: bool = True, timeout_s: float | None = None
    ) -> Forces:
        """The forces in N states of one vehicle, as many as the server's `grpc.max_batch` allows."""
        check_query(vehicle, states)
        request, length = messages.evaluate_batch_request(vehicle, states, surfaces)
        return messages.batch_forces(await self._call("EvaluateBatch", request, timeout_s), length)

    def stream(self, vehicle: str) -> GrpcStream:
        """A stream of states of one vehicle: a fraction of the time of single calls. One task at a time."""
        return GrpcStream(self, vehicle)

    async def vehicles(self, *, timeout_s: float | None = None) -> list[str]:
        """Names of the vehicles that are served."""
        listed = await self._call("ListVehicles", messages.list_vehicles_request(), timeout_s)
        return [summary.name for summary in listed.vehicles]

    async def vehicle(self, name: str, *, mesh: bool = False, timeout_s: float | None = None) -> Vehicle:
        """Surfaces, dimensions, mass and training domain of a vehicle; the hull's mesh on request."""
        return messages.vehicle(await self._call("GetVehicle", messages.get_vehicle_request(name, mesh), timeout_s))

    async def stability(self, vehicle: str, ford: Ford, *, timeout_s: float = MAP_TIMEOUT_S) -> Stability:
        """Whether a vehicle that stands in moving water floats, slides, topples or can be steered."""
        request = messages.get_stability_request(vehicle, ford)
        return messages.stability(await self._call("GetStability", request, timeout_s), ford)

    async def latency(self, *, timeout_s: float | None = None) -> tuple[Latency, ...]:
        """How fast the server is by its own clock, for each transport and vehicle that was asked for."""
        return messages.latencies(await self._call("GetLatency", messages.get_latency_request(), timeout_s))

    async def reload(self, vehicle: str = "", *, timeout_s: float | None = None) -> tuple[Reloaded, ...]:
        """The administrator's call: the server reads the bundle of a vehicle, or of each, from disk again.

        It swaps in those that are sound; one that is refused leaves the version that is served.
        """
        return messages.reloaded(await self._call("Reload", messages.reload_request(vehicle), timeout_s))

    async def close(self) -> None:
        """Closes the connection. A call after it connects anew."""
        channel, self._channel, self._calls = self._channel, None, {}
        if channel is not None:
            await channel.close()

    async def __aenter__(self) -> GrpcClient:
        return self

    async def __aexit__(self, *exception: object) -> None:
        await self.close()

    async def _call(self, method: str, request: Any, timeout_s: float | None) -> Any:
        timeout_s = self._timeout(timeout_s)
        calls = self._connected()
        try:
            return await calls[method](request, timeout=timeout_s, metadata=self._endpoint.metadata)
        except grpc.RpcError as failure:
            raise self._failed(calls, failure, timeout_s) from None

    def _timeout(self, timeout_s: float | None) -> float:
        timeout_s = self._timeout_s if timeout_s is None else checked_timeout(timeout_s)
        if timeout_s == 0.0:
            # grpcio would take it for the next full millisecond
            raise DeadlineExceeded(timeout_s)
        return timeout_s

    def _connected(self) -> dict[str, Any]:
        if not self._calls:
            self._channel = self._endpoint.open(grpc.aio)
            self._calls = messages.calls(self._channel)
        return self._calls

    def _failed(self, calls: dict[str, Any], failure: Any, timeout_s: float) -> WadeError:
        error = messages.error(failure, self._endpoint, timeout_s)
        if isinstance(error, ServerUnavailable) and self._calls is calls:
            # dropped rather than closed: closing would cancel what other tasks still wait for
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
        self._statuses: list[tuple[Any, ...]] = []

    async def evaluate(self, state: State, *, timeout_s: float | None = None) -> Forces:
        """The forces in one state."""
        try:
            timeout_s = self._client._timeout(timeout_s)
            request = messages.evaluate_request(self._vehicle, state)
        except WadeError:
            self.close()
            raise
        begins = self._call is None
        if begins:
            self._calls = self._client._connected()
            self._call = self._calls["Stream"](metadata=self._client._endpoint.metadata)
            # as each of them comes: a later one takes the place of the one before
            self._statuses = statuses = []
            self._call.add_done_callback(lambda call: statuses.append(_without_waiting(_status(call))))
        call = self._call
        expired = False

        def expire() -> None:
            nonlocal expired
            expired = True
            call.cancel()

        loop = asyncio.get_running_loop()
        end = loop.time() + timeout_s
        timer = loop.call_at(end, expire)
        try:
            await call.write(request)
            answer = await call.read()
        except (grpc.RpcError, asyncio.InvalidStateError):
            # the latter where the call had ended before this state was written
            answer = grpc.aio.EOF
        except asyncio.CancelledError:
            self.close()
            if expired:
                raise DeadlineExceeded(timeout_s) from None
            raise
        finally:
            timer.cancel()
        if answer is grpc.aio.EOF:
            raise await self._ended(timeout_s, end)
        return messages.forces(answer, begins)

    def close(self) -> None:
        """Ends the stream."""
        call, self._call = self._call, None
        if call is not None:
            call.cancel()

    async def __aenter__(self) -> GrpcStream:
        return self

    async def __aexit__(self, *exception: object) -> None:
        self.close()

    async def _ended(self, timeout_s: float, end: float) -> WadeError:
        """What ended the call, by its status."""
        self._call = None
        loop = asyncio.get_running_loop()
        end = min(end, loop.time() + _STATUS_ARRIVES_S)
        while True:
            for status in self._statuses:
                if status[-1] != _NOT_WRITTEN:
                    return self._client._failed(self._calls, grpc.aio.AioRpcError(*status), timeout_s)
            if loop.time() >= end:
                break
            await asyncio.sleep(0.001)
        broken = (grpc.StatusCode.UNAVAILABLE, grpc.aio.Metadata(), grpc.aio.Metadata(), "the connection broke")
        return self._client._failed(self._calls, grpc.aio.AioRpcError(*broken), timeout_s)


async def _status(call: Any) -> tuple[Any, ...]:
    return await call.code(), await call.initial_metadata(), await call.trailing_metadata(), await call.details()


def _without_waiting(coroutine: Coroutine[Any, Any, Any]) -> Any:
    """What a coroutine returns that has nothing to wait for."""
    try:
        coroutine.send(None)
    except StopIteration as returned:
        return returned.value
    coroutine.close()
    raise RuntimeError("the coroutine waits")
