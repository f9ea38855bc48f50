// Time of a physics step of 1, 4 and 16 Huskies in one world: asked about one by one, and together. Nothing here fails on a time.
//   step_time ADDRESS [STEPS]

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "core/fleet.h"

using namespace wade;

namespace {

constexpr double frame = 1.0 / 120.0;  // one question a vehicle and step
constexpr std::uint64_t patient_ns = 50000000;

std::uint64_t now_ns() {
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
}

double microseconds(std::vector<std::uint64_t> times, double share) {
  std::sort(times.begin(), times.end());
  return 1e-3 * static_cast<double>(times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))]);
}

using Client = std::unique_ptr<wade_client, decltype(&wade_client_close)>;

// Afloat at rest, each at a depth of its own.
Member afloat(std::size_t index) {
  Member member;
  member.group = "husky";
  member.body.mass = 50.0;
  member.body.inertia.rows = {Vec3{2.5, 0.0, 0.0}, Vec3{0.0, 3.7, 0.0}, Vec3{0.0, 0.0, 5.1}};
  member.motion.position.z = 0.1845 - 0.16 - 0.005 * static_cast<double>(index);
  member.motion.velocity = {0.5, 0.1, 0.0};
  member.surroundings.z0 = -0.1845;
  member.surroundings.session = 1 + index;
  return member;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) return 2;
  const int steps = count > 2 ? std::atoi(arguments[2]) : 2000;
  Pacing pacing;
  pacing.budget_ns = patient_ns;
  std::printf("%8s %28s %28s  [us]\n", "", "one by one", "together");
  std::printf("%8s %9s %9s %8s %9s %9s %8s\n", "vehicles", "p50", "p95", "p99", "p50", "p95", "p99");
  for (const std::size_t vehicles : {std::size_t{1}, std::size_t{4}, std::size_t{16}}) {
    std::vector<Client> clients;
    std::vector<std::unique_ptr<Hydrodynamics>> waters;
    std::vector<Member> members;
    for (std::size_t i = 0; i < vehicles; ++i) {
      wade_options options = wade_default_options();
      options.address = arguments[1];
      options.vehicle = "husky";
      options.max_batch = Fleet::most_in_batch;
      wade_client* client = nullptr;
      if (wade_client_open(&options, &client) != WADE_STATUS_OK) return 1;
      clients.emplace_back(client, &wade_client_close);
      if (wade_client_wait(client, 60000000000U) != WADE_STATUS_OK) return 1;
      waters.push_back(std::make_unique<Hydrodynamics>(
          [client](const wade_state& state, std::uint64_t budget, wade_forces& forces) {
            return wade_evaluate(client, &state, budget, &forces);
          },
          now_ns, pacing));
      members.push_back(afloat(i));
      members.back().hydrodynamics = waters.back().get();
      members.back().ask_batch = [client](const wade_state* states, std::size_t size, std::uint64_t budget, wade_forces* forces) {
        return wade_evaluate_batch(client, states, size, budget, forces, nullptr);
      };
    }
    Fleet fleet(now_ns);
    std::vector<std::uint64_t> alone, together;
    std::size_t missed = 0;
    // in turns, so that what the machine does else falls on both
    for (int i = 0; i < steps; ++i) {
      std::uint64_t start = now_ns();
      for (Member& member : members) {
        member.load = member.hydrodynamics->step(member.body, member.motion, member.water, member.surroundings, frame);
        missed += member.load.asked - member.load.answered;
      }
      alone.push_back(now_ns() - start);
      start = now_ns();
      fleet.step(members, frame);
      together.push_back(now_ns() - start);
      for (const Member& member : members) missed += member.load.asked - member.load.answered;
    }
    std::printf("%8zu %9.1f %9.1f %8.1f %9.1f %9.1f %8.1f", vehicles, microseconds(alone, 0.5), microseconds(alone, 0.95),
                microseconds(alone, 0.99), microseconds(together, 0.5), microseconds(together, 0.95), microseconds(together, 0.99));
    std::printf(missed > 0 ? "  %zu not answered\n" : "\n", missed);
  }
  return 0;
}
