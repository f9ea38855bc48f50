"""The example in MuJoCo, held against hydrostatics of the hull's mesh, which is worked out here."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from servers import VEHICLES, Server

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import mujoco_wading as wading

GRAVITY, DENSITY, MASS = 9.81, 1000.0, 280.0


@pytest.fixture
def client(server: Server) -> Iterator[wade.ShmClient]:
    with wade.ShmClient(server.namespace, timeout_s=20.0) as client:
        yield client


def faces() -> NDArray[np.float64]:
    """Corners of the Warthog's faces, `[faces, 3, 3]`."""
    stl = (VEHICLES / "warthog" / "hull.stl").read_bytes()
    face = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    return np.frombuffer(stl, face, offset=84)["corners"].astype(float)


def volume_below(z: float) -> float:
    """Volume of the hull below a level [m3], by the divergence theorem over the clipped faces."""
    corners = faces() - (0.0, 0.0, z)
    heights = corners[:, :, 2]
    below, straddling = (heights <= 0).all(axis=1), (heights > 0).any(axis=1) & (heights < 0).any(axis=1)
    volume = sum(prism(corners[below]))
    for triangle in corners[straddling]:
        polygon = []
        for a, b in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            if a[2] <= 0:
                polygon.append(a)
            if (a[2] < 0) != (b[2] < 0):
                polygon.append(a + (b - a) * a[2] / (a[2] - b[2]))
        volume += sum(prism(np.array([(polygon[0], b, c) for b, c in pairwise(polygon[1:])])))
    return float(volume)


def prism(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed volume between each triangle and the plane z = 0."""
    up = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[:, 2] / 2
    return np.asarray(up * triangles[:, :, 2].mean(axis=1))


@cache
def floating_depth() -> float:
    """Depth at which the hull displaces its mass [m]."""
    low, high = 0.0, 0.826
    while high - low > 1e-4:
        middle = (low + high) / 2
        low, high = (low, middle) if DENSITY * volume_below(wading.Z0 + middle) > MASS else (middle, high)
    return (low + high) / 2


def test_the_clipping_is_right() -> None:
    # all of it lies below a high level: the volume of the tetrahedra of its faces and the origin
    corners = faces()
    whole = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume_below(1.0) == pytest.approx(whole)
    # the public mesh of this vehicle, sealed, floats at 0.378 m; ours displaces the same within 2.5 %
    assert floating_depth() == pytest.approx(0.378, abs=0.01)


def test_it_floats_where_hydrostatics_says(client: wade.ShmClient) -> None:
    depth = floating_depth()
    model = wading.build(wading.BASIN, x=0.0, z=-wading.Z0 - depth - 0.02, timestep_s=0.005)
    track = wading.run(client, model, duration_s=4.0, speed=0.0, damping=True)
    settled = track.depth[-200:]
    assert settled.max() - settled.min() < 0.005
    # the weights know level motion at 0.5 m/s and more, not rest: their lift here is 2 % off
    assert settled.mean() == pytest.approx(depth, abs=0.01)
    assert np.abs(track.pitch).max() < math.radians(6)


def test_it_heaves_at_the_period_of_its_waterplane(client: wade.ShmClient) -> None:
    depth = floating_depth()
    area = (volume_below(wading.Z0 + depth + 0.01) - volume_below(wading.Z0 + depth - 0.01)) / 0.02
    # without added mass, which is not served yet and would make it longer
    period = 2 * math.pi * math.sqrt(MASS / (DENSITY * GRAVITY * area))
    guide = '<joint type="slide" axis="0 0 1"/>'
    model = wading.build(wading.BASIN, x=0.0, z=-wading.Z0 - depth - 0.02, timestep_s=0.005, joint=guide)
    track = wading.run(client, model, duration_s=2.6, speed=0.0)
    heave = track.depth - track.depth.mean()
    rising = track.time[1:][(heave[:-1] < 0) & (heave[1:] >= 0)]
    assert len(rising) == 3
    assert np.diff(rising).mean() == pytest.approx(period, rel=0.12)


def test_it_drives_into_the_water_and_out_again(client: wade.ShmClient) -> None:
    track = wading.ford(client, timestep_s=0.004)
    assert track.position[-1, 0] > wading.FORD[-2][0]
    assert abs(track.position[-1, 1]) < 0.5
    assert track.depth[0] < 0 and track.depth[-1] < 0
    bed, slope = -wading.FORD[2][1], math.atan2(0.6, 4.3)
    assert track.depth.max() == pytest.approx(bed, abs=0.01)
    assert track.pitch.max() == pytest.approx(slope, abs=0.01) and track.pitch.min() == pytest.approx(-slope, abs=0.01)
    deepest = track.force[track.depth > bed - 0.01].mean(axis=0)
    assert deepest[0] < -50  # holds it back
    assert deepest[2] == pytest.approx(DENSITY * GRAVITY * volume_below(wading.Z0 + bed), rel=0.1)
    assert not track.force[track.depth <= 0].any()
