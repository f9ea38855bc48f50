"""Why a call got no forces. Every error is a `WadeError`, and of the built-in kind that fits it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class WadeError(Exception):
    """No forces were had."""


@dataclass(frozen=True)
class Violation:
    """A field that is wrong, by the name that `State` gives it.

    Attributes:
        description: A sentence that names the field, and in a batch the state.
        index: Which state of a batch; None for a single state or where the whole array is meant.
    """

    field: str
    description: str
    index: int | None = None


class InvalidState(WadeError, ValueError):
    """A field of the state is wrong; the same call would be refused again."""

    def __init__(self, violations: Sequence[Violation]):
        self.violations = tuple(violations)
        super().__init__("; ".join(violation.description for violation in self.violations))


class UnknownVehicle(WadeError, LookupError):
    """The server serves no such vehicle."""

    def __init__(self, vehicle: str, message: str):
        self.vehicle = vehicle
        super().__init__(message)


class ServerUnavailable(WadeError, ConnectionError):
    """Nobody answers there, or the server went away during the call. The next call connects anew."""

    def __init__(self, at: str, reason: str):
        self.at, self.reason = at, reason
        super().__init__(f"no server at {at}: {reason}")


class DeadlineExceeded(WadeError, TimeoutError):
    """No answer came in time. The next call starts afresh."""

    def __init__(self, timeout_s: float):
        self.timeout_s = timeout_s
        super().__init__(f"no answer within {timeout_s * 1e3:g} ms")


class LayoutMismatch(WadeError):
    """The server's shared memory has another layout than this client's: install the one of the server's version."""

    def __init__(self, expected: str, found: str):
        self.expected, self.found = expected, found
        super().__init__(
            f"shared memory of layout {expected} expected, found {found}; client and server must be of one version"
        )


class ResourceExhausted(WadeError):
    """The server is at a limit."""

    def __init__(self, message: str, retry_after_s: float | None):
        #: When to try again [s]; None where the same call would be refused again.
        self.retry_after_s = retry_after_s
        super().__init__(message)


class Refused(WadeError):
    """The server refused for another reason, named by its gRPC code or its status in shared memory."""

    def __init__(self, code: str, message: str):
        self.code = code
        super().__init__(f"{code}: {message}")


class Unauthenticated(Refused, PermissionError):
    """The server asks for a token or a client certificate, and got none that it knows."""

    def __init__(self, message: str):
        super().__init__("UNAUTHENTICATED", message)


class PermissionDenied(Refused, PermissionError):
    """The token or the certificate has not the role that the call needs."""

    def __init__(self, message: str):
        super().__init__("PERMISSION_DENIED", message)
