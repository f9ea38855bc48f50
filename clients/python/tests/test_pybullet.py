"""The same floating test in another simulator. PyBullet is a wheel of 100 MB, so it is tested where it is installed."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hydrostatics import DENSITY, GRAVITY, MASS, floating_depth, waterplane_area
from servers import Server

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
floating = pytest.importorskip("pybullet_floating", exc_type=ImportError, reason="pybullet is not installed")


def test_it_floats_where_hydrostatics_says_and_heaves_with_the_water(server: Server) -> None:
    with wade.GrpcClient(server.address, timeout_s=20.0) as rpc:
        vehicle = rpc.vehicle("warthog")
    with wade.ShmClient(server.namespace, timeout_s=20.0) as client:
        depths = floating.let_go(client, vehicle, floating_depth() + 0.03, 6.0)
        still = client.evaluate("warthog", wade.State(depth_m=floating_depth()))
    assert depths[-250:].mean() == pytest.approx(floating_depth(), abs=0.01)
    assert np.ptp(depths[-250:]) < 0.005
    # the first half period, from the turn at the bottom to the turn at the top
    half = floating.TIMESTEP_S * np.argmin(depths[: round(1.5 / floating.TIMESTEP_S)])
    assert still.added_mass is not None
    moved = MASS + still.added_mass[2, 2]
    assert half == pytest.approx(math.pi * math.sqrt(moved / (DENSITY * GRAVITY * waterplane_area())), rel=0.15)
