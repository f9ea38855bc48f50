#!/usr/bin/env python3
"""Write the Warthog's hull with other wheels: make_hull.py HULL.stl OUT.stl rounded|cylinder|shipped

The four wheels are the first parts of the shipped hull. They are replaced by bodies of revolution.
`rounded` has the width of Clearpath's wheel at 5, 10, 20, 50 and 75 mm above the ground (0.108,
0.141, 0.180, 0.242, 0.254 m); `cylinder` is 0.254 m wide down to the ground.
"""
import math
import struct
import sys

RADIUS, WIDTH = 0.305, 0.254
CENTERS = [(0.457, 0.5685), (0.457, -0.5685), (-0.457, 0.5685), (-0.457, -0.5685)]
PROFILES = {
    "rounded": [(0.0, 0.075), (0.005, 0.108), (0.010, 0.141), (0.020, 0.180), (0.050, 0.242), (0.075, 0.254)],
    "cylinder": [(0.0, 0.254)],
    "shipped": [(0.0, 0.115), (0.056, 0.254)],
}
SECTORS = 64


def wheel(cx, cy, cz, profile):
    half = [(width / 2, RADIUS - height) for height, width in profile]
    # from one side to the other: (offset across, radius)
    outline = [(-y, r) for y, r in reversed(half)] + half
    ring = lambda y, r: [(cx + r * math.sin(2 * math.pi * i / SECTORS), cy + y, cz + r * math.cos(2 * math.pi * i / SECTORS))
                         for i in range(SECTORS)]
    rings = [ring(y, r) for y, r in outline]
    out = []
    for a, b in zip(rings, rings[1:]):
        for i in range(SECTORS):
            j = (i + 1) % SECTORS
            out += [(a[i], b[i], b[j]), (a[i], b[j], a[j])]
    left, right = (cx, cy + outline[0][0], cz), (cx, cy + outline[-1][0], cz)
    for i in range(SECTORS):
        j = (i + 1) % SECTORS
        out += [(left, rings[0][i], rings[0][j]), (right, rings[-1][j], rings[-1][i])]
    return out


def volume(faces):
    return sum(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
               for a, b, c in faces) / 6


def main():
    source, target, form = sys.argv[1:]
    data = open(source, "rb").read()
    count = struct.unpack("<I", data[80:84])[0]
    faces = []
    for i in range(count):
        v = struct.unpack("<12f", data[84 + 50 * i:132 + 50 * i])[3:]
        faces.append((v[0:3], v[3:6], v[6:9]))
    lowest = min(p[2] for f in faces for p in f)

    def is_wheel(face):
        for cx, cy in CENTERS:
            if all(abs(p[1] - cy) <= WIDTH / 2 + 1e-4 and math.hypot(p[0] - cx, p[2] - lowest - RADIUS) <= RADIUS + 1e-3 for p in face):
                # fenders have no point at these two radii alone
                if all(min(abs(math.hypot(p[0] - cx, p[2] - lowest - RADIUS) - r) for r in (0.0, 0.249, RADIUS)) < 2e-3 for p in face):
                    return True
        return False

    rest = [f for f in faces if not is_wheel(f)]
    wheels = []
    for cx, cy in CENTERS:
        part = wheel(cx, cy, lowest + RADIUS, PROFILES[form])
        if volume(part) < 0:
            part = [(a, c, b) for a, b, c in part]
        wheels += part
    print(f"{count - len(rest)} faces of wheels replaced; wheels displace {1e3 * volume(wheels):.2f} l", file=sys.stderr)
    out = wheels + rest
    with open(target, "wb") as file:
        file.write(b"wade hull, metres".ljust(80, b"\0") + struct.pack("<I", len(out)))
        for face in out:
            file.write(struct.pack("<12fH", 0, 0, 0, *(c for p in face for c in p), 0))


main()
