// All vehicles of one world in a physics step, with few requests: the questions of vehicles of one name go in one batch.
//
// A batch is one request over shared memory, whatever the number of its states, but it is of one vehicle name, and an answer
// that comes after the budget is lost. A question asked alone keeps its late answer. So vehicles are asked about in batches
// while batches are answered in time; after one that was not, alone, until a whole step was answered in time again.

#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "hydrodynamics.h"

namespace wade {

// As `wade_evaluate_batch`: questions, how many, a budget [ns], room for as many answers.
using AskBatch = std::function<wade_status(const wade_state*, std::size_t, std::uint64_t, wade_forces*)>;

// A vehicle in a step. `load` is what `Fleet::step` gives.
struct Member {
  Hydrodynamics* hydrodynamics = nullptr;
  // Members of one group are one vehicle name of one server.
  std::string group;
  // Asks about vehicles of the group; empty where the server is not to be asked in batches.
  AskBatch ask_batch;
  Body body;
  Motion motion;
  Water water;
  Surroundings surroundings;
  StepLoad load;
};

class Fleet {
 public:
  // Most questions of one batch; a larger group has several.
  static constexpr std::size_t most_in_batch = 64;

  explicit Fleet(Clock clock) : clock_(std::move(clock)) {}

  // Loads of all members, which have one pacing, for a step of `time` [s]. Members of a batch pool their budgets, so that a group
  // that is answered late takes no time from another.
  void step(std::vector<Member>& members, double time);

 private:
  struct Group {
    std::string name;
    std::vector<Member*> members;
  };

  void ask(const Group& group);
  bool ask_together(std::size_t first, std::size_t count);

  Clock clock_;
  // those that had a batch that was not answered in time, by name
  std::vector<std::string> apart_;
  // kept from step to step for their room
  std::vector<wade_state> questions_;
  std::vector<wade_forces> answers_;
  std::vector<Member*> asked_;
};

}  // namespace wade
