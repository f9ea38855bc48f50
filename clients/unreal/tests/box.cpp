#include "box.h"

#include <algorithm>
#include <array>
#include <cmath>

using wade::Vec3;

namespace {

constexpr double weight = 9.81;  // of a kilogram [N]

Vec3 vector(const float (&v)[3]) { return {v[0], v[1], v[2]}; }

void store(float (&out)[3], const Vec3& v) {
  out[0] = static_cast<float>(v.x);
  out[1] = static_cast<float>(v.y);
  out[2] = static_cast<float>(v.z);
}

}  // namespace

wade::Body Box::body() const {
  const auto inertia = [this](double a, double b) { return mass * (a * a + b * b) / 12.0; };
  wade::Body body;
  body.mass = mass;
  body.inertia.rows = {Vec3{inertia(width, height), 0.0, 0.0}, Vec3{0.0, inertia(length, height), 0.0},
                       Vec3{0.0, 0.0, inertia(length, width)}};
  return body;
}

wade_forces Box::answer(const wade_state& state) const {
  constexpr int grid = 8;
  const Vec3 up = -vector(state.gravity_direction);
  const bool has_level = (state.flags & WADE_HAS_WATER_LEVEL) != 0;
  const double level = has_level ? static_cast<double>(state.water_level_m) : (z0() + static_cast<double>(state.depth_m)) * up.z;
  const double rho = static_cast<double>(state.density_kgpm3);
  const std::array<double, 3> size{length, width, height}, n{up.x, up.y, up.z};
  std::size_t along = 2;
  for (const std::size_t axis : {1, 0}) {
    if (std::fabs(n[axis]) > std::fabs(n[along])) along = axis;
  }
  const std::size_t first = (along + 1) % 3, second = (along + 2) % 3;
  Vec3 force, moment;
  double volume = 0.0;
  for (int i = 0; i < grid; ++i) {
    for (int j = 0; j < grid; ++j) {
      std::array<double, 3> at{};
      at[first] = size[first] * ((i + 0.5) / grid - 0.5);
      at[second] = size[second] * ((j + 0.5) / grid - 0.5);
      const double end = 0.5 * size[along];
      const double cut =
          std::clamp((level - n[first] * at[first] - n[second] * at[second]) / n[along], -end, end);
      const double low = n[along] > 0.0 ? -end : cut, high = n[along] > 0.0 ? cut : end;
      at[along] = 0.5 * (low + high);
      const double wet = (high - low) * size[first] * size[second] / (grid * grid);
      const Vec3 lift = (rho * weight * wet) * up;
      force += lift;
      moment += cross(Vec3{at[0], at[1], at[2]}, lift);
      volume += wet;
    }
  }
  const double share = volume / (area() * height);
  const Vec3 v = vector(state.velocity_mps) - vector(state.current_mps);
  force += (-drag * share * norm(v)) * v;

  wade_forces forces{};
  store(forces.force_n, force);
  store(forces.moment_nm, moment);
  forces.bundle_version = 7;
  forces.flags = WADE_HAS_BASE;
  forces.water_level_m = static_cast<float>(level);
  forces.bed_clearance_m = state.bed_clearance_m;
  if (added_share > 0.0) {
    forces.flags |= WADE_HAS_ADDED_MASS;
    for (std::size_t i = 0; i < 3; ++i) forces.added_mass[7 * i] = static_cast<float>(added_share * rho * volume);
  }
  return forces;
}

wade::Motion engine_step(const wade::Body& body, const wade::Motion& motion, const Vec3& force, const Vec3& moment,
                         double time) {
  wade::Motion next = motion;
  next.velocity += time * (Vec3{0.0, 0.0, -weight} + (1.0 / body.mass) * force);
  const Vec3 torque = rotate(inverse(motion.attitude), moment);
  const Vec3 spin{torque.x / body.inertia.rows[0].x, torque.y / body.inertia.rows[1].y,
                  torque.z / body.inertia.rows[2].z};
  next.angular_velocity += time * rotate(motion.attitude, spin);
  return wade::drifted(next, time);
}

wade::Ask Planted::ask() {
  return [this](const wade_state& state, std::uint64_t, wade_forces& forces) {
    now_ += 1000;
    ++alone;
    last_question = state;
    if (mode == Mode::Gone) return WADE_STATUS_NO_SERVER;
    const bool late = mode == Mode::Late;
    if (late && !open_) {
      open_ = true, open_question_ = state, open_since_ = now_ - 1000;
      forces.age_ns = WADE_NEVER;
      return WADE_STATUS_TIMEOUT;
    }
    forces = box_.answer(late ? open_question_ : state);
    forces.answer = ++answers_;
    forces.age_ns = late ? now_ - open_since_ : 1000;
    if (late) open_question_ = state, open_since_ = now_ - 1000;
    return late ? WADE_STATUS_TIMEOUT : WADE_STATUS_OK;
  };
}

wade::AskBatch Planted::ask_batch() {
  return [this](const wade_state* states, std::size_t count, std::uint64_t, wade_forces* forces) {
    now_ += 1000;
    ++batches;
    if (mode != Mode::InTime) return mode == Mode::Gone ? WADE_STATUS_NO_SERVER : WADE_STATUS_TIMEOUT;
    for (std::size_t i = 0; i < count; ++i) {
      forces[i] = box_.answer(states[i]);
      forces[i].age_ns = 1000;
    }
    return WADE_STATUS_OK;
  };
}

wade::Clock Planted::clock() {
  return [this] { return now_; };
}

std::shared_ptr<const wade::RestTable> Planted::table() const {
  std::vector<wade_forces> answers;
  for (const wade_state& state : wade::RestTable::questions(box_.hull())) answers.push_back(box_.answer(state));
  return std::make_shared<const wade::RestTable>(answers, box_.hull());
}

Run::Run(const Box& of, double step_time, double depth) : box(of), frame(step_time), server(of) {
  motion.position.z = 0.5 * box.height - depth;
}

void Run::step() {
  wade::Surroundings surroundings;
  surroundings.z0 = box.z0();
  surroundings.radius = box.radius();
  last = water.step(box.body(), motion, surface, surroundings, frame);
  motion = engine_step(box.body(), motion, last.force, last.moment, frame);
}

double Run::energy() const {
  // lift integrated over the depth, level: rho g A d^2 / 2 up to the height, linear beyond
  const double d = std::max(0.0, depth()), in = std::min(d, box.height);
  const double displaced = 1000.0 * weight * box.area() * (0.5 * in * in + box.height * (d - in));
  return 0.5 * box.mass * dot(motion.velocity, motion.velocity) + box.mass * weight * motion.position.z + displaced;
}
