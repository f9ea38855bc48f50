// A Husky afloat over a bed, on its nose, dropped, and in a closed loop with a real server through the client library, which is
// then killed.
//   with_server ADDRESS SERVER-PID

#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "box.h"
#include "expect.h"

using namespace wade;

namespace {

constexpr double frame = 1.0 / 60.0;
constexpr std::uint64_t second_ns = 1000000000;
constexpr std::uint64_t patient_ns = 20000000;  // of a busy machine; a game has less
constexpr double z0 = -0.1845;

std::uint64_t now_ns() {
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
}

// The vehicle file's mass and places; the inertia of a box of its size.
Body husky() {
  Box box;
  box.length = 0.87, box.width = 0.68, box.height = 0.37, box.mass = 50.0;
  Body body = box.body();
  body.center_of_mass = {0.0, 0.0, 0.0133};
  return body;
}

using Client = std::unique_ptr<wade_client, decltype(&wade_client_close)>;

Client open(const char* address, std::uint32_t batch) {
  wade_options options = wade_default_options();
  options.address = address;
  options.vehicle = "husky";
  options.max_batch = batch;
  wade_client* client = nullptr;
  EXPECT(wade_client_open(&options, &client) == WADE_STATUS_OK);
  EXPECT(wade_client_wait(client, 60 * second_ns) == WADE_STATUS_OK);
  return Client(client, &wade_client_close);
}

Hull hull() {
  Hull hull;
  hull.center_of_mass = husky().center_of_mass;
  hull.z0 = z0;
  hull.radius = 0.5 * norm(Vec3{0.868, 0.685, 0.369});
  return hull;
}

std::shared_ptr<const RestTable> table(const char* address) {
  constexpr std::size_t batch = 16;  // as the plugin
  const Client client = open(address, batch);
  const std::vector<wade_state> questions = RestTable::questions(hull());
  std::vector<wade_forces> answers(questions.size());
  for (std::size_t first = 0; first < questions.size(); first += batch) {
    const std::size_t count = std::min(batch, questions.size() - first);
    EXPECT(wade_evaluate_batch(client.get(), &questions[first], count, 10 * second_ns, &answers[first], nullptr) ==
           WADE_STATUS_OK);
  }
  return std::make_shared<const RestTable>(answers, hull());
}

Surroundings surroundings(std::uint64_t session) {
  Surroundings around;
  around.z0 = z0;
  around.radius = hull().radius;
  around.session = session;
  return around;
}

Hydrodynamics hydrodynamics(const Client& client, std::uint64_t budget_ns) {
  Pacing pacing;
  pacing.budget_ns = budget_ns;
  return Hydrodynamics(
      [&client](const wade_state& state, std::uint64_t budget, wade_forces& forces) {
        return wade_evaluate(client.get(), &state, budget, &forces);
      },
      now_ns, pacing);
}

// The answer says which bed it rests on: that of the water afloat over 3 m, and its own, which is near, where none is known. A
// near bed raises the added mass of heave.
void float_over_a_bed(const Client& client) {
  double heave_mass = 0.0;
  for (const std::optional<double> bed : {std::optional<double>(-3.0), std::optional<double>()}) {
    Hydrodynamics water = hydrodynamics(client, patient_ns);
    Motion motion;
    motion.position.z = husky().center_of_mass.z - z0 - 0.202;
    Water over;
    over.bed_height = bed;
    const StepLoad load = water.step(husky(), motion, over, surroundings(2), 1.0 / 120.0);
    EXPECT(load.answered == 1 && (water.forces().flags & WADE_HAS_BASE) != 0);
    const double heave = static_cast<double>(water.forces().added_mass[2 * 6 + 2]);
    std::printf("afloat at %.3f m: clearance %.3f m, added mass of heave %.1f kg\n", load.immersion.depth,
                static_cast<double>(water.forces().bed_clearance_m), heave);
    EXPECT(heave > 1.1 * heave_mass);
    heave_mass = heave;
    EXPECT_NEAR(water.forces().bed_clearance_m, bed ? 3.0 - 0.202 : 0.0, bed ? 1e-5 : 0.1);
    EXPECT_NEAR(water.forces().water_level_m, z0 + 0.202, 1e-6);
  }
}

// On its nose, its middle 0.25 m above the water: the depth is negative, and the lowest 0.21 m are in the water. They lift less
// than a box of their size.
void hang_by_the_nose(const Client& client) {
  Hydrodynamics water = hydrodynamics(client, patient_ns);
  Motion motion;
  motion.attitude = turn(Vec3{0.0, 1.4, 0.0});
  motion.position = Vec3{0.0, 0.0, 0.25} + rotate(motion.attitude, husky().center_of_mass);
  const StepLoad load = water.step(husky(), motion, Water{}, surroundings(3), 1.0 / 120.0);
  std::printf("on its nose: depth %.3f m, lift %.0f N\n", load.immersion.depth, load.force.z);
  EXPECT(load.immersion.depth < 0.0 && load.answered == 1);
  EXPECT_NEAR(water.forces().water_level_m, -0.25, 1e-6);
  EXPECT(load.force.z > 20.0 && load.force.z < 9810.0 * 0.685 * 0.369 * 0.21);
  EXPECT(water.link() == LinkState::Serving);
}

// Dropped nose first, with a server that is waited for and with answers a step late: it is asked about in every attitude, keeps
// a bounded motion, and ends afloat.
void drop_on_the_nose(const Client& client, const std::shared_ptr<const RestTable>& rest, std::uint64_t budget_ns) {
  Hydrodynamics water = hydrodynamics(client, budget_ns);
  water.set_rest_table(rest);
  Motion motion;
  motion.attitude = turn(Vec3{0.0, 1.3, 0.0});
  motion.position.z = 0.5;
  double fastest = 0.0;
  int above = 0, asked = 0, answered = 0;
  StepLoad load;
  for (int i = 0; i < static_cast<int>(10.0 / frame); ++i) {
    load = water.step(husky(), motion, Water{}, surroundings(budget_ns > 0 ? 4 : 5), frame);
    motion = engine_step(husky(), motion, load.force, load.moment, frame);
    fastest = std::fmax(fastest, norm(motion.velocity));
    above += load.immersion.depth < 0.0 && load.asked > 0;
    asked += load.asked, answered += load.answered;
    if (budget_ns == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::printf("dropped on its nose, budget %g ms: fastest %.2f m/s, %d steps asked at a depth below 0, ends at %.3f m\n",
              1e-6 * static_cast<double>(budget_ns), fastest, above, load.immersion.height);
  EXPECT(above > 0);
  if (budget_ns > 0) EXPECT(answered > 0.95 * asked);
  // the fall's own speed, and a little of the turn
  EXPECT(fastest < 1.2 * std::sqrt(2.0 * 9.81 * 0.5));
  EXPECT(std::fabs(load.immersion.height) < 0.2 && norm(motion.velocity) < 1.0);
  EXPECT(water.link() != LinkState::Refused);
}

// Four Huskies in one world: asked about in batches they move as alone, each with its own memory of waves.
void float_together(const char* address) {
  constexpr std::size_t vehicles = 4;
  std::vector<Client> clients;
  std::vector<std::unique_ptr<Hydrodynamics>> alone, together;
  int batches = 0;
  for (std::size_t i = 0; i < vehicles; ++i) clients.push_back(open(address, Fleet::most_in_batch));
  Pacing pacing;
  pacing.budget_ns = patient_ns;
  std::vector<Member> members(vehicles);
  std::vector<Motion> lonely(vehicles);
  for (std::size_t i = 0; i < vehicles; ++i) {
    wade_client* const client = clients[i].get();
    const Ask ask = [client](const wade_state& state, std::uint64_t budget, wade_forces& forces) {
      return wade_evaluate(client, &state, budget, &forces);
    };
    alone.push_back(std::make_unique<Hydrodynamics>(ask, now_ns, pacing));
    together.push_back(std::make_unique<Hydrodynamics>(ask, now_ns, pacing));
    lonely[i].position.z = husky().center_of_mass.z - z0 - 0.17 - 0.02 * static_cast<double>(i);
    lonely[i].velocity.x = 0.3 * static_cast<double>(i);
    Member& member = members[i];
    member.hydrodynamics = together[i].get();
    member.group = "husky";
    member.ask_batch = [client, &batches](const wade_state* states, std::size_t size, std::uint64_t budget, wade_forces* forces) {
      ++batches;
      return wade_evaluate_batch(client, states, size, budget, forces, nullptr);
    };
    member.body = husky();
    member.motion = lonely[i];
    member.surroundings = surroundings(200 + i);
  }
  Fleet fleet(now_ns);
  int asked = 0, answered = 0;
  double apart = 0.0;
  for (int i = 0; i < 120; ++i) {
    fleet.step(members, frame);
    for (std::size_t k = 0; k < vehicles; ++k) {
      const StepLoad load = alone[k]->step(husky(), lonely[k], Water{}, surroundings(100 + k), frame);
      lonely[k] = engine_step(husky(), lonely[k], load.force, load.moment, frame);
      members[k].motion = engine_step(husky(), members[k].motion, members[k].load.force, members[k].load.moment, frame);
      asked += members[k].load.asked, answered += members[k].load.answered;
      apart = std::fmax(apart, norm(lonely[k].position - members[k].motion.position));
    }
  }
  std::printf("four together: %d batches for %d questions, %d answered in time; %.1g m from where they are alone\n", batches, asked,
              answered, apart);
  EXPECT(answered > 0.95 * asked && batches * static_cast<int>(vehicles) > 0.9 * asked);
  // a question that was late is answered from the last one: then the paths part a little
  EXPECT(apart < (answered == asked ? 1e-4 : 1e-2));
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) return 2;
  const Client client = open(arguments[1], 0);
  const auto rest = table(arguments[1]);
  float_over_a_bed(client);
  hang_by_the_nose(client);
  drop_on_the_nose(client, rest, patient_ns);
  drop_on_the_nose(client, rest, 0);
  // over gRPC the plugin asks no batches: they have no sessions
  if (std::strncmp(arguments[1], "shm:", 4) == 0) float_together(arguments[1]);

  Hydrodynamics water = hydrodynamics(client, patient_ns);
  water.set_rest_table(rest);
  const Surroundings around = surroundings(1);
  const Body body = husky();
  Motion motion;
  motion.position.z = body.center_of_mass.z - z0 - 0.19;
  motion.velocity.x = 0.5;

  int asked = 0, answered = 0;
  const auto run = [&](double time, double* low, double* high) {
    for (int i = 0; i < static_cast<int>(time / frame); ++i) {
      const StepLoad load = water.step(body, motion, Water{}, around, frame);
      motion = engine_step(body, motion, load.force, load.moment, frame);
      asked += load.asked, answered += load.answered;
      *low = std::fmin(*low, load.immersion.depth), *high = std::fmax(*high, load.immersion.depth);
    }
  };
  double low = 1.0, high = 0.0;
  run(10.0, &low, &high);
  std::printf("served: depth %.3f to %.3f m, speed %.2f m/s, %d of %d answered in time\n", low, high, motion.velocity.x,
              answered, asked);
  EXPECT(water.link() == LinkState::Serving && answered > 0.95 * asked);
  // the sealed hull carries 50 kg at 0.202 m; it is let go at 0.19 m, and the shipped weights know little of heave and drift
  EXPECT(low > 0.15 && high < 0.27);
  EXPECT(norm(motion.velocity) < 1.0);
  const double swing = high - low, speed = std::fabs(motion.velocity.x);

  kill(static_cast<pid_t>(std::atoi(arguments[2])), SIGKILL);
  low = 1.0, high = 0.0;
  run(10.0, &low, &high);
  std::printf("killed: depth %.3f to %.3f m, speed %.2f m/s\n", low, high, motion.velocity.x);
  EXPECT(water.link() == LinkState::Lost);
  EXPECT(low > 0.15 && high < 0.27 && high - low < 1.5 * swing);
  EXPECT(std::fabs(motion.velocity.x) <= speed);
  return failures() == 0 ? 0 : 1;
}
