#!/usr/bin/env python3
"""What a castellated mesh makes of the wet part of a hull, without meshing.

snappyHexMesh keeps a cell if its center is outside the hull. So the castellated body is the union of
the cells whose centers are inside, and its displaced volume and frontal area follow from sampling.

    staircase.py planes     the state of this set, on the meshes of the campaign and on aligned ones
    staircase.py yaw        error of the displaced volume at 40 random headings and positions
"""
import math
import random
import struct
import sys
from pathlib import Path

VEHICLE = Path(__file__).resolve().parents[3] / "vehicles/husky"
DENSITY, GRAVITY = 1000.0, 9.81


def triangles():
    data = (VEHICLE / "hull.stl").read_bytes()
    count = struct.unpack("<I", data[80:84])[0]
    rows = [struct.unpack("<12f", data[84 + 50 * i:132 + 50 * i])[3:] for i in range(count)]
    lowest = min(v for r in rows for v in (r[2], r[5], r[8]))
    return [[(r[i], r[i + 1], r[i + 2] - lowest) for i in (0, 3, 6)] for r in rows]


def pads(hull):
    """Blocks under the wheels, as the campaign places them: center x, y, half length, half width, height."""
    text = (VEHICLE / "vehicle.toml").read_text()
    out = []
    for part in text.split("[[contact]]")[1:]:
        values = {}
        for line in part.splitlines():
            if "=" in line:
                key, value = line.split("=", 1)
                values[key.strip()] = value.strip()
        center = [float(v) for v in values["center_m"].strip("[]").split(",")]
        width, radius = 0.1143, 0.1778
        half = 0.5 * float(values["area_m2"]) / width
        out.append((center[0], center[1], half, width / 2, radius - math.sqrt(radius**2 - half**2)))
    return out


def turn(point, yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    return (c * point[0] - s * point[1], s * point[0] + c * point[1], point[2])


def columns(hull, yaw, dx, dy, shift):
    """Crossings of the vertical lines through the cell centers with the hull: {(i, j): [z, ...]}."""
    lines = {}
    for tri in hull:
        (x0, y0, z0), (x1, y1, z1), (x2, y2, z2) = (turn(p, yaw) for p in tri)
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(area) < 1e-14:
            continue
        low, high = min(x0, x1, x2), max(x0, x1, x2)
        left, right = min(y0, y1, y2), max(y0, y1, y2)
        for i in range(math.ceil((low - shift[0]) / dx - 0.5), math.floor((high - shift[0]) / dx - 0.5) + 1):
            x = (i + 0.5) * dx + shift[0] + 1.234e-7
            for j in range(math.ceil((left - shift[1]) / dy - 0.5), math.floor((right - shift[1]) / dy - 0.5) + 1):
                y = (j + 0.5) * dy + shift[1] + 2.345e-7
                a = ((x1 - x) * (y2 - y) - (x2 - x) * (y1 - y)) / area
                b = ((x2 - x) * (y0 - y) - (x0 - x) * (y2 - y)) / area
                if a >= 0 and b >= 0 and a + b <= 1:
                    lines.setdefault((i, j), []).append(a * z0 + b * z1 + (1 - a - b) * z2)
    return lines


def body(hull, blocks, level, dx, dy, dz, yaw=0.0, shift=(0.0, 0.0)):
    """Displaced volume [m3], load at rest [N] and wet frontal area [m2] of the castellated body."""
    lines = columns(hull, yaw, dx, dy, shift)
    layers = round(level / dz)
    volume = load = 0.0
    front = set()
    keys = set(lines)
    grounded = {}
    for px, py, hx, hy, top in blocks:
        for i in range(math.floor((px - 1.5 * (hx + hy) - shift[0]) / dx), math.ceil((px + 1.5 * (hx + hy) - shift[0]) / dx)):
            for j in range(math.floor((py - 1.5 * (hx + hy) - shift[1]) / dy), math.ceil((py + 1.5 * (hx + hy) - shift[1]) / dy)):
                x, y = (i + 0.5) * dx + shift[0], (j + 0.5) * dy + shift[1]
                u, v, _ = turn((x, y, 0.0), -yaw)
                if abs(u - px) < hx and abs(v - py) < hy:
                    grounded[i, j] = max(top, grounded.get((i, j), 0.0))
    for key in keys | set(grounded):
        crossings = sorted(lines.get(key, []))
        inside = set()
        for low, high in zip(crossings[::2], crossings[1::2]):
            inside |= {l for l in range(layers) if low < (l + 0.5) * dz < high}
        if key in grounded:
            inside |= {l for l in range(layers) if (l + 0.5) * dz < grounded[key]}
        if not inside:
            continue
        volume += len(inside) * dx * dy * dz
        wet_below = 0.0 if 0 not in inside else level
        load += (len(inside) * dz - wet_below) * dx * dy
        front |= {(key[1], l) for l in inside}
    return volume, DENSITY * GRAVITY * load, len(front) * dy * dz


def planes():
    hull = triangles()
    blocks = pads(hull)
    level = 0.10816
    print("mesh,dx_mm,dy_mm,dz_mm,volume_l,load_at_rest_n,front_m2")
    def row(name, dx, dy, dz):
        v, f, a = body(hull, blocks, level, dx, dy, dz)
        print(f"{name},{1e3 * dx:.2f},{1e3 * dy:.2f},{1e3 * dz:.2f},{1e3 * v:.3f},{f:.2f},{a:.5f}")
    for scale in (1.0, 0.72, 0.5, 0.36):
        cell = 0.868 / 6.1 * scale
        nx, ny, nz = round(6 / cell), round(5 / cell), round(level / (0.42 * cell))
        row(f"campaign {scale}", 6 / nx / 8, 5 / ny / 8, level / nz / 8)
    for scale, nx, ny, nz in ((1.5, 26, 22, 2), (1.0, 39, 33, 3), (0.75, 52, 44, 4), (0.5, 78, 66, 6)):
        row(f"aligned {scale}", 5.93667 / nx / 8, 5.02333 / ny / 8, level / nz / 8)
    row("exact", 0.001, 0.0001142, level / 200) if "--exact" in sys.argv else None


def yawed():
    hull = triangles()
    blocks = pads(hull)
    chance = random.Random(1)
    level = 0.10816
    v0, f0, a0 = body(hull, blocks, level, 0.002, 0.002, level / 128, 0.3)
    print(f"2 mm cells: {1e3 * v0:.3f} l, {f0:.2f} N")
    for fine, dz in ((0.0179, level / 16), (0.0119, level / 24), (0.0089, level / 32)):
        errors = []
        for _ in range(40):
            yaw = chance.uniform(math.radians(5), math.radians(85))
            v, _, _ = body(hull, blocks, level, fine, fine, dz, yaw, (chance.random() * fine, chance.random() * fine))
            errors.append(100 * (v / v0 - 1))
        rms = math.sqrt(sum(e * e for e in errors) / len(errors))
        print(f"cells {1e3 * fine:.1f} mm: rms {rms:.2f} %, largest {max(map(abs, errors)):.2f} %")


if __name__ == "__main__":
    {"planes": planes, "yaw": yawed}[sys.argv[1]]()
