// The engine-free core of the Unreal plugin, moved along the path in place of an engine.

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <vector>

#include "core/hydrodynamics.h"
#include "remote.hpp"

namespace {

using Client = std::unique_ptr<wade_client, decltype(&wade_client_close)>;

std::uint64_t now_ns() {
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
}

Client open(const std::string &address, std::uint32_t batch) {
  wade_options options = wade_default_options();
  options.address = address.c_str();
  options.vehicle = "husky";
  options.max_batch = batch;
  wade_client *client = nullptr;
  if (wade_client_open(&options, &client) != WADE_STATUS_OK || wade_client_wait(client, 60000000000U) != WADE_STATUS_OK) {
    throw std::runtime_error(address + ": not connected");
  }
  return Client(client, &wade_client_close);
}

wade::Hull hull() {
  wade::Hull hull;
  hull.center_of_mass = {0.0, 0.0, remote::center_of_mass};
  hull.z0 = remote::z0;
  hull.radius = 0.5 * wade::norm(wade::Vec3{0.868, 0.685, 0.369});
  return hull;
}

std::shared_ptr<const wade::RestTable> rest_table(const std::string &address) {
  constexpr std::size_t batch = 16;  // as the plugin
  const Client client = open(address, batch);
  const std::vector<wade_state> questions = wade::RestTable::questions(hull());
  std::vector<wade_forces> answers(questions.size());
  for (std::size_t first = 0; first < questions.size(); first += batch) {
    const std::size_t count = std::min(batch, questions.size() - first);
    if (wade_evaluate_batch(client.get(), &questions[first], count, 60000000000U, &answers[first], nullptr) != WADE_STATUS_OK) {
      throw std::runtime_error(address + ": no table of rest loads");
    }
  }
  return std::make_shared<const wade::RestTable>(answers, hull());
}

const char *name(wade::LinkState state) {
  switch (state) {
    case wade::LinkState::Connecting: return "Connecting";
    case wade::LinkState::Serving: return "Serving";
    case wade::LinkState::Stale: return "Stale";
    case wade::LinkState::Lost: return "Lost";
    default: return "refused";
  }
}

class Core : public remote::Subject {
 public:
  Core(const std::string &address, const std::string &direct, std::uint64_t budget_ns)
      : client_(open(address, 0)), table_(rest_table(direct)), water_(ask(client_.get()), now_ns, pacing(budget_ns)) {
    body_.mass = remote::weight_n / 9.81;
    body_.inertia.rows = {wade::Vec3{2.52, 0.0, 0.0}, wade::Vec3{0.0, 3.71, 0.0}, wade::Vec3{0.0, 0.0, 5.09}};
    body_.center_of_mass = hull().center_of_mass;
    around_.z0 = remote::z0;
    around_.radius = hull().radius;
    around_.session = 1;
    surface_.bed_height = -remote::bed_depth;
  }

  remote::Given step(const remote::Place &place, double time) override {
    wade::Motion motion;
    motion.position.z = -(remote::z0 + place.depth) + remote::center_of_mass;
    motion.velocity = {place.speed, 0.0, place.rise};
    // the plugin asks for the table once answers come
    if (wade::is_answered(water_.link())) water_.set_rest_table(table_);
    const wade::StepLoad load = water_.step(body_, motion, surface_, around_, time);
    remote::Given given;
    given.force = {load.force.x, load.force.y, load.force.z};
    given.age_ns = water_.forces().answer == 0 ? WADE_NEVER : water_.forces().age_ns;
    given.status = name(water_.link());
    return given;
  }

 private:
  static wade::Ask ask(wade_client *client) {
    return [client](const wade_state &state, std::uint64_t budget, wade_forces &forces) {
      return wade_evaluate(client, &state, budget, &forces);
    };
  }

  static wade::Pacing pacing(std::uint64_t budget_ns) {
    wade::Pacing pacing;
    pacing.budget_ns = budget_ns;
    return pacing;
  }

  Client client_;
  std::shared_ptr<const wade::RestTable> table_;
  wade::Hydrodynamics water_;
  wade::Body body_;
  wade::Water surface_;
  wade::Surroundings around_;
};

}  // namespace

std::unique_ptr<remote::Subject> remote::unreal_core(const std::string &address, const std::string &direct,
                                                     std::uint64_t budget_ns) {
  return std::make_unique<Core>(address, direct, budget_ns);
}
