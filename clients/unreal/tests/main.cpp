#include "expect.h"

int main() {
  for (const Test& test : all_tests()) {
    const int before = failures();
    test.run();
    std::printf("test %s ... %s\n", test.name, failures() == before ? "ok" : "FAILED");
  }
  std::printf("%zu tests, %d failures\n", all_tests().size(), failures());
  return failures() == 0 ? 0 : 1;
}
