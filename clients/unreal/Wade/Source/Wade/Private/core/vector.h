// Vectors, rotations and rigid-body quantities: plain values in SI units and right-handed frames.

#pragma once

#include <array>
#include <cmath>

namespace wade {

struct Vec3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

constexpr Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(double s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
constexpr Vec3& operator+=(Vec3& a, const Vec3& b) { return a = a + b; }
constexpr double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }

// Unit quaternion.
struct Quat {
  double w = 1.0;
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

constexpr Quat operator*(const Quat& a, const Quat& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
constexpr Quat inverse(const Quat& q) { return {q.w, -q.x, -q.y, -q.z}; }

inline Quat normalized(const Quat& q) {
  const double n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w / n, q.x / n, q.y / n, q.z / n};
}

constexpr Vec3 rotate(const Quat& q, const Vec3& v) {
  const Vec3 u{q.x, q.y, q.z};
  const Vec3 t = 2.0 * cross(u, v);
  return v + q.w * t + cross(u, t);
}

// The turn about the direction of a vector by its length [rad].
inline Quat turn(const Vec3& rotation) {
  const double angle = norm(rotation);
  const double s = angle > 1e-12 ? std::sin(0.5 * angle) / angle : 0.5;
  return normalized({std::cos(0.5 * angle), s * rotation.x, s * rotation.y, s * rotation.z});
}

// 3x3, by rows.
struct Mat3 {
  std::array<Vec3, 3> rows{};
};

constexpr Vec3 operator*(const Mat3& m, const Vec3& v) {
  return {dot(m.rows[0], v), dot(m.rows[1], v), dot(m.rows[2], v)};
}

// R diag(d) R^T
inline Mat3 rotated_diagonal(const Quat& rotation, const Vec3& diagonal) {
  const auto column = [&](const Vec3& e) {
    const Vec3 back = rotate(inverse(rotation), e);
    return rotate(rotation, {diagonal.x * back.x, diagonal.y * back.y, diagonal.z * back.z});
  };
  // symmetric, so that its columns are its rows
  return {{column({1.0, 0.0, 0.0}), column({0.0, 1.0, 0.0}), column({0.0, 0.0, 1.0})}};
}

// A velocity with its angular velocity, or a force with its moment.
struct Vec6 {
  Vec3 linear;
  Vec3 angular;
};

constexpr Vec6 operator+(const Vec6& a, const Vec6& b) { return {a.linear + b.linear, a.angular + b.angular}; }
constexpr Vec6 operator-(const Vec6& a, const Vec6& b) { return {a.linear - b.linear, a.angular - b.angular}; }
constexpr Vec6 operator*(double s, const Vec6& a) { return {s * a.linear, s * a.angular}; }
constexpr Vec6& operator+=(Vec6& a, const Vec6& b) { return a = a + b; }
constexpr double dot(const Vec6& a, const Vec6& b) { return dot(a.linear, b.linear) + dot(a.angular, b.angular); }
inline Vec6 rotate(const Quat& q, const Vec6& v) { return {rotate(q, v.linear), rotate(q, v.angular)}; }

// 6x6, linear part first.
using Mat6 = std::array<std::array<double, 6>, 6>;

constexpr std::array<double, 6> flat(const Vec6& v) {
  return {v.linear.x, v.linear.y, v.linear.z, v.angular.x, v.angular.y, v.angular.z};
}
constexpr Vec6 unflat(const std::array<double, 6>& v) { return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}}; }

inline Vec6 operator*(const Mat6& m, const Vec6& v) {
  const auto in = flat(v);
  std::array<double, 6> out{};
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) out[i] += m[i][j] * in[j];
  }
  return unflat(out);
}

}  // namespace wade
