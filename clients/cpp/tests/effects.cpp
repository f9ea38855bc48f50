// Promise: what effects add is told as on the wire: their loads, the added-mass matrix, what was left out and why; and a session
// remembers, over every transport alike.

#include <cmath>
#include <cstring>
#include <sstream>

#include "server.hpp"

using namespace test;
using wade::Status;

namespace {

// The shipped Husky with two effects whose numbers are made up.
std::filesystem::path husky_with_effects(const std::filesystem::path &folder) {
  const auto from = std::filesystem::path(environment("WADE_VEHICLES")) / "husky";
  const auto husky = folder / "vehicles" / "husky";
  std::filesystem::create_directories(husky.parent_path());
  std::filesystem::copy(from, husky);
  std::ifstream sums(husky / "SHA256SUMS");
  std::string hash, file, weights;
  while (sums >> hash >> file) {
    if (file == "network.safetensors") weights = hash;
  }
  const auto zeros = [](int count) {
    std::ostringstream rows;
    for (int i = 0; i < count; ++i) {
      rows << (i ? ", [" : "[");
      for (int j = 0; j < count; ++j) rows << (j ? ", 0.0" : "0.0");
      rows << "]";
    }
    return rows.str();
  };
  const auto number = [](const char *name, double value, const char *unit) {
    std::ostringstream text;
    text << "[effect.parameters." << name << "]\nvalue = " << std::showpoint << value << "\nstd = 0.0\nunit = \"" << unit << "\"\n";
    return text.str();
  };
  std::ofstream(husky / "effects.toml")
      << "format = 1\nvehicle = \"husky\"\n"
      << "[evidence]\ntrials = [\"none\"]\ntrials_sha256 = \"\"\ngenerated = \"made up for a test\"\nsamples = 1\n"
      << "model_sha256 = \"\"\nweights_sha256 = \"" << weights << "\"\nbase = \"physics\"\ntool = \"a test\"\n"
      << "[validity]\ndepth_m = [0.0, 1.0]\nspeed_mps = [0.0, 10.0]\nacceleration_mps2 = [0.0, 10.0]\n"
      << "angular_speed_radps = [0.0, 10.0]\ndensity_kgpm3 = [900.0, 2000.0]\n"
      << "[[effect]]\nname = \"added_mass\"\nequation = \"\"\nprovisional = false\nshare_of_gap = 0.5\nshape = [0.0, 0.0, 0.0]\n"
      << "base_drag = [1.0, 1.0, 1.0]\ncoefficients = [\"surge\", \"heave\"]\ncovariance = [" << zeros(2) << "]\n"
      << number("surge", 0.5, "1") << number("heave", 1.5, "1")
      << "[[effect]]\nname = \"wave_memory\"\nequation = \"\"\nprovisional = false\nshare_of_gap = 0.5\nshape = [0.8, 2.0, 0.0]\n"
      << "base_drag = [1.0, 1.0, 1.0]\ncoefficients = [\"surge\"]\ncovariance = [" << zeros(1) << "]\n"
      << number("surge", 0.7, "1") << number("time_constant", 0.8, "s") << number("frequency", 2.0, "rad/s");
  const std::string sum = "cd '" + husky.string() + "' && sha256sum effects.toml >> SHA256SUMS && sort -k2 -o SHA256SUMS SHA256SUMS";
  CHECK_EQUAL(std::system(sum.c_str()), 0);
  return folder / "vehicles";
}

wade::State accelerating(float acceleration) {
  wade::State state = wading();
  state.acceleration_mps2[0] = acceleration;
  return state;
}

void added_mass_is_served_beside_its_load(const std::string &address) {
  wade::Client client = connected(address);
  wade::Forces explicitly, implicitly;
  wade::State state = accelerating(2.0F);
  until_answered(client, state, explicitly);
  state.flags = WADE_IMPLICIT_ADDED_MASS;
  until_answered(client, state, implicitly);
  const auto matrix = wade::added_mass(explicitly);
  CHECK(matrix.has_value());
  const float surge = (*matrix)[0];
  // F = -M_A nu_dot is what the implicit way leaves out
  CHECK(std::abs(explicitly.force_n[0] - implicitly.force_n[0] + surge * 2.0F) < 1e-2F);
  CHECK_EQUAL(wade::effects(explicitly).size(), std::size_t{2});
  double sum[3] = {};
  for (const auto &force : wade::surface_forces(explicitly)) {
    for (int axis = 0; axis < 3; ++axis) sum[axis] += static_cast<double>(force[axis]);
  }
  for (const auto &load : wade::effects(explicitly)) {
    for (int axis = 0; axis < 3; ++axis) sum[axis] += static_cast<double>(load.force_n[axis]);
    const std::string name = wade_effect_name(load.effect);
    CHECK(name == "added_mass" || name == "wave_memory");
    // LEFT_OUT_NO_SESSION
    if (name == "wave_memory") CHECK_EQUAL(load.left_out, 1U);
    // a part of the matrix, beside the base's own
    if (name == "added_mass") CHECK(load.force_n[0] < -1.0F && -load.force_n[0] < surge * 2.0F);
  }
  for (int axis = 0; axis < 3; ++axis) CHECK(std::abs(sum[axis] - static_cast<double>(explicitly.force_n[axis])) < 1e-2);
}

std::vector<wade::Forces> run(const std::string &address) {
  wade::Client client = connected(address);
  std::vector<wade::Forces> answers;
  for (int step = 0; step < 20; ++step) {
    wade::State state = accelerating(std::sin(0.3F * static_cast<float>(step)));
    state.session = 7;
    state.time_step_s = 0.05F;
    wade::Forces forces;
    CHECK_EQUAL(client.evaluate(state, patience, forces), Status::ok);
    CHECK_EQUAL((forces.flags & WADE_SESSION_BEGINS) != 0, step == 0);
    for (const auto &load : wade::effects(forces)) CHECK_EQUAL(load.left_out, 0U);
    answers.push_back(forces);
  }
  return answers;
}

void a_session_remembers_over_every_transport_alike(const Server &server) {
  const auto expected = run(server.addresses()[0]);
  // the same state as the first one, later, with waves
  CHECK(expected[10].force_n[0] != expected[0].force_n[0]);
  for (const auto &address : server.addresses()) {
    const auto answers = run(address);
    for (std::size_t i = 0; i < answers.size(); ++i) {
      CHECK_EQUAL(std::memcmp(answers[i].force_n, expected[i].force_n, sizeof answers[i].force_n), 0);
      CHECK_EQUAL(std::memcmp(answers[i].effects, expected[i].effects, sizeof answers[i].effects), 0);
    }
  }
}

void the_vehicle_names_its_effects(const Server &server) {
  static wade::Vehicle vehicle;
  CHECK_EQUAL(wade::get_vehicle(server.tcp().c_str(), "husky", patience, vehicle), Status::ok);
  CHECK_EQUAL(vehicle.effect_count, 2U);
  CHECK_EQUAL(std::string(wade_effect_name(vehicle.effects[0])), std::string("added_mass"));
}

}  // namespace

int main() {
  Server server;
  server.start(husky_with_effects(server.folder()), "husky");
  for (const auto &address : server.addresses()) added_mass_is_served_beside_its_load(address);
  a_session_remembers_over_every_transport_alike(server);
  the_vehicle_names_its_effects(server);
}
