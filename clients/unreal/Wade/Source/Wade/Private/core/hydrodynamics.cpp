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
  StepLoad out;
  out.immersion = immerse(body, motion, water, surroundings.z0);
  const Vec6 others = external(body, motion, surroundings.gravity);
  const int count = std::clamp(static_cast<int>(std::ceil(time / pacing_.substep - 1e-6)), 1, pacing_.most_substeps);
  const double substep = time / count;
  Step step{body, water, surroundings, clock_() + pacing_.budget_ns};

  Motion shadow = drifted(motion, -0.5 * time);
  Vec6 impulse;
  for (int i = 0; i < count; ++i) {
    shadow = drifted(shadow, 0.5 * substep);
    const WaterLoad load = water_load(step, shadow, substep, out);
    const Response response =
        respond(body, load.added, load.load, rotate(inverse(shadow.attitude), others), hull_twist(shadow));
    impulse += substep * rotate(shadow.attitude, response.load);
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
  const Vec6 mean = (1.0 / time) * impulse;
  out.force = mean.linear;
  out.moment = mean.angular;
  before_ = Before{motion, mean, time};
  return out;
}

Hydrodynamics::WaterLoad Hydrodynamics::water_load(Step& step, const Motion& motion, double time, StepLoad& out) {
  const Immersion immersion = immerse(step.body, motion, step.water, step.surroundings.z0);
  held_.pass(time);
  unasked_time_ += time;
  if (immersion.height > step.surroundings.radius) return {};
  if (answered(step, motion, immersion, out)) {
    return {load_about(forces_, step.body.center_of_mass), added_mass(forces_, step.body.center_of_mass)};
  }
  const Vec6 twist = twist_through_water(motion, step.water);
  return {held_.load(step.body, immersion, step.water.density, twist, table_.get()),
          held_.added(immersion, table_.get())};
}

// Whether the server has answered this very state in time, and knows such states.
bool Hydrodynamics::answered(Step& step, const Motion& motion, const Immersion& immersion, StepLoad& out) {
  // a server that was late once is not waited for again in this step
  if (step.silent) return false;
  wade_state state = question(step.body, motion, step.water, immersion, accelerations_);
  state.session = step.surroundings.session;
  state.time_step_s = static_cast<float>(unasked_time_);
  if (step.surroundings.dry_contact) state.flags |= WADE_DRY_CONTACT;
  if (step.surroundings.bed) {
    state.flags |= WADE_HAS_BED;
    state.bed = static_cast<float>(std::clamp(*step.surroundings.bed, 0.0, 1.0));
  }
  const auto& [speeds, count] = step.surroundings.wheel_speeds;
  if (count > 0) {
    state.flags |= WADE_HAS_WHEEL_SPEEDS;
    state.wheel_count = count;
    for (std::size_t i = 0; i < count; ++i) state.wheel_speed_radps[i] = static_cast<float>(speeds[i]);
  }
  const std::uint64_t now = clock_();
  const std::uint64_t budget = now < step.deadline ? step.deadline - now : 0;
  HeldAnswer::Asked asked{immersion, step.water.density, twist_through_water(motion, step.water), {}, {}};
  const wade_status status = ask_(state, budget, forces_);
  monitor_.heard(status, unasked_time_);
  ++out.asked;
  unasked_time_ = 0.0;
  if (status == WADE_STATUS_OK) {
    ++out.answered;
    return take(step.body, asked);
  }
  step.silent = true;
  take_late(step.body, clock_());
  sent_[next_sent_++ % sent_.size()] = {now, asked};
  return false;
}

// Whether the answer counts: weights without the physical base know upright hulls with water over the ground alone.
bool Hydrodynamics::take(const Body& body, HeldAnswer::Asked asked) {
  last_answer_ = forces_.answer;
  const bool usual = upright(asked.immersion) && asked.immersion.depth >= 0.0;
  if (!usual && (forces_.flags & WADE_HAS_BASE) == 0) return false;
  asked.load = load_about(forces_, body.center_of_mass);
  asked.added = added_mass(forces_, body.center_of_mass);
  held_.renew(asked);
  return true;
}

// An answer to a question of an earlier step: its age says which.
void Hydrodynamics::take_late(const Body& body, std::uint64_t now) {
  if (forces_.age_ns == WADE_NEVER || forces_.answer == last_answer_) return;
  const auto asked_at = static_cast<std::int64_t>(now - forces_.age_ns);
  const auto distance = [asked_at](const Sent& sent) {
    const std::int64_t between = static_cast<std::int64_t>(sent.time) - asked_at;
    return between < 0 ? -between : between;
  };
  const auto nearest = std::min_element(
      sent_.begin(), sent_.end(), [&](const Sent& a, const Sent& b) { return distance(a) < distance(b); });
  if (nearest->time != 0) take(body, nearest->asked);
}

}  // namespace wade
