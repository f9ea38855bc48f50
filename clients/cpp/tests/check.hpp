// Checks that say where and what, and end the test.

#ifndef WADE_TESTS_CHECK_HPP
#define WADE_TESTS_CHECK_HPP

#include <cstdio>
#include <cstdlib>
#include <string>

#include "wade_client.hpp"

namespace test {

inline std::string shown(bool value) { return value ? "true" : "false"; }
inline std::string shown(wade::Status status) { return wade::message(status); }
inline std::string shown(const std::string &text) { return text; }
template <class Number>
std::string shown(Number number) {
  return std::to_string(number);
}

[[noreturn]] inline void fail(const char *file, int line, const std::string &what) {
  std::fprintf(stderr, "%s:%d: %s\n", file, line, what.c_str());
  std::exit(1);
}

template <class Left, class Right>
void equal(const Left &left, const Right &right, const char *what, const char *file, int line) {
  if (!(left == right)) fail(file, line, std::string(what) + ": " + shown(left) + " against " + shown(right));
}

}  // namespace test

#define CHECK(condition) \
  do { \
    if (!(condition)) test::fail(__FILE__, __LINE__, #condition); \
  } while (false)
#define CHECK_EQUAL(left, right) test::equal(left, right, #left, __FILE__, __LINE__)

#endif  // WADE_TESTS_CHECK_HPP
