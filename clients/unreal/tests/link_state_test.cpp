// What a run of answers and silences makes of the link.

#include "core/link_state.h"
#include "expect.h"

using namespace wade;

TEST(a_link_is_connecting_until_it_is_answered) {
  LinkMonitor monitor;
  EXPECT(monitor.state() == LinkState::Connecting);
  EXPECT(monitor.heard(WADE_STATUS_NO_SERVER, 0.1) == LinkState::Connecting);
  EXPECT(monitor.heard(WADE_STATUS_TIMEOUT, 10.0) == LinkState::Connecting);
  EXPECT(monitor.heard(WADE_STATUS_OK, 0.1) == LinkState::Serving);
}

TEST(a_late_answer_is_no_state_and_a_silence_is) {
  LinkMonitor monitor;
  monitor.heard(WADE_STATUS_OK, 0.01);
  EXPECT(monitor.heard(WADE_STATUS_TIMEOUT, 0.01) == LinkState::Serving);
  EXPECT(monitor.heard(WADE_STATUS_TIMEOUT, 0.01) == LinkState::Serving);
  EXPECT(monitor.heard(WADE_STATUS_TIMEOUT, 0.01) == LinkState::Stale);
  EXPECT(monitor.heard(WADE_STATUS_NO_SERVER, 0.9) == LinkState::Stale);
  EXPECT(monitor.heard(WADE_STATUS_NO_SERVER, 0.1) == LinkState::Lost);
  EXPECT(monitor.heard(WADE_STATUS_OK, 0.01) == LinkState::Serving);
  EXPECT(monitor.heard(WADE_STATUS_TIMEOUT, 0.9) == LinkState::Serving);
}

TEST(late_answers_alone_make_a_link_stale_and_not_lost) {
  LinkMonitor monitor;
  EXPECT(monitor.heard(WADE_STATUS_TIMEOUT, 0.01) == LinkState::Connecting);
  EXPECT(monitor.heard_late() == LinkState::Stale);
  for (int i = 0; i < 300; ++i) {
    EXPECT(monitor.heard(WADE_STATUS_TIMEOUT, 0.01) == LinkState::Stale);
    EXPECT(monitor.heard_late() == LinkState::Stale);
  }
  EXPECT(monitor.heard(WADE_STATUS_NO_SERVER, 1.1) == LinkState::Lost);
  EXPECT(monitor.heard(WADE_STATUS_OK, 0.01) == LinkState::Serving);
  EXPECT(monitor.heard(WADE_STATUS_TIMEOUT, 0.01) == LinkState::Serving);
  EXPECT(monitor.heard_late() == LinkState::Serving);
}

TEST(a_refusal_says_which_and_is_forgotten_with_the_next_answer) {
  LinkMonitor monitor;
  EXPECT(monitor.heard(WADE_STATUS_LAYOUT_MISMATCH, 0.01) == LinkState::Incompatible);
  EXPECT(monitor.heard(WADE_STATUS_UNKNOWN_VEHICLE, 0.01) == LinkState::UnknownVehicle);
  EXPECT(monitor.heard(WADE_STATUS_INVALID_STATE, 0.01) == LinkState::Refused);
  EXPECT(monitor.heard(WADE_STATUS_RESOURCE_EXHAUSTED, 0.01) == LinkState::Refused);
  EXPECT(monitor.heard(WADE_STATUS_OK, 0.01) == LinkState::Serving);
}
