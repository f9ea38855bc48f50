// Tests that register themselves, and two expectations.

#pragma once

#include <cmath>
#include <cstdio>
#include <vector>

#include "core/vector.h"

struct Test {
  const char* name;
  void (*run)();
};

inline std::vector<Test>& all_tests() {
  static std::vector<Test> tests;
  return tests;
}

inline int& failures() {
  static int count = 0;
  return count;
}

#define TEST(name)                                                                       \
  static void name();                                                                    \
  static const bool name##_registered = (all_tests().push_back({#name, name}), true);    \
  static void name()

inline void expect(bool holds, const char* what, const char* file, int line) {
  if (holds) return;
  ++failures();
  std::printf("%s:%d: does not hold: %s\n", file, line, what);
}

inline void expect_near(double value, double wanted, double within, const char* what, const char* file, int line) {
  if (std::fabs(value - wanted) <= within) return;
  ++failures();
  std::printf("%s:%d: %s is %.9g, not %.9g within %.3g\n", file, line, what, value, wanted, within);
}

#define EXPECT(condition) expect((condition), #condition, __FILE__, __LINE__)
#define EXPECT_NEAR(value, wanted, within) expect_near((value), (wanted), (within), #value, __FILE__, __LINE__)
#define EXPECT_VECTOR(value, wanted, within) \
  expect_near(wade::norm((value) - (wanted)), 0.0, (within), #value " - " #wanted, __FILE__, __LINE__)
