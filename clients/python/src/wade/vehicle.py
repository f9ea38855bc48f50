"""What the server says of a vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .forces import BoxQuantity, Effect, Quantity


@dataclass(frozen=True, slots=True)
class Surface:
    """A named region of the hull."""

    name: str
    #: bottom, front, rear, side, wheel or track.
    kind: str
    #: [m], `[3]`
    centroid_m: NDArray[np.float32]
    #: Mean outward normal, `[3]`.
    normal: NDArray[np.float32]
    area_m2: float


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """A number of an effect."""

    name: str
    value: float
    #: Standard error.
    std: float
    #: 1 where it has none.
    unit: str


@dataclass(frozen=True, slots=True)
class ActiveEffect:
    """An effect that was added to a model, with its numbers."""

    #: A number that this client does not know is of a newer server.
    effect: Effect | int
    name: str
    equation: str
    parameters: tuple[EffectParameter, ...]
    #: Seen in one condition only.
    provisional: bool


@dataclass(frozen=True, slots=True)
class Reloaded:
    """What a vehicle's bundle on disk came to."""

    vehicle: str
    #: The version that is served now.
    bundle_version: int
    #: Why the bundle on disk was refused; empty where it is served.
    refusal: str


@dataclass(frozen=True, slots=True, eq=False)
class Vehicle:
    """A vehicle, body frame: x forward, y left, z up, origin at the center of the hull's bounding box."""

    name: str
    bundle_version: int
    #: Where the weights come from, such as "analytic".
    provenance: str
    length_m: float
    width_m: float
    height_m: float
    #: z of the ground-contact plane.
    z0_m: float
    mass_kg: float
    #: `[3]`
    center_of_mass_m: NDArray[np.float32]
    #: About the center of mass, `[3, 3]`.
    inertia_kgm2: NDArray[np.float64]
    surfaces: tuple[Surface, ...]
    #: Range in the training data of each quantity that has one.
    domain: dict[Quantity, tuple[float, float]]
    #: What was added to the model, in the order of `Forces.effects`.
    effects: tuple[ActiveEffect, ...]
    #: The box in which the effects were seen.
    effects_validity: dict[BoxQuantity, tuple[float, float]]
    #: Binary STL of the hull, empty unless asked for.
    mesh_stl: bytes
    #: Index of the surface of each face, `[faces]`.
    face_surface: NDArray[np.int64]
