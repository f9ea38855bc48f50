// wade from C++17: the C interface with owners and spans. Header only; nothing here throws.

#ifndef WADE_CLIENT_HPP
#define WADE_CLIENT_HPP

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "wade_client.h"

namespace wade {

using State = wade_state;
using Forces = wade_forces;
using Batch = wade_batch;
using Vehicle = wade_vehicle;
using std::chrono::nanoseconds;

// What came of a call; see `wade_status`.
enum class Status : std::int32_t {
  ok = WADE_STATUS_OK,
  timeout = WADE_STATUS_TIMEOUT,
  no_server = WADE_STATUS_NO_SERVER,
  unknown_vehicle = WADE_STATUS_UNKNOWN_VEHICLE,
  layout_mismatch = WADE_STATUS_LAYOUT_MISMATCH,
  invalid_state = WADE_STATUS_INVALID_STATE,
  resource_exhausted = WADE_STATUS_RESOURCE_EXHAUSTED,
  refused = WADE_STATUS_REFUSED,
  invalid_argument = WADE_STATUS_INVALID_ARGUMENT,
  abi_mismatch = WADE_STATUS_ABI_MISMATCH,
  internal = WADE_STATUS_INTERNAL,
  credentials = WADE_STATUS_CREDENTIALS,
};

// A sentence for a status.
[[nodiscard]] inline const char *message(Status status) noexcept {
  return wade_status_message(static_cast<std::int32_t>(status));
}

// Values that lie one after the other and belong to somebody else.
template <class T>
class Span {
 public:
  constexpr Span(T *data, std::size_t size) noexcept : data_(data), size_(size) {}

  // Of anything with data() and size(), such as std::vector and std::array.
  template <class Owner, class = std::enable_if_t<std::is_convertible_v<decltype(std::declval<Owner &>().data()), T *>>>
  constexpr Span(Owner &owner) noexcept : data_(owner.data()), size_(owner.size()) {}

  [[nodiscard]] constexpr T *data() const noexcept { return data_; }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr T *begin() const noexcept { return data_; }
  [[nodiscard]] constexpr T *end() const noexcept { return data_ + size_; }
  [[nodiscard]] constexpr T &operator[](std::size_t i) const noexcept { return data_[i]; }

 private:
  T *data_;
  std::size_t size_;
};

using Vector3 = float[3];

// Derivatives of force and moment; see `wade_evaluate_jacobian`. Rows: force, then moment; columns: velocity (3), angular
// velocity (3), water level, turn of the body (3), density.
struct Jacobian {
  float by_rows[6][WADE_JACOBIAN_COLUMNS];
};

// A vehicle at rest and level, in fresh water of this depth [m].
[[nodiscard]] inline State state(float depth_m) noexcept {
  State state = wade_default_state();
  state.depth_m = depth_m;
  return state;
}

// A vehicle at rest and level, in fresh water whose surface is this far above the body origin [m].
[[nodiscard]] inline State at_water_level(float water_level_m) noexcept {
  State state = wade_default_state();
  state.flags = WADE_HAS_WATER_LEVEL;
  state.water_level_m = water_level_m;
  return state;
}

// How old the forces are; none where there was no answer yet.
[[nodiscard]] inline std::optional<nanoseconds> age(const Forces &forces) noexcept {
  if (forces.age_ns == WADE_NEVER) return std::nullopt;
  return nanoseconds(static_cast<nanoseconds::rep>(forces.age_ns));
}

// True where no quantity lies outside the training domain.
[[nodiscard]] inline bool in_domain(const Forces &forces) noexcept { return (forces.flags & WADE_IN_DOMAIN) != 0; }

// Force on each surface [N].
[[nodiscard]] inline Span<const Vector3> surface_forces(const Forces &forces) noexcept {
  return {forces.surface_force_n, forces.surface_count};
}

// Point at which it acts [m].
[[nodiscard]] inline Span<const Vector3> surface_points(const Forces &forces) noexcept {
  return {forces.surface_point_m, forces.surface_count};
}

// Moment of the load of each surface about that point [N m].
[[nodiscard]] inline Span<const Vector3> surface_couples(const Forces &forces) noexcept {
  return {forces.surface_couple_nm, forces.surface_count};
}

// Share of each surface under water.
[[nodiscard]] inline Span<const float> wetted_fractions(const Forces &forces) noexcept {
  return {forces.wetted_fraction, forces.surface_count};
}

// The loads of the effects that were added to the model.
[[nodiscard]] inline Span<const wade_effect_load> effects(const Forces &forces) noexcept {
  return {forces.effects, forces.effect_count};
}

// Added mass and inertia, 6 x 6 by rows; none where the model has no such effect.
[[nodiscard]] inline std::optional<Span<const float>> added_mass(const Forces &forces) noexcept {
  if ((forces.flags & WADE_HAS_ADDED_MASS) == 0) return std::nullopt;
  return Span<const float>(forces.added_mass, 36);
}

// Damping by waves, 6 x 6 by rows; none where the bundle has no physical base.
[[nodiscard]] inline std::optional<Span<const float>> damping(const Forces &forces) noexcept {
  if ((forces.flags & WADE_HAS_BASE) == 0) return std::nullopt;
  return Span<const float>(forces.damping, 36);
}

// Power that the shafts of the wheels put in [W]; none where the bundle has no physical base or the server does not state it.
[[nodiscard]] inline std::optional<float> shaft_power(const Forces &forces) noexcept {
  const bool stated = forces.shaft_power_w == forces.shaft_power_w;
  if ((forces.flags & WADE_HAS_BASE) == 0 || !stated) return std::nullopt;
  return forces.shaft_power_w;
}

// The surfaces of a vehicle, in the order of the answers.
[[nodiscard]] inline Span<const wade_surface> surfaces(const Vehicle &vehicle) noexcept {
  return {vehicle.surfaces, vehicle.surface_count};
}

// Files that a client reads at each connection; see `wade_credentials`.
struct Credentials {
  const char *ca_file = nullptr;
  const char *certificate_file = nullptr;
  const char *key_file = nullptr;
  const char *token_file = nullptr;

  [[nodiscard]] wade_credentials as_c() const noexcept {
    wade_credentials credentials = wade_default_credentials();
    credentials.ca_file = ca_file;
    credentials.certificate_file = certificate_file;
    credentials.key_file = key_file;
    credentials.token_file = token_file;
    return credentials;
  }
};

// What a server says of a vehicle.
[[nodiscard]] inline Status get_vehicle(const char *address, const char *name, nanoseconds timeout, Vehicle &vehicle) noexcept {
  const auto limit = timeout.count() < 0 ? 0 : static_cast<std::uint64_t>(timeout.count());
  return static_cast<Status>(wade_get_vehicle(address, name, limit, &vehicle));
}

// The same with credentials, and why there is no answer.
[[nodiscard]] inline Status get_vehicle(const char *address, const char *name, const Credentials &shown, nanoseconds timeout,
                                        Vehicle &vehicle, std::string &reason) {
  const auto limit = timeout.count() < 0 ? 0 : static_cast<std::uint64_t>(timeout.count());
  const wade_credentials credentials = shown.as_c();
  char text[1024];
  const wade_status status =
      wade_get_vehicle_with_credentials(address, name, &credentials, limit, &vehicle, text, sizeof text);
  reason = text;
  return static_cast<Status>(status);
}

// How a client waits, how many states a batch may have, and the files with which it connects.
struct Options {
  wade_wait wait = WADE_WAIT_BLOCK;
  std::uint32_t max_batch = 0;
  Credentials credentials = {};
};

// A client of one vehicle of one server; see `wade_client`. Any number of threads may call it.
class Client {
 public:
  Client() noexcept = default;
  ~Client() { close(); }
  Client(const Client &) = delete;
  Client &operator=(const Client &) = delete;
  Client(Client &&other) noexcept : client_(std::exchange(other.client_, nullptr)) {}
  Client &operator=(Client &&other) noexcept {
    std::swap(client_, other.client_);
    return *this;
  }

  // Begins to look for the server; does not wait for it. What was open before is closed.
  [[nodiscard]] Status open(const char *address, const char *vehicle, Options chosen = {}) noexcept {
    close();
    wade_options options = wade_default_options();
    options.address = address;
    options.vehicle = vehicle;
    options.wait = static_cast<std::uint32_t>(chosen.wait);
    options.max_batch = chosen.max_batch;
    const wade_credentials credentials = chosen.credentials.as_c();
    return static_cast<Status>(wade_client_open_with_credentials(&options, &credentials, &client_));
  }

  // Closes it; no call may be under way.
  void close() noexcept { wade_client_close(std::exchange(client_, nullptr)); }

  // Waits until it is connected, or the time is over: then says why it is not.
  [[nodiscard]] Status wait(nanoseconds timeout) const noexcept {
    return static_cast<Status>(wade_client_wait(client_, limit(timeout)));
  }

  // The forces in a state within a budget; without an answer the last ones, with their age. See `wade_evaluate`.
  [[nodiscard]] Status evaluate(const State &state, nanoseconds budget, Forces &forces) noexcept {
    return static_cast<Status>(wade_evaluate(client_, &state, limit(budget), &forces));
  }

  // The same with the derivatives of force and moment, which stay as they were without an answer.
  [[nodiscard]] Status evaluate(const State &state, nanoseconds budget, Forces &forces, Jacobian &jacobian) noexcept {
    return static_cast<Status>(
        wade_evaluate_jacobian(client_, &state, limit(budget), &forces, &jacobian.by_rows[0][0]));
  }

  // The forces in each state of a batch within a budget, or none. See `wade_evaluate_batch`.
  [[nodiscard]] Status evaluate_batch(Span<const State> states, nanoseconds budget, Span<Forces> forces,
                                      Batch *batch = nullptr) noexcept {
    if (forces.size() != states.size()) return Status::invalid_argument;
    return static_cast<Status>(
        wade_evaluate_batch(client_, states.data(), states.size(), limit(budget), forces.data(), batch));
  }

  // Why it is not connected; empty where it is.
  [[nodiscard]] std::string reason() const {
    std::string text(wade_client_reason(client_, nullptr, 0) + 1, '\0');
    const std::size_t length = wade_client_reason(client_, text.data(), text.size());
    text.resize(length < text.size() ? length : text.size() - 1);
    return text;
  }

  // What the C interface takes.
  [[nodiscard]] wade_client *get() const noexcept { return client_; }

 private:
  static std::uint64_t limit(nanoseconds time) noexcept {
    return time.count() < 0 ? 0 : static_cast<std::uint64_t>(time.count());
  }

  wade_client *client_ = nullptr;
};

}  // namespace wade

#endif  // WADE_CLIENT_HPP
