// Promise: a server behind a network that takes longer than the budget is answered from, with ages that say so; a connection that
// is cut ends calls with the last forces and a documented status, and the server is found again.

#include <cstring>
#include <thread>

#include "../benches/relay.hpp"
#include "server.hpp"

using namespace test;
using wade::Status;

namespace {

constexpr auto round_trip = 2ms;

wade::State at_depth(int step) {
  wade::State state = wading();
  state.depth_m = 0.12F + 0.0005F * static_cast<float>(step % 100);
  return state;
}

bool same_forces(const wade::Forces &one, const wade::Forces &other) {
  return std::memcmp(one.force_n, other.force_n, sizeof one.force_n) == 0;
}

// The relay lets nothing through early: no answer is younger than the round trip, whatever else the machine does.
void aged_answers(const std::string &address, wade::nanoseconds budget, std::uint64_t session) {
  wade::Client client = connected(address);
  wade::Forces forces, before = {};
  before.age_ns = WADE_NEVER;
  const auto end = clock::now() + patience;
  int aged = 0, answers = 0;
  for (int step = 0; aged < 200 || answers < 20; ++step) {
    CHECK(clock::now() < end);
    wade::State state = at_depth(step);
    state.session = session;
    state.time_step_s = 1e-3F;
    const auto status = client.evaluate(state, budget, forces);
    // a thread that the machine holds up may find its answer there
    CHECK(status == Status::timeout || status == Status::ok);
    const auto age = wade::age(forces);
    if (!age) {
      CHECK(status == Status::timeout && forces.answer == 0 && forces.force_n[2] == 0.0F);
      continue;
    }
    CHECK(*age >= round_trip);
    CHECK(forces.answer >= before.answer && forces.force_n[2] > 0.0F);
    if (status == Status::timeout) ++aged;
    if (forces.answer > before.answer) {
      ++answers;
    } else {
      CHECK(same_forces(forces, before) && forces.age_ns > before.age_ns);
    }
    before = forces;
    std::this_thread::sleep_for(200us);
  }
}

// With a budget beyond the round trip every answer is that of its call.
void answers_in_time(const std::string &address, Server &server) {
  wade::Client client = connected(address), beside = connected(server.tcp());
  wade::Forces forces, expected;
  for (int step = 0; step < 20; ++step) {
    CHECK_EQUAL(client.evaluate(at_depth(step), patience, forces), Status::ok);
    CHECK(*wade::age(forces) >= round_trip);
    CHECK_EQUAL(beside.evaluate(at_depth(step), patience, expected), Status::ok);
    CHECK(same_forces(forces, expected));
  }
}

void cuts(relay::Relay &network, wade::nanoseconds budget, std::uint64_t session) {
  wade::Client client;
  CHECK_EQUAL(client.open(network.address().c_str(), "husky", {WADE_WAIT_BLOCK, 4}), Status::ok);
  CHECK_EQUAL(client.wait(patience), Status::ok);
  wade::State state = wading();
  state.session = session;
  wade::Forces before, forces;
  std::vector<wade::State> states(4, wading());
  std::vector<wade::Forces> batch(4);
  for (int cut = 0; cut < 3; ++cut) {
    until_answered(client, state, before);
    // with a question under way, and without
    if (cut > 0) (void)client.evaluate(state, wade::nanoseconds(0), forces);
    network.cut();
    const auto end = clock::now() + patience;
    for (int gone = 0; gone < 20; before = forces) {
      CHECK(clock::now() < end);
      const auto status = client.evaluate(state, budget, forces);
      CHECK(status == Status::timeout || status == Status::no_server);
      // an answer that was under way may have come before the cut
      CHECK(forces.answer == before.answer ? forces.age_ns > before.age_ns : gone == 0);
      CHECK(same_forces(forces, before));
      gone += status == Status::no_server;
      std::this_thread::sleep_for(1ms);
    }
    CHECK(!client.reason().empty());
    CHECK_EQUAL(client.wait(10ms), Status::no_server);
    CHECK_EQUAL(client.evaluate_batch(states, budget, batch), Status::no_server);
    network.restore();
    CHECK_EQUAL(client.wait(patience), Status::ok);
    // the first answer is that of this call, not of a question of before the cut
    for (const auto limit = clock::now() + patience; client.evaluate(state, patience, forces) != Status::ok;) {
      CHECK(clock::now() < limit);
    }
    CHECK_EQUAL(forces.answer, before.answer + 1);
    CHECK_EQUAL((forces.flags & WADE_SESSION_BEGINS) != 0, session != 0);
  }
  // a client may be closed while it is cut off
  network.cut();
  client.close();
  network.restore();
}

}  // namespace

int main() {
  Server server;
  server.start();
  const int port = std::stoi(server.tcp().substr(server.tcp().rfind(':') + 1));
  relay::Relay network(port, round_trip);
  for (const std::uint64_t session : {std::uint64_t{0}, std::uint64_t{1}}) {
    for (const wade::nanoseconds budget : {wade::nanoseconds(0), wade::nanoseconds(300us)}) {
      aged_answers(network.address(), budget, session);
      cuts(network, budget, session);
    }
  }
  answers_in_time(network.address(), server);
  std::printf("aged answers through a network of 2 ms, and 12 cuts\n");
  return 0;
}
