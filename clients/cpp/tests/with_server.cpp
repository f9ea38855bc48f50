// Runs a program beside a server of its own: with_server PROGRAM. The program gets every address of the server, or the first one
// where it takes but one.

#include <sys/wait.h>

#include <cstring>

#include "server.hpp"

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  test::Server server;
  server.start();
  std::string command = std::string("'") + argv[1] + "'";
  const std::string name = std::filesystem::path(argv[1]).filename();
  for (const auto &address : server.addresses()) {
    command += " '" + address + "'";
    if (name == "float" || name == "float_static" || name == "loop") break;
  }
  if (name == "latency") command += " --calls 20";
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}
