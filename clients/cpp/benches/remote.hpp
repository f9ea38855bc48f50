// What the measurements of both clients share: the path of the vehicle, and what a client gives at a step.

#ifndef WADE_BENCHES_REMOTE_HPP
#define WADE_BENCHES_REMOTE_HPP

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

namespace remote {

// A Husky that bobs and surges in deep water: level, bow along x, water surface at z = 0.
struct Place {
  double depth = 0.0;   // of the ground-contact plane under water [m]
  double rise = 0.0;    // upward velocity [m/s]
  double speed = 0.0;   // along x [m/s]
  double lift = 0.0;    // upward acceleration [m/s2]
  double thrust = 0.0;  // acceleration along x [m/s2]
};

constexpr double z0 = -0.1845;            // z of the ground-contact plane [m], as in the vehicle file
constexpr double center_of_mass = 0.0133;  // its z [m]
constexpr double weight_n = 50.0 * 9.81;
constexpr double bed_depth = 3.0;  // [m]

inline Place place(double time) {
  constexpr double pi = 3.14159265358979323846;
  constexpr double heave = 2.0 * pi * 1.0, surge = 2.0 * pi * 0.4;  // [rad/s]
  constexpr double bob = 0.03, gust = 0.3;                          // [m], [m/s]
  Place at;
  at.depth = 0.17 + bob * std::sin(heave * time);
  at.rise = -bob * heave * std::cos(heave * time);
  at.lift = bob * heave * heave * std::sin(heave * time);
  at.speed = 0.6 + gust * std::sin(surge * time);
  at.thrust = gust * surge * std::cos(surge * time);
  return at;
}

// What a client gives at a step.
struct Given {
  std::array<double, 3> force{};  // what acts on the vehicle: world [N]
  std::uint64_t age_ns = 0;       // of the last answer; WADE_NEVER where there is none
  std::string status;             // of the call, or what the Unreal core says of its link
};

class Subject {
 public:
  virtual ~Subject() = default;
  virtual Given step(const Place &place, double time) = 0;
};

// `direct`: where the plugin's table of rest loads is asked for.
std::unique_ptr<Subject> unreal_core(const std::string &address, const std::string &direct, std::uint64_t budget_ns);

}  // namespace remote

#endif  // WADE_BENCHES_REMOTE_HPP
