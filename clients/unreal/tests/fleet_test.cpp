// Vehicles that are asked about together move as those that are asked about one by one.

#include <memory>
#include <string>
#include <vector>

#include "core/fleet.h"
#include "box.h"
#include "expect.h"

using namespace wade;

namespace {

// Boxes of one size with one server, let go at different depths with different pushes.
struct Boxes {
  Box box;
  Planted server;
  Pacing pacing;
  std::vector<std::unique_ptr<Hydrodynamics>> waters;
  std::vector<Motion> motions;
  std::vector<StepLoad> loads;

  Boxes(const Box& of, std::size_t count, Pacing with = {}) : box(of), server(of), pacing(with), loads(count) {
    for (std::size_t i = 0; i < count; ++i) {
      waters.push_back(std::make_unique<Hydrodynamics>(server.ask(), server.clock(), pacing));
      Motion motion;
      motion.position.z = 0.5 * box.height - 0.08 - 0.01 * static_cast<double>(i);
      motion.velocity = {0.1 * static_cast<double>(i), -0.2, 0.0};
      motion.attitude = turn({0.02 * static_cast<double>(i), 0.05, 0.3});
      motions.push_back(motion);
    }
  }

  Surroundings surroundings() const {
    Surroundings around;
    around.z0 = box.z0();
    around.radius = box.radius();
    return around;
  }

  void move(double time) {
    for (std::size_t i = 0; i < motions.size(); ++i) {
      motions[i] = engine_step(box.body(), motions[i], loads[i].force, loads[i].moment, time);
    }
  }

  void step_alone(double time) {
    for (std::size_t i = 0; i < motions.size(); ++i) {
      loads[i] = waters[i]->step(box.body(), motions[i], Water{}, surroundings(), time);
    }
    move(time);
  }
};

// One step of all boxes of all kinds.
void step_together(Fleet& fleet, const std::vector<Boxes*>& kinds, double time) {
  std::vector<Member> members;
  for (Boxes* kind : kinds) {
    for (std::size_t i = 0; i < kind->motions.size(); ++i) {
      members.push_back({kind->waters[i].get(), std::to_string(kind->box.length), kind->server.ask_batch(),
                         kind->box.body(), kind->motions[i], Water{}, kind->surroundings(), {}});
    }
  }
  fleet.step(members, time);
  auto member = members.begin();
  for (Boxes* kind : kinds) {
    for (StepLoad& load : kind->loads) load = (member++)->load;
    kind->move(time);
  }
}

Box rough() {
  Box box;
  box.drag = 90.0;
  box.added_share = 0.8;
  return box;
}

Box longer() {
  Box box = rough();
  box.length = 1.7;
  box.mass = 110.0;
  return box;
}

}  // namespace

TEST(a_fleet_moves_as_its_vehicles_do_alone) {
  for (const double rate : {120.0, 60.0, 20.0}) {
    Boxes alone(rough(), 5), other_alone(longer(), 3), together(rough(), 5), other_together(longer(), 3);
    Fleet fleet(together.server.clock());
    for (int i = 0; i < 90; ++i) {
      alone.step_alone(1.0 / rate);
      other_alone.step_alone(1.0 / rate);
      step_together(fleet, {&together, &other_together}, 1.0 / rate);
    }
    for (const auto& [one, other] : {std::pair(&alone, &together), std::pair(&other_alone, &other_together)}) {
      for (std::size_t i = 0; i < one->motions.size(); ++i) {
        EXPECT_VECTOR(one->motions[i].position, other->motions[i].position, 0.0);
        EXPECT_VECTOR(one->motions[i].angular_velocity, other->motions[i].angular_velocity, 0.0);
        EXPECT(other->waters[i]->link() == LinkState::Serving && other->loads[i].answered == other->loads[i].asked);
      }
    }
  }
}

// Archimedes, for each of the fleet at its own depth.
TEST(each_of_a_fleet_is_lifted_by_its_own_depth) {
  Boxes boxes(Box{}, 6);
  for (Motion& motion : boxes.motions) motion.velocity = {}, motion.attitude = {};
  const std::vector<Motion> before = boxes.motions;
  Fleet fleet(boxes.server.clock());
  step_together(fleet, {&boxes}, 1.0 / 120.0);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double depth = 0.08 + 0.01 * static_cast<double>(i);
    EXPECT_NEAR(boxes.loads[i].force.z, 9810.0 * boxes.box.area() * depth, 1e-3);
  }
}

TEST(a_substep_of_a_fleet_is_one_request_a_name) {
  Boxes boxes(rough(), 7), others(longer(), 2);
  Fleet fleet(boxes.server.clock());
  step_together(fleet, {&boxes, &others}, 1.0 / 120.0);
  EXPECT(boxes.server.batches == 1 && others.server.batches == 1);
  step_together(fleet, {&boxes, &others}, 0.05);
  EXPECT(boxes.server.batches == 1 + 6 && boxes.loads[6].asked == 6);
  EXPECT(boxes.server.alone == 0 && others.server.alone == 0);
}

TEST(one_vehicle_of_a_name_is_asked_about_alone) {
  Boxes one(rough(), 1), others(longer(), 2);
  Fleet fleet(one.server.clock());
  step_together(fleet, {&one, &others}, 1.0 / 120.0);
  EXPECT(one.server.batches == 0 && one.server.alone == 1);
  EXPECT(others.server.batches == 1 && others.server.alone == 0);
}

TEST(a_large_fleet_is_asked_about_in_several_batches) {
  Boxes boxes(Box{}, 2 * Fleet::most_in_batch + 1);
  for (Motion& motion : boxes.motions) motion.position.z = 0.1;
  Fleet fleet(boxes.server.clock());
  step_together(fleet, {&boxes}, 1.0 / 120.0);
  EXPECT(boxes.server.batches == 3 && boxes.server.alone == 0);
  EXPECT(boxes.loads.back().answered == 1);
}

TEST(a_budget_of_zero_asks_no_batches) {
  Pacing never;
  never.budget_ns = 0;
  Boxes boxes(rough(), 3, never);
  Fleet fleet(boxes.server.clock());
  step_together(fleet, {&boxes}, 1.0 / 120.0);
  EXPECT(boxes.server.batches == 0 && boxes.server.alone == 3);
}

// A late batch is lost, so the next step asks alone, where late answers count; and together again once all are in time.
TEST(a_late_batch_is_followed_by_questions_alone) {
  Boxes boxes(rough(), 4);
  const auto table = boxes.server.table();
  for (const auto& water : boxes.waters) water->set_rest_table(table);
  Fleet fleet(boxes.server.clock());
  for (int i = 0; i < 3; ++i) step_together(fleet, {&boxes}, 1.0 / 120.0);
  boxes.server.mode = Planted::Mode::Gone;
  step_together(fleet, {&boxes}, 1.0 / 120.0);
  EXPECT(boxes.server.batches == 4 && boxes.server.alone == 0);
  for (const StepLoad& load : boxes.loads) EXPECT(load.asked == 1 && load.answered == 0 && load.force.z > 0.0);
  for (int i = 0; i < 2; ++i) step_together(fleet, {&boxes}, 1.0 / 120.0);
  EXPECT(boxes.server.batches == 4 && boxes.server.alone == 8);
  boxes.server.mode = Planted::Mode::InTime;
  for (int i = 0; i < 2; ++i) step_together(fleet, {&boxes}, 1.0 / 120.0);
  EXPECT(boxes.server.batches == 5 && boxes.server.alone == 12);
  EXPECT(boxes.waters[0]->link() == LinkState::Serving);
}

// A server that answers a question, then a batch with another load, then nothing: the client gives its last answer again, which is
// no late one.
TEST(an_answer_before_a_batch_is_no_late_one_after_it) {
  std::uint64_t now = 1000;
  bool open = true;
  const Box box;
  const Ask alone = [&](const wade_state& state, std::uint64_t, wade_forces& forces) {
    now += 1000;
    forces = box.answer(state);
    forces.force_n[2] = 5000.0F;
    forces.answer = 1;
    forces.age_ns = now;
    return open ? WADE_STATUS_OK : WADE_STATUS_TIMEOUT;
  };
  Hydrodynamics water(alone, [&now] { return now; }, Pacing{});
  Motion motion;
  motion.position.z = 0.1;
  const auto step = [&](const wade_forces* answer) {
    water.begin_step(box.body(), motion, Water{}, Surroundings{}, 1.0 / 120.0);
    water.pose();
    if (answer != nullptr) {
      water.hear(WADE_STATUS_OK, answer);
    } else {
      water.ask_alone();
    }
    water.advance();
    return water.end_step().force.z;
  };
  EXPECT_NEAR(step(nullptr), 5000.0, 1e-3);
  const wade_forces batched = box.answer(*[&] {
    water.begin_step(box.body(), motion, Water{}, Surroundings{}, 1.0 / 120.0);
    water.pose();
    return water.open_question();
  }());
  const double lift = 9810.0 * box.area() * 0.1;
  EXPECT_NEAR(step(&batched), lift, 1e-3);
  open = false;
  for (int i = 0; i < 12; ++i) EXPECT_NEAR(step(nullptr), lift, 1e-3);
}

// Two names with a budget of 300 us a vehicle. The server takes all the time that it is given by one of them.
TEST(a_slow_name_takes_no_time_from_another) {
  std::uint64_t now = 0, slow_budget = 0, quick_budget = 0;
  const Clock clock = [&now] { return now; };
  const auto boxed = [&now](std::uint64_t& given, std::uint64_t takes, wade_status says) {
    return [&now, &given, takes, says](const wade_state* states, std::size_t count, std::uint64_t budget, wade_forces* forces) {
      given = budget;
      now += std::min(takes, budget);
      for (std::size_t i = 0; i < count; ++i) forces[i] = Box{}.answer(states[i]);
      return says;
    };
  };
  const Ask alone = [](const wade_state&, std::uint64_t, wade_forces&) { return WADE_STATUS_TIMEOUT; };
  std::vector<std::unique_ptr<Hydrodynamics>> waters;
  std::vector<Member> members;
  Surroundings around;
  around.z0 = Box{}.z0();
  for (int i = 0; i < 5; ++i) {
    waters.push_back(std::make_unique<Hydrodynamics>(alone, clock, Pacing{}));
    const bool slow = i < 2;
    members.push_back({waters.back().get(), slow ? "slow" : "quick",
                       slow ? AskBatch(boxed(slow_budget, 1000000, WADE_STATUS_TIMEOUT)) : AskBatch(boxed(quick_budget, 30000, WADE_STATUS_OK)),
                       Box{}.body(), Motion{}, Water{}, around, {}});
  }
  Fleet fleet(clock);
  fleet.step(members, 1.0 / 60.0);
  EXPECT(slow_budget == 2 * 300000 && members[0].load.asked == 1 && members[0].load.answered == 0);
  // two substeps, of which the first has spent 30 us of the three vehicles' 900
  EXPECT(quick_budget == 3 * 300000 - 30000 && members[4].load.answered == 2);
}
