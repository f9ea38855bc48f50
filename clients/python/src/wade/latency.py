"""What the server says of its own speed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Percentiles:
    """Of the time from a request's arrival to its answer [us]."""

    count: int
    p50_us: float
    p95_us: float
    p99_us: float
    p99_9_us: float
    max_us: float


@dataclass(frozen=True, slots=True)
class Latency:
    """One transport and vehicle.

    Attributes:
        transport: grpc_unary, grpc_batch, grpc_stream (TCP), uds_unary, uds_batch, uds_stream (Unix socket),
            shm or shm_batch.
        window: Of the last full window.
        window_s: Length of a window [s].
    """

    transport: str
    vehicle: str
    since_start: Percentiles
    window: Percentiles
    window_s: float
