// The law between answers: what the last answer says of a state that it was not asked about.
//
// A force held while the body moves on does work that the water would not do: buoyancy that lags a heave of frequency w by t
// pumps it with a damping ratio of -w t / 2, and a drag that is kept after the body has slowed down drives it backwards. So an
// answer is taken apart. What the hull would feel at rest is looked up for where it is now (`RestTable`); the rest, which comes
// from motion, is scaled with the square of what is left of the velocity it was asked for, never does work on the body
// relative to the water, and fades when nobody renews it.

#pragma once

#include <memory>
#include <optional>

#include "rest_table.h"

namespace wade {

class HeldAnswer {
 public:
  // For so long motion's part is held in full, then it falls by e every `fade` [s].
  static constexpr double grace = 0.1;
  static constexpr double fade = 0.5;

  // What an answer was asked about, and what it said.
  struct Asked {
    Immersion immersion;
    double density = 1000.0;
    Vec6 twist;  // through the water, hull axes
    Vec6 load;   // about the center of mass, hull axes
    Mat6 added{};
  };

  void renew(const Asked& asked) { asked_ = asked, age_ = 0.0; }
  void forget() { asked_.reset(); }
  void pass(double time) { age_ += time; }
  bool empty() const { return !asked_.has_value(); }

  // The load in another state, about the center of mass, hull axes. Without a table, which is known moments after the first
  // answer, what the hull feels at rest is taken from the answer itself, along the normal: in proportion to the depth, or
  // fading where the hull had none.
  Vec6 load(const Body& body, const Immersion& immersion, double density, const Vec6& twist,
            const RestTable* table) const;

  // The water that the body carries, in proportion to what the hull displaces; without a table, to the depth.
  Mat6 added(const Immersion& immersion, const RestTable* table) const;

 private:
  std::optional<Asked> asked_;
  double age_ = 0.0;
};

}  // namespace wade
