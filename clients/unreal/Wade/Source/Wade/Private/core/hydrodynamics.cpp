#include "hydrodynamics.h"

#include <algorithm>
#include <utility>

namespace wade {
namespace {

// Changes of velocity within a step that no force of a vehicle makes: somebody has set it [m/s, rad/s].
constexpr double set_velocity = 5.0;
constexpr double set_angular_velocity = 15.0;

Vec6 load_about(const wade_forces& forces, const Vec3& center_of_mass) {
  const Vec3 force{forces.force_n[0], forces.force_n[1], forces.force_n[2]};
  const Vec3 moment{forces.moment_nm[0], forces.moment_nm[1], forces.moment_nm[2]};
  const Vec3 about{forces.about_m[0], forces.about_m[1], forces.about_m[2]};
  return {force, moment + cross(about - center_of_mass, force)};
}

Vec3 world_momentum(const Body& body, const Motion& motion) {
  return rotate(motion.attitude, body.inertia * rotate(inverse(motion.attitude), motion.angular_velocity));
}

}  // namespace

int Pacing::substeps(double time) const {
  return std::clamp(static_cast<int>(std::ceil(time / substep - 1e-6)), 1, most_substeps);
}

void Hydrodynamics::begin_anew() {
  before_.reset();
  held_.forget();
  accelerations_ = {};
}

// Everything that acts on the body but the water, world: what it was in the step before, or gravity.
Vec6 Hydrodynamics::external(const Body& body, const Motion& motion, const Vec3& gravity) const {
  const Vec6 weight{body.mass * gravity, {}};
  if (!before_ || before_->time <= 0.0) return weight;
  const Vec3 change = motion.velocity - before_->motion.velocity;
  const Vec3 turn_change = motion.angular_velocity - before_->motion.angular_velocity;
  if (norm(change) > set_velocity || norm(turn_change) > set_angular_velocity) return weight;
  Motion turned = motion;
  turned.angular_velocity = turn_change;
  const double rate = 1.0 / before_->time;
  return Vec6{rate * body.mass * change, rate * world_momentum(body, turned)} - before_->load;
}

StepLoad Hydrodynamics::step(const Body& body, const Motion& motion, const Water& water,
                             const Surroundings& surroundings, double time) {
  begin_step(body, motion, water, surroundings, time);
  for (int i = 0; i < substeps(); ++i) {
    pose();
    if (open_question() != nullptr) ask_alone();
    advance();
  }
  return end_step();
}

void Hydrodynamics::begin_step(const Body& body, const Motion& motion, const Water& water,
                               const Surroundings& surroundings, double time) {
  step_ = {};
  step_.body = body;
  step_.motion = motion;
  step_.water = water;
  step_.surroundings = surroundings;
  step_.time = time;
  step_.substeps = pacing_.substeps(time);
  step_.budget_ns = pacing_.budget_ns;
  step_.others = external(body, motion, surroundings.gravity);
  step_.shadow = drifted(motion, -0.5 * time);
  step_.out.immersion = immerse(body, motion, water, surroundings.z0);
}

void Hydrodynamics::pose() {
  const double substep = step_.time / step_.substeps;
  step_.shadow = drifted(step_.shadow, 0.5 * substep);
  step_.immersion = immerse(step_.body, step_.shadow, step_.water, step_.surroundings.z0);
  step_.answered = false;
  held_.pass(substep);
  unasked_time_ += substep;
  open_.reset();
  if (!step_.silent && step_.immersion.height <= step_.surroundings.radius) open_ = question_now();
}

void Hydrodynamics::ask_alone() {
  const std::uint64_t now = clock_();
  const wade_status status = ask_(open_->state, step_.budget_ns, forces_);
  spend(clock_() - now);
  const HeldAnswer::Asked asked = open_->asked;
  count(status);
  if (status == WADE_STATUS_OK) {
    step_.answered = take(asked);
    return;
  }
  take_late(clock_());
  sent_[next_sent_++ % sent_.size()] = {now, asked};
}

void Hydrodynamics::hear(wade_status status, const wade_forces* forces) {
  const HeldAnswer::Asked asked = open_->asked;
  count(status);
  if (status != WADE_STATUS_OK) return;
  forces_ = *forces;
  step_.answered = take(asked);
}

void Hydrodynamics::pass_over() {
  open_.reset();
  step_.silent = true;
}

void Hydrodynamics::advance() {
  const double substep = step_.time / step_.substeps;
  const Body& body = step_.body;
  Motion& shadow = step_.shadow;
  open_.reset();
  const WaterLoad load = water_load();
  const Response response =
      respond(body, load.added, load.load, rotate(inverse(shadow.attitude), step_.others), hull_twist(shadow));
  step_.impulse += substep * rotate(shadow.attitude, response.load);
  const Vec6 change = substep * rotate(shadow.attitude, response.acceleration);
  shadow.velocity += change.linear;
  shadow.angular_velocity += change.angular;
  shadow = drifted(shadow, 0.5 * substep);

  const Vec6 twist = hull_twist(shadow);
  const Vec3 arm = -body.center_of_mass;
  accelerations_.angular = response.acceleration.angular;
  accelerations_.linear = response.acceleration.linear + cross(response.acceleration.angular, arm) +
                          cross(twist.angular, cross(twist.angular, arm));
}

StepLoad Hydrodynamics::end_step() {
  const Vec6 mean = (1.0 / step_.time) * step_.impulse;
  step_.out.force = mean.linear;
  step_.out.moment = mean.angular;
  before_ = Before{step_.motion, mean, step_.time};
  return step_.out;
}

Hydrodynamics::WaterLoad Hydrodynamics::water_load() const {
  if (step_.immersion.height > step_.surroundings.radius) return {};
  if (step_.answered) {
    return {load_about(forces_, step_.body.center_of_mass), added_mass(forces_, step_.body.center_of_mass)};
  }
  const Vec6 twist = twist_through_water(step_.shadow, step_.water);
  return {held_.load(step_.body, step_.immersion, step_.water.density, twist, table_.get()),
          held_.added(step_.immersion, table_.get())};
}

Hydrodynamics::Open Hydrodynamics::question_now() const {
  const Surroundings& surroundings = step_.surroundings;
  wade_state state = question(step_.body, step_.shadow, step_.water, step_.immersion, accelerations_);
  state.session = surroundings.session;
  state.time_step_s = static_cast<float>(unasked_time_);
  if (surroundings.dry_contact) state.flags |= WADE_DRY_CONTACT;
  if (surroundings.bed) {
    state.flags |= WADE_HAS_BED;
    state.bed = static_cast<float>(std::clamp(*surroundings.bed, 0.0, 1.0));
  }
  const auto& [speeds, count] = surroundings.wheel_speeds;
  if (count > 0) {
    state.flags |= WADE_HAS_WHEEL_SPEEDS;
    state.wheel_count = count;
    for (std::size_t i = 0; i < count; ++i) state.wheel_speed_radps[i] = static_cast<float>(speeds[i]);
  }
  return {state,
          {step_.immersion, step_.water.density, twist_through_water(step_.shadow, step_.water), {}, {}}};
}

void Hydrodynamics::count(wade_status status) {
  monitor_.heard(status, unasked_time_);
  ++step_.out.asked;
  unasked_time_ = 0.0;
  if (status == WADE_STATUS_OK) {
    ++step_.out.answered;
  } else {
    step_.silent = true;
  }
}

// Whether the answer counts: weights without the physical base know upright hulls with water over the ground alone.
bool Hydrodynamics::take(HeldAnswer::Asked asked) {
  // answers of a batch have no number
  if (forces_.answer != 0) last_answer_ = forces_.answer;
  const bool usual = upright(asked.immersion) && asked.immersion.depth >= 0.0;
  if (!usual && (forces_.flags & WADE_HAS_BASE) == 0) return false;
  asked.load = load_about(forces_, step_.body.center_of_mass);
  asked.added = added_mass(forces_, step_.body.center_of_mass);
  held_.renew(asked);
  return true;
}

// An answer to a question of an earlier step: its age says which.
void Hydrodynamics::take_late(std::uint64_t now) {
  if (forces_.age_ns == WADE_NEVER || forces_.answer == last_answer_) return;
  const auto asked_at = static_cast<std::int64_t>(now - forces_.age_ns);
  const auto distance = [asked_at](const Sent& sent) {
    const std::int64_t between = static_cast<std::int64_t>(sent.time) - asked_at;
    return between < 0 ? -between : between;
  };
  const auto nearest = std::min_element(
      sent_.begin(), sent_.end(), [&](const Sent& a, const Sent& b) { return distance(a) < distance(b); });
  if (nearest->time == 0) return;
  take(nearest->asked);
  monitor_.heard_late();
}

}  // namespace wade
