// How the talk with the server stands, from what came of each question.

#pragma once

#include "wade_client.h"

namespace wade {

enum class LinkState {
  Connecting,      // not answered yet
  Serving,         // answers come in time
  Stale,           // answers come late, or not for a moment
  Lost,            // answered once, no more
  UnknownVehicle,  // the server serves no such vehicle
  Incompatible,    // server, library and plugin are not of one version
  Refused,         // the server refuses what it is asked
};

// Whether answers come, in time or late.
inline bool is_answered(LinkState state) { return state == LinkState::Serving || state == LinkState::Stale; }

class LinkMonitor {
 public:
  // So many questions without an answer in a row are an accident of scheduling, not a state.
  static constexpr int tolerated = 3;
  // Silence after which a server counts as lost [s of simulated time].
  static constexpr double lost_after = 1.0;

  LinkState state() const { return state_; }

  // `time`: since the question before [s].
  LinkState heard(wade_status status, double time) {
    if (status == WADE_STATUS_OK) {
      answered_ = true;
      missed_ = 0;
      silence_ = 0.0;
      return state_ = LinkState::Serving;
    }
    ++missed_;
    silence_ += time;
    return state_ = without_answer(status);
  }

  // An answer came to a question of before, after what `heard` was given.
  LinkState heard_late() {
    answered_ = true;
    silence_ = 0.0;
    if (state_ == LinkState::Connecting || state_ == LinkState::Lost) state_ = LinkState::Stale;
    return state_;
  }

 private:
  LinkState without_answer(wade_status status) const {
    switch (status) {
      case WADE_STATUS_UNKNOWN_VEHICLE:
        return LinkState::UnknownVehicle;
      case WADE_STATUS_LAYOUT_MISMATCH:
      case WADE_STATUS_ABI_MISMATCH:
        return LinkState::Incompatible;
      case WADE_STATUS_OK:
      case WADE_STATUS_TIMEOUT:
      case WADE_STATUS_NO_SERVER:
        if (!answered_) return LinkState::Connecting;
        if (silence_ > lost_after) return LinkState::Lost;
        return state_ == LinkState::Serving && missed_ < tolerated ? LinkState::Serving : LinkState::Stale;
      default:
        return LinkState::Refused;
    }
  }

  LinkState state_ = LinkState::Connecting;
  bool answered_ = false;
  int missed_ = 0;
  double silence_ = 0.0;
};

}  // namespace wade
