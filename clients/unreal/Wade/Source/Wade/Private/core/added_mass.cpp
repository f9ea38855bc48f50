#include "added_mass.h"

#include <cmath>
#include <cstddef>
#include <utility>

namespace wade {
namespace {

// Gauss with partial pivoting; the matrix is one of inertia, hence positive definite.
Vec6 solve(Mat6 matrix, const Vec6& right) {
  std::array<double, 6> b = flat(right);
  for (std::size_t k = 0; k < 6; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < 6; ++i) {
      if (std::fabs(matrix[i][k]) > std::fabs(matrix[pivot][k])) pivot = i;
    }
    std::swap(matrix[k], matrix[pivot]);
    std::swap(b[k], b[pivot]);
    for (std::size_t i = k + 1; i < 6; ++i) {
      const double factor = matrix[i][k] / matrix[k][k];
      for (std::size_t j = k; j < 6; ++j) matrix[i][j] -= factor * matrix[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = 6; k-- > 0;) {
    for (std::size_t j = k + 1; j < 6; ++j) b[k] -= matrix[k][j] * b[j];
    b[k] /= matrix[k][k];
  }
  return unflat(b);
}

Mat6 with_body(const Mat6& added, const Body& body) {
  Mat6 sum = added;
  for (std::size_t i = 0; i < 3; ++i) {
    sum[i][i] += body.mass;
    sum[3 + i][3] += body.inertia.rows[i].x;
    sum[3 + i][4] += body.inertia.rows[i].y;
    sum[3 + i][5] += body.inertia.rows[i].z;
  }
  return sum;
}

}  // namespace

Mat6 added_mass(const wade_forces& forces, const Vec3& center_of_mass) {
  Mat6 moved{};
  if ((forces.flags & WADE_HAS_ADDED_MASS) == 0) return moved;
  Mat6 served{};
  for (std::size_t i = 0; i < 36; ++i) served[i / 6][i % 6] = static_cast<double>(forces.added_mass[i]);
  // a rate of the body's twist at the center of mass is one at the server's point, and the load there is one here
  const Vec3 about{forces.about_m[0], forces.about_m[1], forces.about_m[2]};
  const Vec3 arm = about - center_of_mass;
  for (std::size_t j = 0; j < 6; ++j) {
    std::array<double, 6> unit{};
    unit[j] = 1.0;
    Vec6 rate = unflat(unit);
    rate.linear += cross(rate.angular, arm);
    Vec6 load = served * rate;
    load.angular += cross(arm, load.linear);
    const auto column = flat(load);
    for (std::size_t i = 0; i < 6; ++i) moved[i][j] = column[i];
  }
  return moved;
}

Response respond(const Body& body, const Mat6& added, const Vec6& water, const Vec6& external, const Vec6& twist) {
  // the matrix goes with the rate of the components in hull axes, which is the acceleration less omega x v
  const Vec6 turning{cross(twist.angular, twist.linear), {}};
  const Vec6 rate = solve(with_body(added, body), water + external - momentum(body, turning));
  return {rate + turning, water - added * rate};
}

}  // namespace wade
