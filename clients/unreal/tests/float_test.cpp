// A float, a frame rate, and a server that is in time, late or gone.

#include <algorithm>
#include <cmath>

#include "box.h"
#include "expect.h"

using namespace wade;

namespace {

constexpr double water_weight = 9810.0;  // [N/m3]

// Speed at which the bottom of a box that was let go leaves the water, from the energy of its flight.
double exit_speed(const Box& box, double frame, double depth) {
  Run run(box, frame, depth);
  while (run.depth() > -0.01) run.step();
  // velocities are those of the middles of the steps
  const double v = run.motion.velocity.z - 0.5 * frame * 9.81;
  return std::sqrt(v * v + 2.0 * 9.81 * -run.depth());
}

// The same for a force that is asked for once a frame at the state of the frame before, as a game thread does.
double frozen_exit_speed(const Box& box, double frame, double depth) {
  Run run(box, frame, depth);
  wade::Motion before = run.motion;
  while (run.depth() > -0.01) {
    const Immersion immersion = immerse(box.body(), before, Water{}, box.z0());
    Vec3 force;
    if (immersion.depth > 0.0) {
      const wade_forces forces = box.answer(question(box.body(), before, Water{}, immersion, {}));
      force = {forces.force_n[0], forces.force_n[1], forces.force_n[2]};
    }
    before = run.motion;
    run.motion = engine_step(box.body(), run.motion, force, {}, frame);
  }
  return run.motion.velocity.z;
}

// Energy above that of rest, mean of two seconds: at first, and after a time [J].
struct Swing {
  double first, last;
};

double mean_energy(Run& run, double time) {
  double sum = 0.0;
  const int steps = static_cast<int>(time / run.frame);
  for (int i = 0; i < steps; ++i) {
    run.step();
    sum += run.energy();
  }
  return sum / steps;
}

Swing bob(Run& run, double seconds) {
  const double floating = run.box.mass / (1000.0 * run.box.area());
  const double rest = 0.5 * water_weight * run.box.area() * floating * floating +
                      run.box.mass * 9.81 * (0.5 * run.box.height - floating);
  Swing swing{};
  swing.first = mean_energy(run, 2.0) - rest;
  for (double t = 0.0; t < seconds; t += run.frame) run.step();
  swing.last = mean_energy(run, 2.0) - rest;
  return swing;
}

}  // namespace

// m v^2 / 2 = work of the lift on the way up less the weight's.
TEST(a_float_leaves_the_water_with_its_energy_at_any_frame_rate) {
  const Box box;
  const double depth = 2.0;
  const double work = water_weight * box.area() * box.height * (depth - 0.5 * box.height) - box.mass * 9.81 * depth;
  const double wanted = std::sqrt(2.0 * work / box.mass);
  for (const double rate : {240.0, 60.0, 30.0, 10.0}) {
    const double speed = exit_speed(box, 1.0 / rate, depth);
    std::printf("  %3.0f fps: leaves at %.2f m/s (closed form %.2f, frozen over the frame %.2f)\n", rate, speed, wanted,
                frozen_exit_speed(box, 1.0 / rate, depth));
    EXPECT_NEAR(speed, wanted, 0.03 * wanted);
  }
  // what is guarded against is there to see
  EXPECT(frozen_exit_speed(box, 0.1, depth) > 1.1 * wanted);
}

TEST(a_float_with_drag_leaves_the_water_alike_at_any_frame_rate) {
  Box box;
  box.drag = 150.0;
  const double fine = exit_speed(box, 1.0 / 1000.0, 2.0);
  for (const double rate : {60.0, 30.0, 10.0}) EXPECT_NEAR(exit_speed(box, 1.0 / rate, 2.0), fine, 0.05 * fine);
}

// With one question a step nothing is lost; a longer step w dt = theta damps by a ratio of theta^3 / 48, and never pumps.
TEST(a_float_without_drag_bobs_on_for_a_minute) {
  const Box box;
  const double w = std::sqrt(water_weight * box.area() / box.mass), time = 60.0;
  for (const double rate : {120.0, 60.0, 30.0}) {
    Run run(box, 1.0 / rate, 0.13);
    const Swing swing = bob(run, time);
    const double theta = rate > 119.0 ? 0.0 : w / rate;
    EXPECT_NEAR(swing.last / swing.first, std::exp(-w * time * theta * theta * theta / 24.0), 0.03);
  }
}

// rho g A = m w^2: the period of a small heave.
TEST(a_float_bobs_with_the_period_of_its_waterplane) {
  const Box box;
  const double period = 2.0 * std::acos(-1.0) * std::sqrt(box.mass / (water_weight * box.area()));
  for (const double rate : {120.0, 60.0, 30.0}) {
    Run run(box, 1.0 / rate, 0.105);
    int crossings = 0;
    double first = 0.0, last = 0.0, before = run.depth() - 0.1;
    for (int i = 0; i < static_cast<int>(20.0 * rate); ++i) {
      run.step();
      const double now = run.depth() - 0.1;
      if (before < 0.0 && now >= 0.0) {
        last = (i + before / (before - now)) / rate;
        if (crossings++ == 0) first = last;
      }
      before = now;
    }
    EXPECT_NEAR((last - first) / (crossings - 1), period, 0.02 * period);
  }
}

// A box that is led up and forward, each answer a step late: buoyancy must be that of where it is, drag that of the question
// which was answered.
TEST(a_late_answer_finds_its_question) {
  Box box;
  box.drag = 100.0;
  const double frame = 1.0 / 120.0, rise = 0.5, speed = std::sqrt(1.25);
  Run run(box, frame, 0.3);
  run.server.mode = Planted::Mode::Late;
  run.water.set_rest_table(run.server.table());
  run.motion.velocity = {1.0, 0.0, rise};
  for (int i = 0; i < 5; ++i) {
    const Motion led = drifted(run.motion, frame);
    const double depth = run.depth(), wet_then = (depth + rise * frame) / box.height;
    run.step();
    run.motion = led;
    if (i == 0) continue;
    EXPECT_NEAR(run.last.force.x, -box.drag * wet_then * speed, 0.05);
    EXPECT_NEAR(run.last.force.z, water_weight * box.area() * depth - box.drag * wet_then * speed * rise, 0.05);
  }
}

TEST(answers_a_step_late_give_a_float_no_energy) {
  for (const double rate : {60.0, 30.0}) {
    Run run(Box{}, 1.0 / rate, 0.13);
    run.server.mode = Planted::Mode::Late;
    run.water.set_rest_table(run.server.table());
    const Swing swing = bob(run, 40.0);
    EXPECT(swing.last < 1.05 * swing.first);
    EXPECT(run.last.answered == 0 && run.last.asked == 1);
    EXPECT(run.water.link() == LinkState::Stale);
  }
}

// The same answers held as they are pump it: a lag t has a damping ratio of -w t / 2, so that the swing grows with e^(w^2 t T / 2).
TEST(the_same_answers_frozen_would_pump_it) {
  const Box box;
  const double stiffness = water_weight * box.area(), frame = 1.0 / 60.0, time = 3.0;
  Run run(box, frame, 0.101);
  double before = stiffness * 0.101, largest = 0.0;
  for (int i = 0; i < static_cast<int>(time / frame); ++i) {
    const double now = stiffness * std::max(0.0, run.depth());
    run.motion = engine_step(box.body(), run.motion, {0.0, 0.0, before}, {}, frame);
    before = now;
    largest = std::max(largest, std::fabs(run.depth() - 0.1));
  }
  const double grown = std::exp(stiffness / box.mass * frame * time / 2.0);
  EXPECT(largest > 0.5 * 0.001 * grown && largest < 2.0 * 0.001 * grown);
}

// A hull with drag, turned loose with a push; the server dies. It must come to rest or bob, and never gain.
TEST(a_server_that_dies_leaves_the_float_afloat_and_slower) {
  Box box;
  box.drag = 80.0;
  Run run(box, 1.0 / 60.0, 0.12);
  run.water.set_rest_table(run.server.table());
  run.motion.velocity.x = 2.0;
  for (int i = 0; i < 30; ++i) run.step();
  run.server.mode = Planted::Mode::Gone;
  double energy = run.energy(), speed = run.motion.velocity.x;
  for (int i = 0; i < 1200; ++i) {
    run.step();
    EXPECT(run.motion.velocity.x <= speed + 1e-9 && run.motion.velocity.x > 0.0);
    speed = run.motion.velocity.x;
    EXPECT(run.energy() < energy + 0.05 * std::fabs(energy));
    EXPECT_NEAR(run.depth(), 0.1, 0.03);
  }
  EXPECT(run.water.link() == LinkState::Lost);
  run.server.mode = Planted::Mode::InTime;
  run.step();
  EXPECT(run.water.link() == LinkState::Serving && run.last.answered == run.last.asked);
}

// A drag that is held after the hull has slowed down must not drive it backwards.
TEST(a_held_drag_never_does_work) {
  Box box;
  box.drag = 400.0;
  HeldAnswer held;
  const Body body = box.body();
  wade_state state = wade_default_state();
  state.depth_m = 0.1F;
  state.velocity_mps[0] = 2.0F;
  const wade_forces forces = box.answer(state);
  Immersion immersion;
  immersion.up = {0.0, 0.0, 1.0};
  immersion.depth = 0.1;
  immersion.height = -(box.z0() + 0.1);
  const Planted server(box);
  const auto table = server.table();
  held.renew({immersion, 1000.0, {{2.0, 0.0, 0.0}, {}}, {{forces.force_n[0], 0.0, forces.force_n[2]}, {}}, {}});
  const Vec6 rest = table->load(immersion, 1000.0);
  for (const Vec6& twist : {Vec6{{2.0, 0.0, 0.0}, {}}, Vec6{{1.0, 0.0, 0.0}, {}}, Vec6{{-1.0, 0.5, 0.0}, {}},
                            Vec6{{0.5, 2.0, -1.0}, {0.3, 0.2, 1.0}}, Vec6{}}) {
    const Vec6 load = held.load(body, immersion, 1000.0, twist, table.get());
    EXPECT(dot(load - rest, twist) <= 1e-9);
  }
  // an answer that pushed forward, such as a wave did, pushes no more
  HeldAnswer pushed;
  pushed.renew({immersion, 1000.0, {{2.0, 0.0, 0.0}, {}}, {{300.0, 0.0, rest.linear.z}, {}}, {}});
  EXPECT(pushed.load(body, immersion, 1000.0, {{1.5, 0.2, 0.0}, {}}, table.get()).linear.x == 0.0);
  // at the very state that was asked, the answer; at half the speed, a quarter of the drag
  EXPECT_NEAR(held.load(body, immersion, 1000.0, {{2.0, 0.0, 0.0}, {}}, table.get()).linear.x, forces.force_n[0], 1e-9);
  EXPECT_NEAR(held.load(body, immersion, 1000.0, {{1.0, 0.0, 0.0}, {}}, table.get()).linear.x, 0.25 * forces.force_n[0], 1e-9);
}

TEST(a_tilted_float_rights_itself_with_a_server_and_without) {
  for (const auto mode : {Planted::Mode::InTime, Planted::Mode::Gone}) {
    Box box;
    box.mass = 60.0;
    Run run(box, 1.0 / 60.0, 0.1);
    run.water.set_rest_table(run.server.table());
    run.step();
    run.server.mode = mode;
    run.motion.attitude = turn(Vec3{0.1, 0.0, 0.0});
    // rolled to one side, the moment turns it back: rho g (I_waterplane - V BG) phi, BG from the center of buoyancy up
    run.step();
    const double volume = box.area() * 0.1, waterplane = box.length * std::pow(box.width, 3) / 12.0;
    const double righting = water_weight * (waterplane - volume * (0.2 - 0.05)) * 0.1;
    EXPECT_NEAR(run.last.moment.x, -righting, 0.05 * righting);
  }
}

// Rolling and pitching at once, let go, for most of a minute: no swing grows, whether answers come in time or a step late.
TEST(a_tilted_float_does_not_swing_further_than_it_was_let_go) {
  for (const auto mode : {Planted::Mode::InTime, Planted::Mode::Late}) {
    for (const double rate : {120.0, 60.0, 30.0}) {
      Run run(Box{}, 1.0 / rate, 0.1);
      run.water.set_rest_table(run.server.table());
      run.server.mode = mode;
      run.motion.attitude = turn(Vec3{0.15, 0.08, 0.0});
      double first = 0.0, last = 0.0;
      for (int i = 0; i < static_cast<int>(40.0 * rate); ++i) {
        run.step();
        const double tilt = std::acos(rotate(run.motion.attitude, Vec3{0.0, 0.0, 1.0}).z);
        double& largest = i < 5.0 * rate ? first : last;
        if (i < 5.0 * rate || i > 35.0 * rate) largest = std::max(largest, tilt);
        EXPECT(run.depth() > 0.05 && run.depth() < 0.15);
      }
      EXPECT(first < 1.05 * norm(Vec3{0.15, 0.08, 0.0}) && last < 1.05 * first);
    }
  }
}

TEST(what_is_asked_adds_up_to_the_time_that_passes) {
  Run run(Box{}, 0.05, 0.1);
  run.step();
  EXPECT(run.last.asked == 6);
  EXPECT_NEAR(run.server.last_question.time_step_s, 0.05 / 6.0, 1e-7);
  // a hull above the water asks nothing, and the next question brings the time
  run.motion.position.z = 5.0;
  run.step();
  EXPECT(run.last.asked == 0);
  run.motion.position.z = 0.5 * run.box.height - 0.1;
  run.motion.velocity = {};
  run.water.begin_anew();
  run.frame = 1.0 / 120.0;
  run.step();
  EXPECT_NEAR(run.server.last_question.time_step_s, 0.05 + 1.0 / 120.0, 1e-6);
}

// A step no longer than a substep is one question about the very state that the engine reports.
TEST(a_short_step_asks_about_the_state_of_the_engine) {
  Run run(Box{}, 1.0 / 120.0, 0.17);
  run.motion.velocity = {0.8, -0.2, 0.4};
  run.step();
  EXPECT(run.last.asked == 1);
  EXPECT_NEAR(run.server.last_question.water_level_m, 0.17 - 0.5 * run.box.height, 1e-6);
  EXPECT_NEAR(run.server.last_question.velocity_mps[0], 0.8, 1e-6);
  EXPECT((run.server.last_question.flags & WADE_HAS_BED_CLEARANCE) == 0);
}

TEST(a_box_afloat_over_deep_water_is_asked_about_with_its_clearance) {
  Run run(Box{}, 1.0 / 120.0, 0.1);
  run.surface.bed_height = -3.0;
  run.step();
  EXPECT((run.server.last_question.flags & WADE_HAS_BED_CLEARANCE) != 0);
  EXPECT_NEAR(run.server.last_question.bed_clearance_m, 2.9, 1e-6);
  EXPECT_NEAR(run.water.forces().bed_clearance_m, 2.9, 1e-6);
}

TEST(a_share_of_the_bed_is_sent_where_it_is_stated) {
  const Box box;
  Planted server(box);
  Hydrodynamics water(server.ask(), server.clock(), Pacing{});
  Surroundings surroundings;
  surroundings.z0 = box.z0();
  water.step(box.body(), Motion{}, Water{}, surroundings, 1.0 / 120.0);
  EXPECT((server.last_question.flags & WADE_HAS_BED) == 0);
  surroundings.bed = 1.0;
  water.step(box.body(), Motion{}, Water{}, surroundings, 1.0 / 120.0);
  EXPECT((server.last_question.flags & WADE_HAS_BED) != 0);
  EXPECT_NEAR(server.last_question.bed, 1.0, 0.0);
}

// Nose down by 60 degrees, its middle 0.3 m above the water, so that its depth is negative: the nose is in the water, and the
// load is that of the server for the very level.
TEST(a_tilted_box_with_its_middle_above_the_water_is_lifted_by_its_nose) {
  Run run(Box{}, 1.0 / 120.0, 0.1);
  run.motion.attitude = turn(Vec3{0.0, std::acos(0.5), 0.0});
  run.motion.position.z = 0.3;
  const wade_forces wanted = run.box.answer([&] {
    wade_state state = wade_default_state();
    state.flags = WADE_HAS_WATER_LEVEL;
    state.water_level_m = -0.3F;
    state.gravity_direction[0] = std::sqrt(0.75F);
    state.gravity_direction[2] = -0.5F;
    return state;
  }());
  run.step();
  EXPECT(run.last.immersion.depth < 0.0 && run.last.asked == 1 && run.last.answered == 1);
  EXPECT_NEAR(run.server.last_question.water_level_m, -0.3, 1e-6);
  const Vec3 force{wanted.force_n[0], wanted.force_n[1], wanted.force_n[2]};
  EXPECT(norm(force) > 50.0);
  EXPECT_VECTOR(run.last.force, rotate(turn(Vec3{0.0, std::acos(0.5), 0.0}), force), 0.01);
  // nose down: it is pushed up at the front, which is a negative pitch
  EXPECT(run.last.moment.y < -10.0);
  EXPECT(run.water.link() == LinkState::Serving);
}

// On its nose the box floats with its middle a quarter of a meter above the water. It goes on so when the server dies; when
// there was no time for a table and it rises, it falls back.
TEST(a_box_on_its_nose_stays_afloat_without_a_server) {
  for (const bool has_table : {true, false}) {
    Box box;
    box.drag = 80.0;
    Run run(box, 1.0 / 60.0, 0.1);
    run.motion.attitude = turn(Vec3{0.0, std::acos(0.0), 0.0});
    run.motion.position.z = 0.25;
    if (has_table) run.water.set_rest_table(run.server.table());
    for (int i = 0; i < 5; ++i) run.step();
    EXPECT(run.last.answered > 0);
    EXPECT_NEAR(run.last.force.z, box.mass * 9.81, 1.0);
    run.server.mode = Planted::Mode::Gone;
    if (!has_table) run.motion.velocity.z = 0.2;
    for (int i = 0; i < 180; ++i) {
      run.step();
      run.motion.angular_velocity = {};
      if (has_table) EXPECT_NEAR(run.motion.position.z, 0.25, 0.02);
    }
    EXPECT(run.motion.position.z < 0.27);
    EXPECT(run.water.link() == LinkState::Lost);
  }
}

// Led up on its nose, each answer a step late: the lift is that of where it is, though it does work.
TEST(a_late_answer_lifts_a_box_that_rises_on_its_nose) {
  const Box box;
  const double frame = 1.0 / 120.0, rise = 0.4;
  Run run(box, frame, 0.1);
  run.server.mode = Planted::Mode::Late;
  run.water.set_rest_table(run.server.table());
  run.motion.attitude = turn(Vec3{0.0, std::acos(0.0), 0.0});
  run.motion.position.z = 0.1;
  run.motion.velocity.z = rise;
  for (int i = 0; i < 20; ++i) {
    const Motion led = drifted(run.motion, frame);
    const double wet = 0.5 * box.length - run.motion.position.z;
    run.step();
    run.motion = led;
    if (i > 0) EXPECT_NEAR(run.last.force.z, water_weight * box.width * box.height * wet, 20.0);
  }
}

// Weights without the physical base know nothing of a hull on its nose.
TEST(an_answer_without_the_physical_base_counts_for_upright_hulls_alone) {
  const Box box;
  wade_state last{};
  Hydrodynamics water(
      [&](const wade_state& state, std::uint64_t, wade_forces& forces) {
        last = state;
        forces = box.answer(state);
        forces.flags = 0;
        return WADE_STATUS_OK;
      },
      [] { return std::uint64_t{1}; }, Pacing{});
  Surroundings surroundings;
  surroundings.z0 = box.z0();
  Motion motion;
  motion.attitude = turn(Vec3{0.0, 1.5, 0.0});
  EXPECT_NEAR(norm(water.step(box.body(), motion, Water{}, surroundings, 1.0 / 120.0).force), 0.0, 0.0);
  EXPECT(water.link() == LinkState::Serving);
  motion.attitude = {};
  water.begin_anew();
  EXPECT(water.step(box.body(), motion, Water{}, surroundings, 1.0 / 120.0).force.z > 1000.0);
}
