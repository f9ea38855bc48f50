// Promise: the same bits over every transport, alone and in a batch, from any thread; what the server says of a vehicle is told.

#include <cmath>
#include <cstring>
#include <thread>

#include "server.hpp"

using namespace test;

namespace {

std::vector<wade::State> states(std::size_t count) {
  std::vector<wade::State> states;
  for (std::size_t i = 0; i < count; ++i) {
    const auto share = static_cast<float>(i) / static_cast<float>(count);
    wade::State state = wade::state(0.05F + 0.2F * share);
    state.velocity_mps[0] = 0.3F + share;
    state.velocity_mps[1] = 0.2F - share;
    wade_gravity_from_roll_pitch(0.1F * share, -0.05F * share, state.gravity_direction);
    if (i % 3 == 1) {
      state.flags |= WADE_HAS_WATER_LEVEL;
      state.water_level_m = 0.1F * share - 0.05F;
    }
    if (i % 5 == 2) {
      state.flags |= WADE_HAS_BED_CLEARANCE | WADE_HAS_BED;
      state.bed_clearance_m = 0.3F * share;
      state.bed = share;
    }
    states.push_back(state);
  }
  return states;
}

static_assert(sizeof(wade_state) == 208, "no padding");
static_assert(sizeof(wade_forces) == 4304, "no padding");

// What does not depend on the call: bit by bit. Shared memory carries the first 32 bytes of the provenance.
bool same(wade::Forces left, wade::Forces right) {
  for (wade::Forces *forces : {&left, &right}) {
    std::memset(forces->provenance + 32, 0, sizeof forces->provenance - 32);
  }
  left.age_ns = right.age_ns = left.answer = right.answer = left.compute_ns = right.compute_ns = 0;
  return std::memcmp(&left, &right, sizeof left) == 0;
}

void the_same_bits_over_every_transport_alone_and_in_a_batch(const Server &server) {
  const auto asked = states(600);  // more than shared memory carries at a time
  std::vector<wade::Forces> reference;
  for (const auto &address : server.addresses()) {
    for (const auto wait : {WADE_WAIT_BLOCK, WADE_WAIT_SPIN}) {
      wade::Client client = connected(address, "husky", {wait, 600});
      std::vector<wade::Forces> forces(asked.size());
      wade::Batch batch;
      CHECK_EQUAL(client.evaluate_batch(asked, patience, forces, &batch), wade::Status::ok);
      CHECK(batch.age_ns != WADE_NEVER && batch.age_ns == batch.age_ns);
      if (reference.empty()) reference = forces;
      for (std::size_t i = 0; i < asked.size(); ++i) CHECK(same(forces[i], reference[i]));
      for (std::size_t i = 0; i < asked.size(); i += 60) {
        wade::Forces alone;
        CHECK_EQUAL(client.evaluate(asked[i], patience, alone), wade::Status::ok);
        CHECK(same(alone, reference[i]));
        CHECK_EQUAL(alone.answer, i / 60 + 1);
        CHECK(wade::age(alone).has_value() && alone.compute_ns > 0);
      }
    }
  }
  const wade::Forces &first = reference.front();
  CHECK(first.force_n[2] > 0.0F && first.surface_count > 4 && first.bundle_version > 0);
  // surfaces sum to the net force where no effects are added
  double sum = 0.0;
  for (const auto &force : wade::surface_forces(first)) sum += static_cast<double>(force[2]);
  CHECK(std::abs(sum - static_cast<double>(first.force_n[2])) < 1e-2);
}

void moving_water_has_the_same_bits_over_every_transport(const Server &server) {
  wade::State still = wading();
  still.current_mps[0] = -0.5F;
  wade::State wave = still, levels = still, sheared = still;
  wave.flags |= WADE_HAS_WAVE;
  wave.wave_vector_radpm[0] = 1.5F;
  wave.wave_amplitude_m = 0.05F;
  wave.wave_phase_rad = 0.7F;
  levels.flags |= WADE_HAS_WHEEL_LEVELS;
  levels.wheel_water_level_m[1] = -0.03F;
  sheared.flags |= WADE_HAS_CURRENT_EXPONENT;
  sheared.current_exponent = 0.15F;
  std::vector<wade::Forces> reference;
  for (const auto &address : server.addresses()) {
    wade::Client client = connected(address, "husky");
    std::size_t i = 0;
    for (const wade::State &state : {still, wave, levels, sheared}) {
      wade::Forces forces;
      CHECK_EQUAL(client.evaluate(state, patience, forces), wade::Status::ok);
      if (reference.size() == i) reference.push_back(forces);
      CHECK(same(forces, reference[i]));
      if (i > 0) CHECK(std::memcmp(forces.force_n, reference[0].force_n, sizeof forces.force_n) != 0);
      ++i;
    }
    // what cannot be answered is named, and the next call is answered
    wade::State wrong = wave;
    wrong.flags |= WADE_HAS_WHEEL_LEVELS;
    wade::Forces forces;
    CHECK_EQUAL(client.evaluate(wrong, patience, forces), wade::Status::invalid_state);
    CHECK_EQUAL(std::string(wade_field_name(forces.invalid_field)), std::string("wheel_water_level_m"));
    wrong = levels;
    wrong.wheel_count = 6;
    CHECK_EQUAL(client.evaluate(wrong, patience, forces), wade::Status::invalid_state);
    CHECK_EQUAL(client.evaluate(wave, patience, forces), wade::Status::ok);
  }
}

void the_same_derivatives_over_every_transport(const Server &server) {
  const auto asked = states(20);
  std::vector<wade::Jacobian> reference;
  for (const auto &address : server.addresses()) {
    wade::Client client = connected(address, "husky");
    for (std::size_t i = 0; i < asked.size(); ++i) {
      wade::Forces with, without;
      wade::Jacobian jacobian;
      CHECK_EQUAL(client.evaluate(asked[i], patience, with, jacobian), wade::Status::ok);
      CHECK_EQUAL(client.evaluate(asked[i], patience, without), wade::Status::ok);
      CHECK(same(with, without));
      if (reference.size() == i) reference.push_back(jacobian);
      CHECK(std::memcmp(&jacobian, &reference[i], sizeof jacobian) == 0);
    }
    // what there is no answer for leaves them as they were
    wade::Forces forces;
    wade::Jacobian kept = reference.front();
    wade::State wrong = asked.front();
    wrong.density_kgpm3 = -1.0F;
    CHECK_EQUAL(client.evaluate(wrong, patience, forces, kept), wade::Status::invalid_state);
    CHECK(std::memcmp(&kept, &reference.front(), sizeof kept) == 0);
  }
  // lift by the water level, for the most part the area that the water surface cuts, against its difference
  wade::Client client = connected(server.shm(), "husky");
  wade::State state = wade::at_water_level(0.05F);
  const auto lift = [&](float level) {
    wade::Forces forces;
    state.water_level_m = level;
    CHECK_EQUAL(client.evaluate(state, patience, forces), wade::Status::ok);
    return static_cast<double>(forces.force_n[2]);
  };
  const double difference = (lift(0.052F) - lift(0.048F)) / 0.004;
  wade::Forces forces;
  wade::Jacobian jacobian;
  state.water_level_m = 0.05F;
  CHECK_EQUAL(client.evaluate(state, patience, forces, jacobian), wade::Status::ok);
  CHECK(difference > 1000.0 && std::abs(static_cast<double>(jacobian.by_rows[2][6]) / difference - 1.0) < 0.02);
}

void a_vehicle_is_told(const Server &server) {
  static wade::Vehicle vehicle, first;
  for (const auto &address : server.addresses()) {
    const auto status = wade::get_vehicle(address.c_str(), "husky", patience, vehicle);
    CHECK_EQUAL(status, wade::Status::ok);
    CHECK_EQUAL(std::string(vehicle.name), std::string("husky"));
    CHECK(vehicle.mass_kg > 10.0 && vehicle.length_m > 0.5 && vehicle.inertia_kgm2[0] > 0.0);
    CHECK(vehicle.domain[WADE_QUANTITY_DEPTH].minimum < vehicle.domain[WADE_QUANTITY_DEPTH].maximum);
    wade::Client client = connected(address);
    wade::Forces forces;
    CHECK_EQUAL(client.evaluate(wading(), patience, forces), wade::Status::ok);
    CHECK_EQUAL(forces.surface_count, vehicle.surface_count);
    for (const auto &surface : wade::surfaces(vehicle)) CHECK(surface.name[0] != '\0' && surface.area_m2 > 0.0);
    if (first.surface_count == 0) first = vehicle;
    CHECK_EQUAL(vehicle.surface_count, first.surface_count);
    CHECK(std::memcmp(first.surfaces, vehicle.surfaces, sizeof vehicle.surfaces) == 0);
    CHECK(std::memcmp(first.domain, vehicle.domain, sizeof vehicle.domain) == 0);
    CHECK(vehicle.mass_kg == first.mass_kg && std::string(vehicle.provenance) == first.provenance);
    CHECK_EQUAL(wade::get_vehicle(address.c_str(), "nautilus", patience, vehicle), wade::Status::unknown_vehicle);
  }
}

void threads_share_a_client(const Server &server) {
  const auto asked = states(8);
  for (const auto &address : server.addresses()) {
    wade::Client client = connected(address);
    std::vector<wade::Forces> expected(asked.size());
    for (std::size_t i = 0; i < asked.size(); ++i) {
      CHECK_EQUAL(client.evaluate(asked[i], patience, expected[i]), wade::Status::ok);
    }
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      threads.emplace_back([&, i] {
        wade::Forces forces;
        for (int turn = 0; turn < 20; ++turn) {
          CHECK_EQUAL(client.evaluate(asked[i], patience, forces), wade::Status::ok);
          CHECK(same(forces, expected[i]));
        }
      });
    }
    for (auto &thread : threads) thread.join();
  }
}

void attitudes_agree() {
  float by_angles[3], by_quaternion[3];
  const float roll = 0.3F, pitch = -0.2F;
  wade_gravity_from_roll_pitch(roll, pitch, by_angles);
  // pitch about y, then roll about x, no yaw
  const double cr = std::cos(roll / 2.0), sr = std::sin(roll / 2.0), cp = std::cos(pitch / 2.0), sp = std::sin(pitch / 2.0);
  const float world_from_body[4] = {static_cast<float>(cp * cr), static_cast<float>(cp * sr), static_cast<float>(sp * cr),
                                    static_cast<float>(-sp * sr)};
  wade_gravity_from_quaternion(world_from_body, by_quaternion);
  for (int i = 0; i < 3; ++i) CHECK(std::abs(by_angles[i] - by_quaternion[i]) < 1e-6F);
  CHECK(std::abs(by_angles[0] - std::sin(pitch)) < 1e-6F);  // nose up: gravity points to the rear
}

}  // namespace

int main() {
  attitudes_agree();
  Server server;
  server.start();
  the_same_bits_over_every_transport_alone_and_in_a_batch(server);
  the_same_derivatives_over_every_transport(server);
  moving_water_has_the_same_bits_over_every_transport(server);
  a_vehicle_is_told(server);
  threads_share_a_client(server);
}
