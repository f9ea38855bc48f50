"""The same floating test in another simulator. PyBullet is a wheel of 100 MB, so it is tested where it is installed."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hydrostatics import DENSITY, GRAVITY, MASS, floating_depth, waterplane_area
from servers import VEHICLES, Server

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
from effects_by_hand import copy_with

floating = pytest.importorskip("pybullet_floating", exc_type=ImportError, reason="pybullet is not installed")


def test_it_floats_where_hydrostatics_says_and_heaves_with_the_water(mortal_server: Server) -> None:
    effects = {"added_mass": {"heave": 1.5}, "linear_damping": {}}
    mortal_server.start(copy_with(effects, mortal_server.folder / "vehicles", VEHICLES))
    with wade.GrpcClient(mortal_server.address, timeout_s=20.0) as rpc:
        vehicle = rpc.vehicle("warthog")
    with wade.ShmClient(mortal_server.namespace, timeout_s=20.0) as client:
        depths = floating.let_go(client, vehicle, floating_depth() + 0.03, 6.0)
    assert depths[-250:].mean() == pytest.approx(floating_depth(), abs=0.01)
    assert np.ptp(depths[-250:]) < 0.005
    # the first half period, from the turn at the bottom to the turn at the top
    half = floating.TIMESTEP_S * np.argmin(depths[: round(1.5 / floating.TIMESTEP_S)])
    expected = math.pi * math.sqrt(MASS * 2.5 / (DENSITY * GRAVITY * waterplane_area()))
    assert half == pytest.approx(expected, rel=0.12)
