// Remote use: age and error of what a client gives when the server is behind a network, and the time until a server that was
// cut off is found again. Nothing here fails on a time. Prints JSON; the script `remote` runs it and adds the machine.
//
//   remote [SECONDS [CUTS]]      seconds of each condition of steady use, and cuts of each condition

#include <sys/prctl.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <random>
#include <set>
#include <thread>

#include "../tests/server.hpp"
#include "relay.hpp"
#include "remote.hpp"

using namespace std::chrono_literals;
using clock_type = std::chrono::steady_clock;
using remote::Given;
using remote::Subject;
using std::chrono::nanoseconds;
using test::Server;

namespace {

constexpr double warm_up_s = 0.5;
constexpr nanoseconds patient = 10s;
// A cut lasts as long, and up to `retry` longer: the end of the cut meets every phase of the client's attempts to connect.
constexpr double cut_s = 1.0, retry_s = 0.1;
// Added round-trip times.
constexpr std::array<nanoseconds, 4> delays{0ns, 300us, 2ms, 10ms};

class CClient : public Subject {
 public:
  CClient(const std::string &address, nanoseconds budget) : client_(test::connected(address)), budget_(budget) {}

  Given step(const remote::Place &place, double time) override {
    wade::State state = wade::at_water_level(static_cast<float>(remote::z0 + place.depth));
    state.flags |= WADE_IMPLICIT_ADDED_MASS | WADE_HAS_HEADING | WADE_HAS_DEPTH_RATE | WADE_HAS_BED_CLEARANCE;
    state.depth_rate_mps = static_cast<float>(-place.rise);
    state.bed_clearance_m = static_cast<float>(remote::bed_depth - place.depth);
    state.velocity_mps[0] = static_cast<float>(place.speed);
    state.velocity_mps[2] = static_cast<float>(place.rise);
    state.acceleration_mps2[0] = static_cast<float>(place.thrust);
    state.acceleration_mps2[2] = static_cast<float>(place.lift);
    state.session = 1;
    state.time_step_s = static_cast<float>(time);
    Given given;
    const auto status = client_.evaluate(state, budget_, forces_);
    given.force = {forces_.force_n[0], forces_.force_n[1], forces_.force_n[2]};
    given.age_ns = forces_.age_ns;
    given.status = status == wade::Status::ok          ? "OK"
                   : status == wade::Status::timeout   ? "TIMEOUT"
                   : status == wade::Status::no_server ? "NO_SERVER"
                                                       : wade::message(status);
    return given;
  }

 private:
  wade::Client client_;
  nanoseconds budget_;
  wade::Forces forces_{};
};

enum class Kind { c, unreal };

std::unique_ptr<Subject> subject(Kind kind, const std::string &address, const Server &server, nanoseconds budget) {
  if (kind == Kind::c) return std::make_unique<CClient>(address, budget);
  return remote::unreal_core(address, server.tcp(), static_cast<std::uint64_t>(budget.count()));
}

const char *name(Kind kind) { return kind == Kind::c ? "C client" : "Unreal core"; }

using Forces = std::vector<std::array<double, 3>>;

// What a client that waits for every answer and has no relay gives along the path.
const Forces &truth(Kind kind, int rate, std::size_t steps, const Server &server) {
  static std::map<std::pair<Kind, int>, Forces> known;
  Forces &forces = known[{kind, rate}];
  if (forces.size() < steps) {
    forces.clear();
    const auto asked = subject(kind, server.tcp(), server, patient);
    for (std::size_t i = 0; i < steps; ++i) {
      forces.push_back(asked->step(remote::place(static_cast<double>(i) / rate), 1.0 / rate).force);
    }
  }
  return forces;
}

double ms(nanoseconds time) { return 1e-6 * static_cast<double>(time.count()); }

// A list of numbers as its median, 95th percentile and largest.
struct Numbers {
  std::vector<double> values;

  void add(double value) { values.push_back(value); }
  double at(double share) const {
    if (values.empty()) return 0.0;
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1) + 0.5)];
  }
  std::string json() const {
    if (values.empty()) return "null";
    char text[128];
    std::snprintf(text, sizeof text, "{\"p50\": %.4g, \"p95\": %.4g, \"max\": %.4g}", at(0.5), at(0.95), at(1.0));
    return text;
  }
};

// What the steps of a time gave.
struct Steps {
  Numbers age_ms, call_us, horizontal_n, vertical_n;
  std::map<std::string, int> status;
  int count = 0, without = 0;

  void add(const Given &given, const std::array<double, 3> &expected, nanoseconds call) {
    ++count;
    ++status[given.status];
    call_us.add(1e3 * ms(call));
    if (given.age_ns == WADE_NEVER) {
      ++without;
    } else {
      age_ms.add(1e-6 * static_cast<double>(given.age_ns));
    }
    horizontal_n.add(std::hypot(given.force[0] - expected[0], given.force[1] - expected[1]));
    vertical_n.add(std::fabs(given.force[2] - expected[2]));
  }

  std::string json() const {
    std::string counts;
    for (const auto &[text, number] : status) counts += (counts.empty() ? "\"" : ", \"") + text + "\": " + std::to_string(number);
    return "\"steps\": " + std::to_string(count) + ", \"without_answer\": " + std::to_string(without) + ", \"status\": {" + counts +
           "}, \"age_ms\": " + age_ms.json() + ", \"call_us\": " + call_us.json() + ", \"horizontal_n\": " + horizontal_n.json() +
           ", \"vertical_n\": " + vertical_n.json();
  }
};

// Steps in real time along the path.
class Loop {
 public:
  Loop(Kind kind, const std::string &address, const Server &server, int rate, nanoseconds budget, std::size_t steps)
      : expected_(truth(kind, rate, steps, server)),
        subject_(subject(kind, address, server, budget)),
        rate_(rate),
        next_(clock_type::now()) {}

  bool over() const { return at_ == expected_.size(); }
  double time() const { return static_cast<double>(at_) / rate_; }
  // Makes a step; returns when it ended.
  clock_type::time_point step() {
    std::this_thread::sleep_until(next_);
    const auto start = clock_type::now();
    if (start - next_ > period()) ++late_;
    given = subject_->step(remote::place(time()), 1.0 / rate_);
    const auto end = clock_type::now();
    call_ = end - start;
    ++at_;
    next_ += period();
    return end;
  }
  // Adds the last step.
  void record(Steps &steps) const { steps.add(given, expected_[at_ - 1], call_); }
  int late() const { return late_; }

  Given given;

 private:
  nanoseconds period() const { return nanoseconds(1000000000 / rate_); }

  const Forces &expected_;
  std::unique_ptr<Subject> subject_;
  int rate_;
  clock_type::time_point next_;
  std::size_t at_ = 0;
  nanoseconds call_{};
  int late_ = 0;
};

std::string condition(Kind kind, const nanoseconds *added, int rate, nanoseconds budget) {
  char text[200];
  char network[32] = "null";
  if (added != nullptr) std::snprintf(network, sizeof network, "%g", ms(*added));
  std::snprintf(text, sizeof text, "\"client\": \"%s\", \"added_ms\": %s, \"rate_hz\": %d, \"budget_us\": %.0f", name(kind),
                network, rate, 1e3 * ms(budget));
  return text;
}

void steady(Kind kind, const std::string &address, const Server &server, const nanoseconds *added, int rate, nanoseconds budget,
            double seconds, const char *separator) {
  Loop loop(kind, address, server, rate, budget, static_cast<std::size_t>(seconds * rate));
  Steps steps;
  while (!loop.over()) {
    const bool is_warm = loop.time() >= warm_up_s;
    loop.step();
    if (is_warm) loop.record(steps);
  }
  std::printf("%s\n    {%s, \"late_steps\": %d, %s}", separator, condition(kind, added, rate, budget).c_str(), loop.late(),
              steps.json().c_str());
  std::fflush(stdout);
}

void cuts(Kind kind, relay::Relay &network, const Server &server, const nanoseconds *added, int rate, nanoseconds budget, int count,
          const char *separator) {
  // each cut follows 1 s of use and is followed by another
  Loop loop(kind, network.address(), server, rate, budget, static_cast<std::size_t>((3.2 * count + 1.0) * rate));
  Steps during;
  Numbers recovery, last_age;
  std::map<std::string, Numbers> shown;
  std::string each;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> phase(0.0, retry_s);
  for (int cut = 0; cut < count; ++cut) {
    for (const double use = loop.time() + 1.0 + phase(random); loop.time() < use;) loop.step();
    // when a state of the link is shown for the first time after an event
    std::string status = loop.given.status;
    std::uint64_t age = loop.given.age_ns;
    std::set<std::string> seen{status};
    const auto note = [&](const char *event, nanoseconds time) {
      if (seen.insert(loop.given.status).second) shown[event + (" to " + loop.given.status)].add(ms(time));
    };
    network.cut(std::chrono::duration_cast<nanoseconds>(std::chrono::duration<double>(cut_s + phase(random))));
    const auto start = clock_type::now();
    std::optional<clock_type::time_point> restored;
    clock_type::time_point end;
    for (;;) {
      end = loop.step();
      restored = network.restored();
      if (restored && end > *restored) break;
      loop.record(during);
      note("cut", end - start);
      age = loop.given.age_ns;
      status = loop.given.status;
    }
    last_age.add(1e-6 * static_cast<double>(age));
    seen = {status};
    bool is_found = false;
    for (const double limit = loop.time() + 1.0; loop.time() < limit && !loop.over(); end = loop.step()) {
      note("end of the cut", end - *restored);
      // the first answer to a question of after the cut
      if (!is_found && nanoseconds(loop.given.age_ns) < end - *restored) {
        is_found = true;
        recovery.add(ms(end - *restored));
        each += (each.empty() ? "" : ", ") + std::to_string(static_cast<int>(std::lround(recovery.values.back())));
      }
    }
  }
  std::string states;
  for (const auto &[text, numbers] : shown) {
    states += (states.empty() ? "\"" : ", \"") + text + "\": {\"count\": " + std::to_string(numbers.values.size()) +
              ", \"ms\": " + numbers.json() + "}";
  }
  std::printf("%s\n    {%s, \"late_steps\": %d, \"cuts\": %d, \"found_again\": %zu, \"recovery_ms\": %s, \"recoveries_ms\": [%s],"
              " \"age_at_end_ms\": %s, \"shown\": {%s}, \"during\": {%s}}",
              separator, condition(kind, added, rate, budget).c_str(), loop.late(), count, recovery.values.size(),
              recovery.json().c_str(), each.c_str(), last_age.json().c_str(), states.c_str(), during.json().c_str());
  std::fflush(stdout);
}

// What the relay really adds: calls one after the other, in turns with calls that go directly.
void added(relay::Relay &network, const Server &server, nanoseconds stated, const char *separator) {
  std::array<wade::Client, 2> clients{test::connected(server.tcp()), test::connected(network.address())};
  std::array<Numbers, 2> trips;
  wade::Forces forces;
  wade::State state = test::wading();
  state.session = 1;
  state.time_step_s = 1e-3F;
  for (int block = 0; block < 20; ++block) {
    for (std::size_t i = 0; i < 2; ++i) {
      for (int call = 0; call < 25; ++call) {
        const auto start = clock_type::now();
        CHECK_EQUAL(clients[i].evaluate(state, patient, forces), wade::Status::ok);
        trips[i].add(ms(clock_type::now() - start));
        // as a loop of 1 kHz
        std::this_thread::sleep_for(1ms);
      }
    }
  }
  std::printf("%s\n    {\"stated_ms\": %g, \"direct_ms\": %s, \"through_ms\": %s, \"added_p50_ms\": %.4g}", separator, ms(stated),
              trips[0].json().c_str(), trips[1].json().c_str(), trips[1].at(0.5) - trips[0].at(0.5));
  std::fflush(stdout);
}

struct Use {
  Kind kind;
  int rate;
  nanoseconds budget;
};

}  // namespace

int main(int argc, char **argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 8.0;
  const int count = argc > 2 ? std::atoi(argv[2]) : 12;
  // sleeps end when they should
  prctl(PR_SET_TIMERSLACK, 1UL);
  Server server;
  server.start();
  const int port = std::stoi(server.tcp().substr(server.tcp().rfind(':') + 1));
  const std::array<Use, 9> uses{{{Kind::c, 1000, 0ns},
                                 {Kind::c, 1000, 300us},
                                 {Kind::c, 60, 0ns},
                                 {Kind::c, 60, 300us},
                                 {Kind::c, 60, 5ms},
                                 {Kind::unreal, 1000, 300us},
                                 {Kind::unreal, 60, 0ns},
                                 {Kind::unreal, 60, 300us},
                                 {Kind::unreal, 60, 5ms}}};
  const std::array<Use, 3> cut_uses{{{Kind::c, 1000, 300us}, {Kind::unreal, 60, 300us}, {Kind::unreal, 60, 5ms}}};

  std::printf("{\n  \"weight_n\": %g,\n  \"relay\": [", remote::weight_n);
  for (const nanoseconds &delay : delays) {
    relay::Relay network(port, delay);
    added(network, server, delay, &delay == delays.data() ? "" : ",");
  }
  std::printf("\n  ],\n  \"steady\": [");
  const char *separator = "";
  for (const Use &use : uses) {
    steady(use.kind, server.tcp(), server, nullptr, use.rate, use.budget, seconds, separator);
    separator = ",";
    for (const nanoseconds &delay : delays) {
      relay::Relay network(port, delay);
      steady(use.kind, network.address(), server, &delay, use.rate, use.budget, seconds, separator);
    }
  }
  std::printf("\n  ],\n  \"cuts\": [");
  separator = "";
  for (const Use &use : cut_uses) {
    for (const nanoseconds &delay : delays) {
      relay::Relay network(port, delay);
      cuts(use.kind, network, server, &delay, use.rate, use.budget, count, separator);
      separator = ",";
    }
  }
  std::printf("\n  ]\n}\n");
  return 0;
}
