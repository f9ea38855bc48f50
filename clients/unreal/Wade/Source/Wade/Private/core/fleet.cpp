#include "fleet.h"

#include <algorithm>

namespace wade {

void Fleet::step(std::vector<Member>& members, double time) {
  std::vector<Group> groups;
  for (Member& member : members) {
    member.hydrodynamics->begin_step(member.body, member.motion, member.water, member.surroundings, time);
    auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return g.name == member.group; });
    if (group == groups.end()) group = groups.insert(groups.end(), Group{member.group, {}});
    group->members.push_back(&member);
  }
  const int substeps = members.empty() ? 0 : members.front().hydrodynamics->substeps();
  for (int i = 0; i < substeps; ++i) {
    for (Member& member : members) member.hydrodynamics->pose();
    for (Group& group : groups) ask(group);
    for (Member& member : members) member.hydrodynamics->advance();
  }
  for (Member& member : members) member.load = member.hydrodynamics->end_step();
  for (const Group& group : groups) {
    const bool in_time = std::all_of(group.members.begin(), group.members.end(), [](const Member* member) {
      return member->load.asked == member->load.answered;
    });
    const auto apart = std::find(apart_.begin(), apart_.end(), group.name);
    if (in_time && apart != apart_.end()) apart_.erase(apart);
    if (!in_time && apart == apart_.end()) apart_.push_back(group.name);
  }
}

void Fleet::ask(const Group& group) {
  asked_.clear();
  for (Member* member : group.members) {
    if (member->hydrodynamics->open_question() != nullptr) asked_.push_back(member);
  }
  const bool apart = std::find(apart_.begin(), apart_.end(), group.name) != apart_.end();
  std::size_t first = 0;
  if (asked_.size() > 1 && !apart && asked_.front()->hydrodynamics->budget_left() > 0 && asked_.front()->ask_batch) {
    while (first < asked_.size()) {
      const std::size_t count = std::min(most_in_batch, asked_.size() - first);
      if (!ask_together(first, count)) break;
      first += count;
    }
    // the batches behind one that was late are not asked
    for (first += most_in_batch; first < asked_.size(); ++first) asked_[first]->hydrodynamics->pass_over();
    return;
  }
  for (Member* member : asked_) member->hydrodynamics->ask_alone();
}

// Whether the batch was answered.
bool Fleet::ask_together(std::size_t first, std::size_t count) {
  questions_.resize(std::max(questions_.size(), count));
  answers_.resize(std::max(answers_.size(), count));
  std::uint64_t budget = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Hydrodynamics& asked = *asked_[first + i]->hydrodynamics;
    questions_[i] = *asked.open_question();
    budget += asked.budget_left();
  }
  const std::uint64_t start = clock_();
  const wade_status status = asked_[first]->ask_batch(questions_.data(), count, budget, answers_.data());
  const std::uint64_t share = (clock_() - start) / count;
  for (std::size_t i = 0; i < count; ++i) {
    asked_[first + i]->hydrodynamics->spend(share);
    asked_[first + i]->hydrodynamics->hear(status, &answers_[i]);
  }
  return status == WADE_STATUS_OK;
}

}  // namespace wade
