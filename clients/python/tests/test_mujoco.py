"""The example in MuJoCo, held against hydrostatics of the hull's mesh and closed forms."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hydrostatics import DENSITY, GRAVITY, MASS, Z0, faces, floating_depth, volume_below
from numpy.typing import NDArray
from servers import Server

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import mujoco_wading as wading

#: Steps of a hull that touches nothing: a hundredth of its period.
AFLOAT_S = 0.01
#: Period of the hull afloat over deep water by a panel method (capytaine, 308 panels) [s].
HEAVE_PERIOD_S = 1.43


@pytest.fixture(scope="module")
def client(server: Server) -> Iterator[wade.ShmClient]:
    with wade.ShmClient(server.namespace, timeout_s=20.0) as client:
        yield client


def test_the_clipping_is_right() -> None:
    # all of it lies below a high level: the volume of the tetrahedra of its faces and the origin
    corners = faces()
    whole = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume_below(1.0) == pytest.approx(whole)
    # the public mesh of this vehicle, sealed, floats at 0.378 m; ours displaces the same within 2.5 %
    assert floating_depth() == pytest.approx(0.378, abs=0.01)


@pytest.fixture(scope="module")
def heaving(client: wade.ShmClient) -> wading.Track:
    """Let go afloat, with the added mass in the mass matrix."""
    return wading.heave(client, floating_depth(), timestep_s=AFLOAT_S)


def afloat() -> Any:
    return wading.build(wading.BASIN, x=0.0, z=-Z0 - floating_depth(), timestep_s=AFLOAT_S)


def speed(track: wading.Track) -> NDArray[np.float64]:
    return np.asarray(np.gradient(track.position[:, 0], track.time))


def test_it_floats_where_hydrostatics_says(client: wade.ShmClient) -> None:
    model = wading.build(wading.BASIN, x=0.0, z=-Z0 - floating_depth() - 0.02, timestep_s=AFLOAT_S)
    track = wading.run(client, model, duration_s=6.0)
    settled = track.depth[-100:]
    assert settled.max() - settled.min() < 0.005
    assert settled.mean() == pytest.approx(floating_depth(), abs=0.01)
    assert np.abs(track.pitch).max() < math.radians(6)


def period(track: wading.Track) -> float:
    # between the first two turning points on one side
    falls = np.diff(track.depth) < 0
    turns = track.time[1:-1][falls[:-1] != falls[1:]]
    return float(turns[2] - turns[0])


def test_it_heaves_nearly_at_the_period_of_the_panel_method(heaving: wading.Track) -> None:
    # the shipped table is an estimate
    assert period(heaving) == pytest.approx(HEAVE_PERIOD_S, rel=0.2)


def test_added_mass_as_a_force_does_what_the_mass_matrix_does(client: wade.ShmClient, heaving: wading.Track) -> None:
    # let go 2 cm off its depth a hull of this period is never faster than some 0.5 m/s2
    explicit = wading.heave(client, floating_depth(), explicit=True, timestep_s=AFLOAT_S)
    for track in (heaving, explicit):
        assert np.abs(wading.acceleration(track)).max() < 1.0
    assert np.abs(explicit.depth - heaving.depth).max() < 0.004


def test_there_is_no_energy_from_nowhere(client: wade.ShmClient, heaving: wading.Track) -> None:
    levels = np.linspace(heaving.depth.min(), heaving.depth.max(), 40)
    lift = DENSITY * GRAVITY * np.array([volume_below(Z0 + level) for level in levels])
    # of weight and buoyancy, by the trapezoidal rule
    steps = np.diff(levels) * ((lift[1:] + lift[:-1]) / 2 - MASS * GRAVITY)
    potential = np.interp(heaving.depth, levels, np.concatenate(([0.0], np.cumsum(steps))))
    still = client.evaluate(wading.VEHICLE, wade.State(depth_m=floating_depth()))
    assert still.added_mass is not None
    moved = MASS + still.added_mass[2, 2]
    kinetic = moved * np.gradient(heaving.depth, heaving.time) ** 2 / 2
    least = np.interp(floating_depth(), levels, np.concatenate(([0.0], np.cumsum(steps))))
    energy = kinetic + potential - least
    assert energy[0] > 0 and energy.max() < 1.02 * energy[0] and energy[-1] < 0.2 * energy[0]


def test_a_push_dies_out(client: wade.ShmClient) -> None:
    track = wading.run(client, afloat(), duration_s=3.0, velocity=(1.0,))
    speeds = speed(track)
    assert speeds[1] == pytest.approx(1.0, abs=0.1)
    assert np.diff(speeds).max() < 0.01 and speeds[-1] < 0.4
    assert np.abs(track.position[:, 1]).max() < 0.1


def test_it_comes_to_the_speed_of_the_current(client: wade.ShmClient) -> None:
    track = wading.run(client, afloat(), duration_s=8.0, current=(0.5, 0.0, 0.0))
    speeds = speed(track)
    # quadratic drag: it lags behind as 1 / (1 + t / T)
    assert np.diff(speeds).min() > -0.01
    assert 0.3 < speeds[-50:].mean() < 0.5


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
    # the nose gets wet before the water is under the body's origin, and no step brings more than a little
    assert track.force[(track.depth < 0) & (track.position[:, 0] < 0)].any()
    steps = np.linalg.norm(np.diff(track.force, axis=0), axis=1)
    assert steps.max() < 0.02 * MASS * GRAVITY
