"""The model in this process. `wade.InProcess` is its interface; names and order of numbers are private to the two."""

from os import PathLike

#: Version of the package; the client's must be the same.
VERSION: str

class InvalidState(Exception):
    """A field of the state is wrong. Arguments: field, description, index in a batch or None."""

    args: tuple[str, str, int | None]

class UnknownVehicle(Exception):
    """No vehicle has this name. Argument: what there is."""

class UnreadableVehicle(Exception):
    """A folder or a bundle cannot be read. Argument: why."""

class Library:
    """The vehicles of a folder, and behind them those that the module carries."""

    def __init__(self, folder: str | PathLike[str] | None = None) -> None: ...
    def names(self) -> list[str]: ...
    def vehicle(self, name: str) -> Vehicle: ...

class Vehicle:
    """A vehicle with its effects, ready to answer one call at a time."""

    @property
    def version(self) -> int: ...
    @property
    def provenance(self) -> str: ...
    @property
    def about_m(self) -> tuple[float, float, float]: ...
    @property
    def effects(self) -> list[int]: ...
    def columns(self, surfaces: bool, jacobian: bool) -> list[tuple[str, str, tuple[int, ...]]]:
        """Name, numpy type and shape of each column of an answer, in order and without gaps."""

    def evaluate(self, numbers: list[float], flags: int, session: int) -> bytes:
        """The answer to a state: one row of `columns(True, jacobian)`, with derivatives where the flags ask."""

    def evaluate_batch(self, numbers: bytes, flags: int, sessions: bytes, surfaces: bool) -> bytes:
        """The answers to N rows of single-precision numbers; `sessions` has a word of 8 bytes for each, or none."""

    def description(self) -> bytes:
        """A `GetVehicleResponse` as it travels, without the mesh."""

    def stability(self, request: bytes) -> bytes:
        """The answer to a `GetStabilityRequest` as it travels."""
