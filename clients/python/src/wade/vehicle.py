"""What the server says of a vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .forces import BoxQuantity, Effect, Quantity


@dataclass(frozen=True, slots=True)
class Surface:
    """A named region of the hull.

    Attributes:
        kind: bottom, front, rear, side, wheel or track.
        centroid_m: [m], `[3]`
        normal: Mean outward normal, `[3]`.
    """

    name: str
    kind: str
    centroid_m: NDArray[np.float32]
    normal: NDArray[np.float32]
    area_m2: float


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """A number of an effect.

    Attributes:
        std: Standard error.
        unit: 1 where it has none.
    """

    name: str
    value: float
    std: float
    unit: str


@dataclass(frozen=True, slots=True)
class RegionLimit:
    """A limit of a quantity beyond which an effect does not act.

    Attributes:
        quantity: "depth", "froude_depth", "speed" or "pitch".
        unit: 1 where it has none.
        above: The effect is not there up to the first, and whole from the second; None without such a border.
        at_most: The effect is whole up to the first, and not there from the second; None without such a border.
    """

    quantity: str
    unit: str
    above: tuple[float, float] | None
    at_most: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class ActiveEffect:
    """An effect that was added to a model, with its numbers.

    Attributes:
        effect: A number that this client does not know is of a newer server.
        provisional: Seen in one condition only.
        region: Where it acts: within all of these limits. Empty: everywhere.
    """

    effect: Effect | int
    name: str
    equation: str
    parameters: tuple[EffectParameter, ...]
    provisional: bool
    region: tuple[RegionLimit, ...]


@dataclass(frozen=True, slots=True)
class Reloaded:
    """What a vehicle's bundle on disk came to.

    Attributes:
        bundle_version: The version that is served now.
        refusal: Why the bundle on disk was refused; empty where it is served.
    """

    vehicle: str
    bundle_version: int
    refusal: str


@dataclass(frozen=True, slots=True, eq=False)
class Vehicle:
    """A vehicle, body frame: x forward, y left, z up, origin at the center of the hull's bounding box.

    Attributes:
        provenance: Where the weights come from, such as "analytic".
        z0_m: z of the ground-contact plane.
        center_of_mass_m: `[3]`
        inertia_kgm2: About the center of mass, `[3, 3]`.
        domain: Range in the training data of each quantity that has one.
        effects: What was added to the model, in the order of `Forces.effects`.
        effects_validity: The box in which the effects were seen.
        mesh_stl: Binary STL of the hull, empty unless asked for.
        face_surface: Index of the surface of each face, `[faces]`.
    """

    name: str
    bundle_version: int
    provenance: str
    length_m: float
    width_m: float
    height_m: float
    z0_m: float
    mass_kg: float
    center_of_mass_m: NDArray[np.float32]
    inertia_kgm2: NDArray[np.float64]
    surfaces: tuple[Surface, ...]
    domain: dict[Quantity, tuple[float, float]]
    effects: tuple[ActiveEffect, ...]
    effects_validity: dict[BoxQuantity, tuple[float, float]]
    mesh_stl: bytes
    face_surface: NDArray[np.int64]
