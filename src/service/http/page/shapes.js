// Triangles and lines from the hull that the server sends, and the few shapes that are drawn beside it.

import { cross, dot, norm, sub, unit } from "./matrix.js";

const corner = (hull, index) => hull.vertices_m.slice(3 * index, 3 * index + 3);

const corners = (hull, face) => [0, 1, 2].map((k) => corner(hull, hull.triangles[3 * face + k]));

/** Position, normal and surface of every corner of every triangle, seven numbers each. */
export function hullTriangles(hull) {
  const out = [];
  hull.triangle_surface.forEach((surface, face) => {
    const [a, b, c] = corners(hull, face);
    const normal = unit(cross(sub(b, a), sub(c, a)));
    for (const point of [a, b, c]) out.push(...point, ...normal, surface);
  });
  return new Float32Array(out);
}

/** The edges between surfaces and those that are sharper than 30 degrees. */
export function hullEdges(hull) {
  const open = new Map();
  const out = [];
  hull.triangle_surface.forEach((surface, face) => {
    const [a, b, c] = corners(hull, face);
    const normal = unit(cross(sub(b, a), sub(c, a)));
    for (let k = 0; k < 3; k++) {
      const [i, j] = [hull.triangles[3 * face + k], hull.triangles[3 * face + ((k + 1) % 3)]];
      const key = i < j ? `${i},${j}` : `${j},${i}`;
      const other = open.get(key);
      if (other === undefined) {
        open.set(key, { surface, normal });
      } else if (other.surface !== surface || dot(other.normal, normal) < Math.cos(Math.PI / 6)) {
        out.push(...corner(hull, i), ...corner(hull, j));
      }
    }
  });
  return new Float32Array(out);
}

/** The surface that a ray meets first (Moeller and Trumbore 1997), or undefined. */
export function surfaceAt(hull, origin, direction) {
  let [nearest, found] = [Infinity, undefined];
  hull.triangle_surface.forEach((surface, face) => {
    const [a, b, c] = corners(hull, face);
    const [ab, ac] = [sub(b, a), sub(c, a)];
    const p = cross(direction, ac);
    const determinant = dot(ab, p);
    if (determinant <= 0) return;
    const s = sub(origin, a);
    const q = cross(s, ab);
    const [u, v, t] = [dot(s, p) / determinant, dot(direction, q) / determinant, dot(ac, q) / determinant];
    if (u >= 0 && v >= 0 && u + v <= 1 && t > 0 && t < nearest) [nearest, found] = [t, surface];
  });
  return found;
}

/** An arrow of length 1 along z: shaft and head, position and normal of every corner. */
export function arrowTriangles(sides = 16) {
  const out = [];
  const ring = (k) => [Math.cos((2 * Math.PI * k) / sides), Math.sin((2 * Math.PI * k) / sides)];
  const profile = [[0, 0], [0.4, 0], [0.4, 0.74], [1, 0.74], [0, 1]];
  for (let part = 0; part + 1 < profile.length; part++) {
    const [[r0, z0], [r1, z1]] = [profile[part], profile[part + 1]];
    for (let k = 0; k < sides; k++) {
      const [[c0, s0], [c1, s1]] = [ring(k), ring(k + 1)];
      const quad = [[r0 * c0, r0 * s0, z0], [r0 * c1, r0 * s1, z0], [r1 * c1, r1 * s1, z1], [r1 * c0, r1 * s0, z1]];
      for (const [i, j, l] of [[0, 1, 2], [0, 2, 3]]) {
        const normal = cross(sub(quad[j], quad[i]), sub(quad[l], quad[i]));
        if (norm(normal) > 0) for (const m of [i, j, l]) out.push(...quad[m], ...unit(normal));
      }
    }
  }
  return new Float32Array(out);
}

/** Lines of a square grid in the plane z = 0, from -half to half. */
export function gridLines(half, step) {
  const out = [];
  const count = Math.round(half / step);
  for (let k = -count; k <= count; k++) {
    out.push(k * step, -count * step, 0, k * step, count * step, 0);
    out.push(-count * step, k * step, 0, count * step, k * step, 0);
  }
  return new Float32Array(out);
}
