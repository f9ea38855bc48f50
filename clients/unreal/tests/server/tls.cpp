// A Husky afloat with a server over TLS, to which a token is shown; and what the log says where that cannot be.
//   tls ADDRESS CA TOKEN-FILE OTHER-CA

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "core/connection.h"
#include "core/hydrodynamics.h"
#include "expect.h"

using namespace wade;

namespace {

constexpr double frame = 1.0 / 60.0;
constexpr std::uint64_t second_ns = 1000000000;

using Client = std::unique_ptr<wade_client, decltype(&wade_client_close)>;

std::uint64_t now_ns() {
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
}

Client opened(const Connection& connection) {
  wade_client* client = nullptr;
  EXPECT(open_client(connection, WADE_WAIT_BLOCK, 0, client) == WADE_STATUS_OK);
  return Client(client, &wade_client_close);
}

// A second of steps at a depth at which the hull is in the water.
LinkState float_with(const Client& client, int* answered) {
  Pacing pacing;
  pacing.budget_ns = 100000000;
  Hydrodynamics water([&client](const wade_state& state, std::uint64_t budget,
                                wade_forces& forces) { return wade_evaluate(client.get(), &state, budget, &forces); },
                      now_ns, pacing);
  Body body;
  body.mass = 50.0;
  body.inertia.rows = {Vec3{2.5, 0.0, 0.0}, Vec3{0.0, 3.7, 0.0}, Vec3{0.0, 0.0, 5.1}};
  Surroundings around;
  around.z0 = -0.1845;
  around.session = 1;
  Motion motion;
  motion.position.z = 0.0;
  *answered = 0;
  for (int i = 0; i < 60; ++i) *answered += water.step(body, motion, Water{}, around, frame).answered;
  return water.link();
}

// What the log would say first, within ten seconds, beside what a client says that has not tried yet.
std::string reason_of(const Client& client) {
  ConnectionReason reason;
  const std::string before = reason.read(client.get());
  EXPECT(reason.changes(client.get(), 0.5 * ConnectionReason::interval) == nullptr);
  for (int i = 0; i < 500; ++i) {
    if (before.find("not connected yet") == std::string::npos) return before;
    if (const std::string* changed = reason.changes(client.get(), ConnectionReason::interval)) return *changed;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return before;
}

bool has(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return true;
  std::printf("%s is not in: %s\n", part.c_str(), text.c_str());
  return false;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 5) return 2;
  Connection right;
  right.address = arguments[1];
  right.vehicle = "husky";
  right.ca_file = arguments[2];
  right.token_file = arguments[3];
  Connection elsewhere = right, tokenless = right, missing = right, plain = right;
  elsewhere.ca_file = arguments[4];
  tokenless.token_file.clear();
  missing.token_file += ".nowhere";
  plain.address = plain.address.substr(std::string("https://").size());

  int answered = 0;
  const Client client = opened(right);
  EXPECT(wade_client_wait(client.get(), 60 * second_ns) == WADE_STATUS_OK);
  EXPECT(float_with(client, &answered) == LinkState::Serving && answered > 50);
  ConnectionReason none;
  EXPECT(none.read(client.get()).empty() && none.changes(client.get(), 2.0) == nullptr);
  static wade_vehicle vehicle;
  std::string reason = "none";
  EXPECT(ask_vehicle(right, 10 * second_ns, vehicle, reason) == WADE_STATUS_OK && reason.empty() && vehicle.mass_kg > 0.0);
  std::printf("over TLS with a token: %d answers\n", answered);

  struct Wrong {
    Connection connection;
    wade_status status;
    LinkState link;
    std::string part;
  };
  const Wrong wrongs[] = {
      {elsewhere, WADE_STATUS_NO_SERVER, LinkState::Connecting, "UnknownIssuer"},
      {tokenless, WADE_STATUS_REFUSED, LinkState::Refused, "Unauthenticated"},
      {missing, WADE_STATUS_CREDENTIALS, LinkState::Refused, missing.token_file},
      {plain, WADE_STATUS_CREDENTIALS, LinkState::Refused, "https://"},
  };
  for (const Wrong& wrong : wrongs) {
    const Client refused = opened(wrong.connection);
    const std::string told = reason_of(refused);
    EXPECT(has(told, wrong.part));
    EXPECT(wade_client_wait(refused.get(), 0) == wrong.status);
    EXPECT(float_with(refused, &answered) == wrong.link && answered == 0);
    EXPECT(ask_vehicle(wrong.connection, 4 * second_ns, vehicle, reason) == wrong.status && has(reason, wrong.part));
    std::printf("%s\n", told.c_str());
  }
  Connection malformed = right;
  malformed.address = "nowhere";
  EXPECT(ask_vehicle(malformed, second_ns, vehicle, reason) == WADE_STATUS_INVALID_ARGUMENT && !reason.empty());
  return failures() == 0 ? 0 : 1;
}
