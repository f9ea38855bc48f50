// A simulator's loop of 1 ms with a budget of 200 us for the water, in C++: it keeps its pace whatever the server does, and uses
// the last forces while they are young. Kill the server while it runs, and start it again.
//
//   loop [ADDRESS [SECONDS]]      "shm:wade" for 2 s unless told otherwise

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "wade_client.hpp"

int main(int argc, char **argv) {
  using namespace std::chrono_literals;
  using clock = std::chrono::steady_clock;
  const double seconds = argc > 2 ? std::atof(argv[2]) : 2.0;

  wade::Client client;
  if (const auto status = client.open(argc > 1 ? argv[1] : "shm:wade", "husky"); status != wade::Status::ok) {
    std::fprintf(stderr, "%s\n", wade::message(status));
    return 1;
  }
  static wade::Forces forces;
  wade::State state = wade::state(0.15F);
  state.session = 1;  // one run: effects that remember move on by the step
  state.time_step_s = 1e-3F;
  int fresh = 0, aged = 0, without = 0;
  const auto start = clock::now();
  auto next = start;
  while (next - start < std::chrono::duration<double>(seconds)) {
    state.velocity_mps[0] = 0.8F;
    const auto status = client.evaluate(state, 200us, forces);
    const auto age = wade::age(forces);
    if (status == wade::Status::ok) {
      ++fresh;
    } else if (age && *age < 20ms) {
      ++aged;
    } else {
      ++without;  // too old to be true: a simulator would let the vehicle float on hydrostatics, or pause
    }
    next += 1ms;
    std::this_thread::sleep_until(next);
  }
  std::printf("%d steps with fresh forces, %d with aged ones, %d without\n", fresh, aged, without);
  return fresh > 0 ? 0 : 1;
}
