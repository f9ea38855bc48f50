// The load of the water on a body for one step of a physics engine.
//
// Engines of games step half-implicitly: v += a dt, then x += v dt. Read as a leapfrog, positions are those of the ends of the
// steps and velocities those of their middles, and the load that a step wants is the mean over the time from half a step before
// its beginning to half a step after. That is what `step` gives: it goes back half a step along the reported velocity and
// integrates forward over the whole one, in substeps, each of which is a question. With a step no longer than a substep this is
// one question about the very state that the engine reports, and a float without drag keeps its swing. With a longer one the
// load is not frozen over it: a float that leaves the water in the middle of the step gets half of the impulse. What such a
// step adds is a damping ratio of (w dt)^3 / 48 of a swing of frequency w: 0.0008 for a small rover at 30 frames a second.

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "added_mass.h"
#include "held_answer.h"
#include "link_state.h"

namespace wade {

// As `wade_evaluate`: a question, a budget [ns], room for the answer.
using Ask = std::function<wade_status(const wade_state&, std::uint64_t, wade_forces&)>;
// A steady clock [ns].
using Clock = std::function<std::uint64_t()>;

struct Pacing {
  // Longest time over which one answer counts [s].
  double substep = 1.0 / 120.0;
  // Most questions a step; a longer step has longer substeps.
  int most_substeps = 16;
  // Most time that a step may wait for answers, all its questions together [ns]. 0 never waits: every answer is a step late.
  std::uint64_t budget_ns = 300000;

  // Questions of a step of `time` [s].
  int substeps(double time) const;
};

// One a wheel of the vehicle, by axle from the front, left before right; of four wheels front left, front right, rear left, rear
// right.
struct WheelSpeeds {
  // [rad/s]
  std::array<double, WADE_MAX_WHEELS> speeds{};
  // 0: not known.
  std::uint32_t count = 0;
};

// What the caller knows beside body, motion and water.
struct Surroundings {
  // z of the ground-contact plane in the hull frame [m].
  double z0 = 0.0;
  // No point of the hull is further from its origin [m]: higher above the water nothing is asked.
  double radius = std::numeric_limits<double>::infinity();
  // What pulls at the body before anything is known of the forces on it, world [m/s2].
  Vec3 gravity{0.0, 0.0, -9.81};
  WheelSpeeds wheel_speeds;
  // No water pressure under the contact patches.
  bool dry_contact = false;
  // Share of the motion through the water that is motion over the bed, 0 parked to 1 driving; not given: from the velocities.
  std::optional<double> bed;
  // Number of the run for effects that remember; 0 for none.
  std::uint64_t session = 0;
};

// What to put on the body for the whole step.
struct StepLoad {
  // World [N].
  Vec3 force;
  // About the center of mass, world [N m].
  Vec3 moment;
  // Where the body is in the water at the step's beginning.
  Immersion immersion;
  // Questions asked, and those of them that were answered in time.
  int asked = 0;
  int answered = 0;
};

class Hydrodynamics {
 public:
  Hydrodynamics(Ask ask, Clock clock, Pacing pacing)
      : ask_(std::move(ask)), clock_(std::move(clock)), pacing_(pacing) {}

  // Loads for a step of `time` [s].
  StepLoad step(const Body& body, const Motion& motion, const Water& water, const Surroundings& surroundings,
                double time);

  // The same in parts, for a caller that asks about several vehicles at once (`Fleet`): `begin_step`; then, `substeps` times,
  // `pose`, an answer to `open_question` where there is one, and `advance`; then `end_step`.
  void begin_step(const Body& body, const Motion& motion, const Water& water, const Surroundings& surroundings,
                  double time);
  int substeps() const { return step_.substeps; }
  void pose();
  // Null where the server is not to be asked.
  const wade_state* open_question() const { return open_ ? &open_->state : nullptr; }
  // Asks the open question by itself, within what is left of the budget.
  void ask_alone();
  // What a batch said to the open question; `forces` is null where the batch was not answered.
  void hear(wade_status status, const wade_forces* forces);
  // Leaves the open question and those of the rest of the step unasked.
  void pass_over();
  // What this step may still wait for its answers [ns].
  std::uint64_t budget_left() const { return step_.budget_ns; }
  void spend(std::uint64_t time_ns) { step_.budget_ns -= std::min(time_ns, step_.budget_ns); }
  void advance();
  StepLoad end_step();

  // After a teleport: the velocity of the step before says nothing of forces.
  void begin_anew();

  // Null takes it away.
  void set_rest_table(std::shared_ptr<const RestTable> table) { table_ = std::move(table); }

  LinkState link() const { return monitor_.state(); }

  // What the server last answered; its loads per surface are for drawing.
  const wade_forces& forces() const { return forces_; }

 private:
  struct WaterLoad {
    Vec6 load;
    Mat6 added{};
  };
  // The step under way.
  struct Step {
    Body body;
    Motion motion;
    Water water;
    Surroundings surroundings;
    double time = 0.0;
    int substeps = 0;
    std::uint64_t budget_ns = 0;
    // a server that was late once is not waited for again in this step
    bool silent = false;
    Vec6 others;    // everything that acts but the water, world
    Motion shadow;  // where the body is in the substep
    Immersion immersion;
    Vec6 impulse;
    bool answered = false;
    StepLoad out;
  };
  struct Open {
    wade_state state;
    HeldAnswer::Asked asked;
  };
  struct Sent {
    std::uint64_t time = 0;
    HeldAnswer::Asked asked;
  };

  Vec6 external(const Body& body, const Motion& motion, const Vec3& gravity) const;
  Open question_now() const;
  void count(wade_status status);
  WaterLoad water_load() const;
  bool take(HeldAnswer::Asked asked);
  void take_late(std::uint64_t now);

  Ask ask_;
  Clock clock_;
  Pacing pacing_;
  std::shared_ptr<const RestTable> table_;
  LinkMonitor monitor_;
  HeldAnswer held_;
  wade_forces forces_{};
  std::uint64_t last_answer_ = 0;
  // questions that were not answered in time, so that a late answer finds its own
  // at 1 kHz those of a round trip of 60 ms
  std::array<Sent, 64> sent_{};
  std::size_t next_sent_ = 0;
  double unasked_time_ = 0.0;
  Accelerations accelerations_;
  Step step_;
  std::optional<Open> open_;

  struct Before {
    Motion motion;
    Vec6 load;  // world
    double time = 0.0;
  };
  std::optional<Before> before_;
};

}  // namespace wade
