// A box whose loads in water are known in closed form, answering as the server does, and an engine to move it.
//
// Buoyancy in any attitude is summed over a grid of columns along the axis nearest to up, each cut at the water plane. Drag
// is quadratic and added mass diagonal, both in proportion to the share under water. What a test learns from it is how a
// body moves that is asked for its loads through `Hydrodynamics`; the server's own physics has its own tests.

#pragma once

#include "core/fleet.h"

struct Box {
  double length = 1.0;  // [m]
  double width = 0.6;
  double height = 0.4;
  double mass = 60.0;        // [kg]; floats at 0.1 m
  double drag = 0.0;         // 0.5 rho Cd A of each axis [N s2/m2]
  double added_share = 0.0;  // added mass over displaced mass

  double area() const { return length * width; }
  double z0() const { return -0.5 * height; }
  double radius() const { return 0.5 * wade::norm(wade::Vec3{length, width, height}); }
  wade::Hull hull() const { return {body().center_of_mass, z0(), radius()}; }
  wade::Body body() const;
  // Part of the loads from acceleration left out, as WADE_IMPLICIT_ADDED_MASS asks. Bed clearance and level as stated.
  wade_forces answer(const wade_state& state) const;
};

// What Unreal does with a load that is put on a body for a step: half-implicit Euler with the body's own mass. A box that hits
// nothing.
wade::Motion engine_step(const wade::Body& body, const wade::Motion& motion, const wade::Vec3& force,
                         const wade::Vec3& moment, double time);

// A server that is the box: in time, late by one question, or gone.
class Planted {
 public:
  enum class Mode { InTime, Late, Gone };

  explicit Planted(const Box& box) : box_(box) {}

  wade::Ask ask();
  // Of a batch that is late nothing is kept.
  wade::AskBatch ask_batch();
  wade::Clock clock();
  // The table that the box's answers make.
  std::shared_ptr<const wade::RestTable> table() const;

  Mode mode = Mode::InTime;
  wade_state last_question{};
  // Requests so far.
  int alone = 0;
  int batches = 0;

 private:
  Box box_;
  std::uint64_t now_ = 1000;
  bool open_ = false;
  wade_state open_question_{};
  std::uint64_t open_since_ = 0;
  std::uint64_t answers_ = 0;
};

// A run of the box in still water with its surface at z = 0, unless it is moved, a frame at a time.
struct Run {
  Box box;
  double frame = 1.0 / 60.0;
  wade::Motion motion{};
  wade::Water surface{};
  Planted server{box};
  wade::Hydrodynamics water{server.ask(), server.clock(), wade::Pacing{}};
  wade::StepLoad last{};

  Run(const Box& box, double frame, double depth);
  void step();
  // Height of the bottom under water [m].
  double depth() const { return -motion.position.z + 0.5 * box.height; }
  // Kinetic and potential energy, with the velocity of the middle of the next step and the heave energy of the plane [J].
  double energy() const;
};
