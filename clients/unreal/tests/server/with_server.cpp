// A Husky afloat in a closed loop with a real server through the client library, which is then killed.
//   with_server ADDRESS SERVER-PID

#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <string>

#include "box.h"
#include "expect.h"

using namespace wade;

namespace {

constexpr double frame = 1.0 / 60.0;
constexpr std::uint64_t second_ns = 1000000000;

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

std::shared_ptr<const RestTable> table(const char* address) {
  const Client client = open(address, 256);
  const std::vector<wade_state> questions = RestTable::questions();
  std::vector<wade_forces> answers(questions.size());
  EXPECT(wade_evaluate_batch(client.get(), questions.data(), questions.size(), 10 * second_ns, answers.data(), nullptr) ==
         WADE_STATUS_OK);
  return std::make_shared<const RestTable>(answers, husky().center_of_mass);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) return 2;
  const Client client = open(arguments[1], 0);
  Pacing pacing;
  pacing.budget_ns = 20000000;  // of a busy machine; a game has less
  Hydrodynamics water(
      [&](const wade_state& state, std::uint64_t budget, wade_forces& forces) {
        return wade_evaluate(client.get(), &state, budget, &forces);
      },
      now_ns, pacing);
  water.set_rest_table(table(arguments[1]));
  Surroundings surroundings;
  surroundings.z0 = -0.1845;
  surroundings.session = 1;
  const Body body = husky();
  Motion motion;
  motion.position.z = body.center_of_mass.z - surroundings.z0 - 0.19;
  motion.velocity.x = 0.5;

  int asked = 0, answered = 0;
  const auto run = [&](double time, double* low, double* high) {
    for (int i = 0; i < static_cast<int>(time / frame); ++i) {
      const StepLoad load = water.step(body, motion, Water{}, surroundings, frame);
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
