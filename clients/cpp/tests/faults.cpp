// Promise: whatever happens to the server or to the arguments, a call ends within its budget with a typed status or the last
// forces and their age, and the next good call works.

#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "server.hpp"

using namespace test;
using wade::Status;

namespace {

// What a call may take beyond its budget on a machine that is busy with other things: a call that hangs takes longer.
constexpr auto grace = 20s;

Status timed(wade::Client &client, const wade::State &state, wade::nanoseconds budget, wade::Forces &forces) {
  const auto start = clock::now();
  const auto status = client.evaluate(state, budget, forces);
  CHECK(clock::now() - start < budget + grace);
  return status;
}

bool is_gone(Status status) { return status == Status::timeout || status == Status::no_server; }

void an_absent_server_that_comes(const std::string &address, Server &server) {
  wade::Client client;
  CHECK_EQUAL(client.open(address.c_str(), "husky", {WADE_WAIT_BLOCK, 4}), Status::ok);
  CHECK_EQUAL(client.wait(300ms), Status::no_server);
  CHECK(client.reason().find("is wade serve running") != std::string::npos);
  wade::Forces forces;
  CHECK_EQUAL(timed(client, wading(), 100s, forces), Status::no_server);  // at once: it is known to be gone
  CHECK_EQUAL(forces.age_ns, WADE_NEVER);
  CHECK_EQUAL(forces.force_n[2], 0.0F);
  std::vector<wade::State> states(4, wading());
  std::vector<wade::Forces> batch(4);
  CHECK_EQUAL(client.evaluate_batch(states, 100s, batch), Status::no_server);
  server.start();
  CHECK_EQUAL(client.wait(patience), Status::ok);
  CHECK_EQUAL(client.reason(), std::string());
  until_answered(client, wading(), forces);
  CHECK(forces.force_n[2] > 0.0F);
}

void a_killed_server_that_comes_back(const std::string &address, Server &server) {
  server.start();
  wade::Client client = connected(address);
  wade::Forces before, during, after;
  until_answered(client, wading(), before);
  server.kill();
  CHECK(is_gone(timed(client, wading(), 50ms, during)));
  CHECK_EQUAL(during.force_n[2], before.force_n[2]);
  const auto first = wade::age(during);
  std::this_thread::sleep_for(10ms);
  CHECK(is_gone(timed(client, wading(), 50ms, during)));
  CHECK(first && *wade::age(during) >= *first + 10ms);
  CHECK_EQUAL(during.answer, before.answer);
  server.start();
  until_answered(client, wading(), after);
  CHECK_EQUAL(after.force_n[2], before.force_n[2]);
}

void a_server_killed_while_it_is_asked(const std::string &address, Server &server) {
  server.start();
  wade::Client client = connected(address);
  wade::Forces forces;
  until_answered(client, wading(), forces);
  server.freeze();
  std::thread killer([&] {
    std::this_thread::sleep_for(100ms);
    server.kill();
  });
  CHECK(is_gone(timed(client, wading(), 400ms, forces)));
  killer.join();
  CHECK(forces.force_n[2] > 0.0F && *wade::age(forces) > 100ms);
  server.start();
  until_answered(client, wading(), forces);
}

void a_server_that_hangs_for_a_while(const std::string &address, Server &server) {
  server.start();
  wade::Client client = connected(address);
  wade::State deep = wading();
  deep.depth_m = 0.2F;
  wade::Forces expected, forces;
  until_answered(client, deep, expected);
  until_answered(client, wading(), forces);
  server.freeze();
  CHECK(is_gone(timed(client, wading(), 20ms, forces)));
  CHECK(is_gone(timed(client, wading(), 20ms, forces)));
  server.thaw();
  // an answer that comes late must not be taken for that of a later state
  until_answered(client, deep, forces);
  CHECK_EQUAL(std::memcmp(forces.surface_force_n, expected.surface_force_n, sizeof forces.surface_force_n), 0);
}

// A loop goes on while the server stands still in the middle of it: each call ends with the last forces and their age. That none
// takes longer for a reason of the client's own shows in the first that the scheduler does not hold up.
void a_server_that_stands_still_in_the_middle_of_a_loop(const std::string &address, Server &server) {
  server.start();
  wade::Client client = connected(address);
  wade::Forces before, forces;
  constexpr auto budget = 30ms;
  const auto end = clock::now() + patience;
  for (bool kept = false; !kept;) {
    CHECK(clock::now() < end);
    until_answered(client, wading(), forces);
    std::thread freezer([&] {
      std::this_thread::sleep_for(10ms);
      server.freeze();
    });
    while (timed(client, wading(), budget, forces) == Status::ok) {
    }
    freezer.join();
    Status status;
    do {
      before = forces;
      const auto start = clock::now();
      status = timed(client, wading(), budget, forces);
      const auto took = clock::now() - start;
      CHECK(is_gone(status));
      // an answer that was under way when the server stopped may have come
      kept = status == Status::timeout && took < 2 * budget && forces.answer == before.answer;
    } while (status == Status::timeout && !kept);
    server.thaw();
  }
  CHECK_EQUAL(std::memcmp(forces.surface_force_n, before.surface_force_n, sizeof forces.surface_force_n), 0);
  CHECK(forces.force_n[2] > 0.0F && wade::age(forces) > wade::age(before));
  until_answered(client, wading(), forces);
  CHECK(forces.answer > before.answer);
}

// A copy of the server whose types in shared memory are called otherwise, as those of another layout are.
std::filesystem::path of_another_layout(const Server &server) {
  std::ifstream file(environment("WADE_BIN"), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const std::string ours = "wade::v4::", theirs = "wade::v9::";
  std::size_t names = 0;
  for (auto at = bytes.find(ours); at != std::string::npos; at = bytes.find(ours, at)) {
    bytes.replace(at, theirs.size(), theirs);
    ++names;
  }
  CHECK(names > 0);
  const auto path = server.folder() / "wade-of-another-layout";
  std::ofstream(path, std::ios::binary) << bytes;
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

void a_server_of_another_layout(Server &server) {
  server.serve_with(of_another_layout(server));
  server.start();
  wade::Client client;
  CHECK_EQUAL(client.open(server.shm().c_str(), "husky"), Status::ok);
  const auto end = clock::now() + patience;
  while (client.wait(100ms) != Status::layout_mismatch) CHECK(clock::now() < end);
  CHECK(client.reason().find("layout v4") != std::string::npos);
  wade::Forces forces;
  CHECK_EQUAL(timed(client, wading(), 100s, forces), Status::layout_mismatch);  // at once: more time would not help
  CHECK_EQUAL(forces.age_ns, WADE_NEVER);
  server.kill();
  server.serve_with(environment("WADE_BIN"));
  server.start();
  until_answered(client, wading(), forces);
  CHECK(forces.force_n[2] > 0.0F);
}

void a_server_that_comes_back_with_other_vehicles(const std::string &address, Server &server) {
  server.start(environment("WADE_ROVERS"), "rover");
  wade::Client client = connected(address, "rover");
  wade::Forces before, forces;
  until_answered(client, wading(), before);
  server.kill();
  server.start();
  const auto end = clock::now() + patience;
  Status status;
  while ((status = timed(client, wading(), 50ms, forces)) != Status::unknown_vehicle) {
    CHECK(is_gone(status) && clock::now() < end);
    std::this_thread::sleep_for(5ms);
  }
  CHECK_EQUAL(forces.force_n[2], before.force_n[2]);
  CHECK(client.reason().find("warthog") != std::string::npos);
  wade::Client warthog = connected(address, "warthog");
  until_answered(warthog, wading(), forces);
  server.start(environment("WADE_ROVERS"), "rover");
  until_answered(client, wading(), forces);
  CHECK_EQUAL(forces.force_n[2], before.force_n[2]);
}

void a_budget_of_zero_asks_and_gives_the_answer_to_an_earlier_call(const std::string &address) {
  wade::Client client = connected(address);
  wade::Forces forces;
  const auto status = timed(client, wading(), 0ns, forces);
  // a server on another core may be faster than the look for its answer
  CHECK(status == Status::ok || (status == Status::timeout && forces.age_ns == WADE_NEVER));
  const auto end = clock::now() + patience;
  while (forces.answer == 0) {
    CHECK(clock::now() < end);
    std::this_thread::sleep_for(1ms);
    (void)timed(client, wading(), 0ns, forces);
  }
  CHECK(forces.force_n[2] > 0.0F && forces.age_ns != WADE_NEVER);
}

void a_wrong_state_is_named(const std::string &address) {
  wade::Client client = connected(address, "husky", {WADE_WAIT_BLOCK, 4});
  wade::Forces good, forces;
  until_answered(client, wading(), good);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  struct Case {
    void (*spoil)(wade::State &, float);
    const char *field;
  };
  const Case cases[] = {
      {[](wade::State &state, float value) { state.velocity_mps[1] = value; }, "velocity_mps"},
      {[](wade::State &state, float value) { state.depth_m = value; }, "depth_m"},
      {[](wade::State &state, float) { state.density_kgpm3 = 0.0F; }, "density_kgpm3"},
      {[](wade::State &state, float) { std::memset(state.gravity_direction, 0, sizeof state.gravity_direction); },
       "gravity_direction"},
      {[](wade::State &state, float value) { state.time_step_s = value; }, "time_step_s"},
      {[](wade::State &state, float value) {
         state.flags = WADE_HAS_WATER_LEVEL;
         state.water_level_m = value;
       },
       "water_level_m"},
      {[](wade::State &state, float) {
         state.flags = WADE_HAS_BED;
         state.bed = 1.5F;
       },
       "bed"},
      {[](wade::State &state, float) {
         state.flags = WADE_HAS_WHEEL_SPEEDS;
         state.wheel_count = 3;
       },
       "wheel_speed_radps"},
      {[](wade::State &state, float) { state.flags = WADE_PHYSICS_HYDROSTATIC | WADE_PHYSICS_QUASI_STEADY; }, "physics"},
      {[](wade::State &state, float) { state.flags = 1U << 31; }, "flags"},
      {[](wade::State &state, float value) {
         state.flags = WADE_HAS_HEADING;
         state.heading_rad = value;
       },
       "heading_rad"},
  };
  for (const auto &wrong : cases) {
    wade::State state = wading();
    wrong.spoil(state, nan);
    CHECK_EQUAL(timed(client, state, 10s, forces), Status::invalid_state);
    CHECK_EQUAL(std::string(wade_field_name(forces.invalid_field)), std::string(wrong.field));
    CHECK(wade_problem_message(forces.invalid_problem)[0] != '\0');
    CHECK_EQUAL(forces.force_n[2], good.force_n[2]);  // the last ones
    std::vector<wade::State> states(4, wading());
    states[2] = state;
    std::vector<wade::Forces> answers(4, good);
    wade::Batch batch;
    CHECK_EQUAL(client.evaluate_batch(states, 10s, answers, &batch), Status::invalid_state);
    CHECK_EQUAL(batch.invalid_index, 2U);
    CHECK_EQUAL(batch.invalid_field, forces.invalid_field);
    CHECK_EQUAL(answers[0].force_n[2], good.force_n[2]);
    until_answered(client, wading(), forces);
    CHECK_EQUAL(forces.invalid_field, 0U);
  }
}

void wrong_arguments_are_refused(const std::string &address) {
  wade_options options = wade_default_options();
  options.address = address.c_str();
  options.vehicle = "husky";
  options.max_batch = 2;
  const auto refused = [](wade_options wrong) {
    wade_client *client = nullptr;
    const auto status = static_cast<Status>(wade_client_open(&wrong, &client));
    CHECK(client == nullptr);
    return status;
  };
  auto wrong = options;
  wrong.abi_version = WADE_ABI_VERSION + 1;
  CHECK_EQUAL(refused(wrong), Status::abi_mismatch);
  wrong = options;
  wrong.forces_size -= 8;  // a header that was packed otherwise
  CHECK_EQUAL(refused(wrong), Status::abi_mismatch);
  for (const char *nowhere : {"", "localhost", "shm:", "unix:", "ftp://host", "host:port"}) {
    wrong = options;
    wrong.address = nowhere;
    CHECK_EQUAL(refused(wrong), Status::invalid_argument);
  }
  wrong = options;
  wrong.vehicle = nullptr;
  CHECK_EQUAL(refused(wrong), Status::invalid_argument);
  wrong = options;
  wrong.wait = 7;
  CHECK_EQUAL(refused(wrong), Status::invalid_argument);
  wrong = options;
  wrong.max_batch = WADE_MAX_BATCH + 1;
  CHECK_EQUAL(refused(wrong), Status::invalid_argument);
  CHECK(wade_client_open(nullptr, nullptr) == WADE_STATUS_INVALID_ARGUMENT);

  wade::Client client = connected(address, "husky", {WADE_WAIT_BLOCK, 2});
  wade::Forces forces;
  const wade::State state = wading();
  CHECK(wade_evaluate(client.get(), nullptr, 0, &forces) == WADE_STATUS_INVALID_ARGUMENT);
  CHECK(wade_evaluate(client.get(), &state, 0, nullptr) == WADE_STATUS_INVALID_ARGUMENT);
  CHECK(wade_evaluate(nullptr, &state, 0, &forces) == WADE_STATUS_INVALID_ARGUMENT);
  std::vector<wade::State> states(3, state);
  std::vector<wade::Forces> answers(3);
  CHECK_EQUAL(client.evaluate_batch(states, 1s, answers), Status::invalid_argument);  // more than there is room for
  CHECK_EQUAL(client.evaluate_batch({states.data(), 0}, 1s, {answers.data(), 0}), Status::invalid_argument);
  CHECK_EQUAL(client.evaluate_batch({states.data(), 2}, 1s, {answers.data(), 1}), Status::invalid_argument);
  CHECK_EQUAL(client.evaluate_batch({states.data(), 2}, patience, {answers.data(), 2}), Status::ok);
  // an endless budget does not overflow the clock
  CHECK(wade_evaluate(client.get(), &state, UINT64_MAX, &forces) == WADE_STATUS_OK);
  wade_client_close(nullptr);
  CHECK(wade_status_message(-1)[0] != '\0' && wade_status_message(99)[0] != '\0');
}

void a_vehicle_that_is_not_served(const std::string &address) {
  wade::Client client;
  CHECK_EQUAL(client.open(address.c_str(), "nautilus"), Status::ok);
  const auto end = clock::now() + patience;
  while (client.wait(100ms) != Status::unknown_vehicle) CHECK(clock::now() < end);
  wade::Forces forces;
  CHECK_EQUAL(timed(client, wading(), 1s, forces), Status::unknown_vehicle);
  CHECK(client.reason().find("husky") != std::string::npos);
}

}  // namespace

int main() {
  for (const std::size_t way : {std::size_t{0}, std::size_t{1}, std::size_t{2}}) {
    {
      Server server;
      an_absent_server_that_comes(server.addresses()[way], server);
    }
    Server server;
    const auto address = server.addresses()[way];
    a_killed_server_that_comes_back(address, server);
    a_server_killed_while_it_is_asked(address, server);
    a_server_that_hangs_for_a_while(address, server);
    a_server_that_stands_still_in_the_middle_of_a_loop(address, server);
    a_server_that_comes_back_with_other_vehicles(address, server);
    server.start();
    a_budget_of_zero_asks_and_gives_the_answer_to_an_earlier_call(address);
    a_wrong_state_is_named(address);
    wrong_arguments_are_refused(address);
    a_vehicle_that_is_not_served(address);
    if (way == 0) a_server_of_another_layout(server);
  }
}
