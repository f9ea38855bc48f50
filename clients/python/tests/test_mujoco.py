"""The example in MuJoCo, held against hydrostatics of the hull's mesh and closed forms."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hydrostatics import DENSITY, GRAVITY, MASS, Z0, faces, floating_depth, volume_below, waterplane_area
from numpy.typing import NDArray
from servers import VEHICLES, Server

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import mujoco_wading as wading
from effects_by_hand import copy_with

WEIGHTS = (VEHICLES / "warthog" / "network.safetensors").read_bytes()
#: The paper's network knows a vehicle that drives: it pushes one at rest, and its lift changes with the least motion.
knows_rest = pytest.mark.skipif(b"anchored" not in WEIGHTS[:1000], reason="the weights know no rest")
#: Steps of a hull that touches nothing: a hundredth of its period.
AFLOAT_S = 0.01
#: Added mass in heave over the mass of the displaced water, which is the body's own where it floats.
HEAVE = 1.5
ADDED_MASS = {"added_mass": {"heave": HEAVE}}
# along x so strong that a hull comes to the water's speed in about a second
DAMPING = {"linear_damping": {"surge": 0.5}}


@contextmanager
def clients_of(folder: Path, effects: dict[str, dict[str, float]]) -> Iterator[wade.ShmClient]:
    server = Server(folder)
    server.start(copy_with(effects, folder / "vehicles", VEHICLES))
    try:
        with wade.ShmClient(server.namespace, timeout_s=20.0) as client:
            yield client
    finally:
        server.stop()


@pytest.fixture
def client(server: Server) -> Iterator[wade.ShmClient]:
    with wade.ShmClient(server.namespace, timeout_s=20.0) as client:
        yield client


@pytest.fixture(scope="module")
def inertial(tmp_path_factory: pytest.TempPathFactory) -> Iterator[wade.ShmClient]:
    """Of a server whose vehicles have an added mass."""
    with clients_of(tmp_path_factory.mktemp("inertial"), ADDED_MASS) as client:
        yield client


@pytest.fixture(scope="module")
def damped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[wade.ShmClient]:
    """Of a server whose vehicles have an added mass and a damping."""
    with clients_of(tmp_path_factory.mktemp("damped"), ADDED_MASS | DAMPING) as client:
        yield client


def test_the_clipping_is_right() -> None:
    # all of it lies below a high level: the volume of the tetrahedra of its faces and the origin
    corners = faces()
    whole = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume_below(1.0) == pytest.approx(whole)
    # the public mesh of this vehicle, sealed, floats at 0.378 m; ours displaces the same within 2.5 %
    assert floating_depth() == pytest.approx(0.378, abs=0.01)


@pytest.fixture(scope="module")
def heaving(inertial: wade.ShmClient) -> wading.Track:
    """Let go afloat, with the added mass in the mass matrix."""
    return wading.heave(inertial, floating_depth(), timestep_s=AFLOAT_S)


def afloat() -> Any:
    return wading.build(wading.BASIN, x=0.0, z=-Z0 - floating_depth(), timestep_s=AFLOAT_S)


def speed(track: wading.Track) -> NDArray[np.float64]:
    return np.asarray(np.gradient(track.position[:, 0], track.time))


def test_it_floats_where_hydrostatics_says(damped: wade.ShmClient) -> None:
    model = wading.build(wading.BASIN, x=0.0, z=-Z0 - floating_depth() - 0.02, timestep_s=AFLOAT_S)
    track = wading.run(damped, model, duration_s=4.0)
    settled = track.depth[-100:]
    assert settled.max() - settled.min() < 0.005
    assert settled.mean() == pytest.approx(floating_depth(), abs=0.01)
    assert np.abs(track.pitch).max() < math.radians(6)


def period(track: wading.Track) -> float:
    heave = track.depth - track.depth.mean()
    rising = track.time[1:][(heave[:-1] < 0) & (heave[1:] >= 0)]
    assert len(rising) >= 2
    return float(np.diff(rising).mean())


def test_it_heaves_at_the_period_of_its_waterplane_and_its_inertia(
    client: wade.ShmClient, heaving: wading.Track
) -> None:
    expected = 2 * math.pi * math.sqrt(MASS / (DENSITY * GRAVITY * waterplane_area()))
    alone = period(wading.heave(client, floating_depth(), timestep_s=AFLOAT_S))
    assert alone == pytest.approx(expected, rel=0.12)
    # the water that moves along makes it slower by the root of the masses
    assert period(heaving) == pytest.approx(alone * math.sqrt(1 + HEAVE), rel=0.04)


def test_added_mass_as_a_force_flies_apart_and_in_the_mass_matrix_does_not(
    inertial: wade.ShmClient, heaving: wading.Track
) -> None:
    # let go 2 cm off its depth a hull of this period is never faster than some 0.5 m/s2
    assert np.abs(wading.acceleration(heaving)).max() < 2.0
    explicit = wading.heave(inertial, floating_depth(), explicit=True, timestep_s=AFLOAT_S)
    # it grows from step to step until the edge of the effect's box holds it
    assert np.abs(wading.acceleration(explicit)).max() > 500.0


@knows_rest
def test_there_is_no_energy_from_nowhere(heaving: wading.Track) -> None:
    levels = np.linspace(heaving.depth.min(), heaving.depth.max(), 40)
    lift = DENSITY * GRAVITY * np.array([volume_below(Z0 + level) for level in levels])
    # of weight and buoyancy, by the trapezoidal rule
    steps = np.diff(levels) * ((lift[1:] + lift[:-1]) / 2 - MASS * GRAVITY)
    potential = np.interp(heaving.depth, levels, np.concatenate(([0.0], np.cumsum(steps))))
    kinetic = MASS * (1 + HEAVE) * np.gradient(heaving.depth, heaving.time) ** 2 / 2
    least = np.interp(floating_depth(), levels, np.concatenate(([0.0], np.cumsum(steps))))
    energy = kinetic + potential - least
    assert energy[0] > 0 and energy.max() < 1.15 * energy[0]


@knows_rest
def test_a_push_dies_out(damped: wade.ShmClient) -> None:
    track = wading.run(damped, afloat(), duration_s=3.0, velocity=(1.0,))
    speeds = speed(track)
    assert speeds[1] == pytest.approx(1.0, abs=0.1)
    assert np.diff(speeds).max() < 0.01 and speeds[-1] < 0.2
    assert np.abs(track.position[:, 1]).max() < 0.1


@knows_rest
def test_it_comes_to_the_speed_of_the_current(damped: wade.ShmClient) -> None:
    track = wading.run(damped, afloat(), duration_s=5.0, current=(0.5, 0.0, 0.0))
    # weights may push a hull that rests in the water: by what they do, over the damping
    rest = damped.evaluate(wading.VEHICLE, wade.State(depth_m=floating_depth()))
    moving = damped.evaluate(wading.VEHICLE, wade.State(depth_m=floating_depth(), velocity_mps=(0.1, 0, 0)))
    index = moving.effects.index(wade.Effect.LINEAR_DAMPING)
    drift = rest.force_n[0] / (-moving.effect_force_n[index, 0] / 0.1)
    assert speed(track)[-50:].mean() == pytest.approx(0.5 + drift, abs=0.03)


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
    # water that flows past pushes less than still water: by a sixth here, by up to half in the CFD
    assert 0.6 < deepest[2] / (DENSITY * GRAVITY * volume_below(Z0 + bed)) < 1.0
    assert not track.force[track.depth <= 0].any()
