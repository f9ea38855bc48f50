// A real `wade serve`, on a port, a socket and a namespace of its own. $WADE_BIN is the binary, $WADE_VEHICLES its bundles.

#ifndef WADE_TESTS_SERVER_HPP
#define WADE_TESTS_SERVER_HPP

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "check.hpp"

namespace test {

using namespace std::chrono_literals;
using clock = std::chrono::steady_clock;

// Long enough for a busy machine: no test is about this time.
constexpr auto patience = 60s;

inline std::string environment(const char *name) {
  const char *value = std::getenv(name);
  if (value == nullptr) fail(__FILE__, __LINE__, std::string(name) + " is not set: run clients/cpp/test");
  return value;
}

// A port that nobody listens on at the moment.
inline int free_port() {
  const int probe = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  CHECK(bind(probe, reinterpret_cast<sockaddr *>(&address), size) == 0);
  CHECK(getsockname(probe, reinterpret_cast<sockaddr *>(&address), &size) == 0);
  ::close(probe);
  return ntohs(address.sin_port);
}

// Runs until it is stopped; may be killed and started again at the same places.
class Server {
 public:
  Server() {
    std::string folder = (std::filesystem::temp_directory_path() / "wade-cpp-XXXXXX").string();
    CHECK(mkdtemp(folder.data()) != nullptr);
    folder_ = folder;
    tcp_ = "127.0.0.1:" + std::to_string(free_port());
    unix_ = (folder_ / "wade.sock").string();
    namespace_ = "cpp_" + folder_.filename().string().substr(9) + "_" + std::to_string(getpid());
    configure("");
  }

  ~Server() {
    kill();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  Server(const Server &) = delete;
  Server &operator=(const Server &) = delete;

  // Has these settings beside its places from the next start on.
  void configure(const std::string &settings) {
    std::ofstream(folder_ / "wade.toml") << "[grpc]\nlisten = \"" << tcp_ << "\"\nunix_socket = \"" << unix_
                                         << "\"\n[shm]\nnamespace = \"" << namespace_ << "\"\n[http]\nlisten = \"\"\n"
                                         << settings;
    // over TCP it may ask for more than a test of something else has
    probe_ = settings.empty() ? tcp_ : "unix:" + unix_;
  }

  // Returns when it answers for a vehicle of the folder.
  void start(const std::filesystem::path &vehicles, const char *vehicle) {
    kill();
    const std::string config = (folder_ / "wade.toml").string(), binary = binary_.string();
    const std::string log = (folder_ / "log").string(), from = vehicles.string();
    process_ = fork();
    CHECK(process_ >= 0);
    if (process_ == 0) {
      const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
      dup2(file, STDERR_FILENO);
      dup2(file, STDOUT_FILENO);
      execl(binary.c_str(), binary.c_str(), "serve", "--config", config.c_str(), "--vehicles", from.c_str(),
            static_cast<char *>(nullptr));
      _exit(127);
    }
    static wade::Vehicle told;
    const auto end = clock::now() + patience;
    while (wade::get_vehicle(probe_.c_str(), vehicle, 2s, told) != wade::Status::ok) {
      if (clock::now() > end || waitpid(process_, nullptr, WNOHANG) != 0) {
        std::ifstream text(log);
        fail(__FILE__, __LINE__, "no server: " + std::string(std::istreambuf_iterator<char>(text), {}));
      }
      std::this_thread::sleep_for(20ms);
    }
  }

  void start() { start(environment("WADE_VEHICLES"), "husky"); }

  // Ends it as a crash would.
  void kill() {
    if (process_ > 0) {
      ::kill(process_, SIGKILL);
      waitpid(process_, nullptr, 0);
    }
    process_ = 0;
  }

  // Ends it as an administrator would; returns when it has ended.
  void terminate() {
    ::kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
    process_ = 0;
  }

  // Stops it as a debugger would; returns when every thread stands still.
  void freeze() {
    // the server first, so that it does not start the process of shared memory again
    ::kill(process_, SIGSTOP);
    int status = 0;
    CHECK(waitpid(process_, &status, WUNTRACED) == process_ && WIFSTOPPED(status));
    for (const pid_t child : children()) {
      ::kill(child, SIGSTOP);
      for (char state = 0; state != 'T'; std::this_thread::sleep_for(1ms)) {
        std::ifstream stat("/proc/" + std::to_string(child) + "/stat");
        const std::string text(std::istreambuf_iterator<char>(stat), {});
        CHECK(!text.empty());
        state = text[text.rfind(')') + 2];
      }
    }
  }

  // Lets it go on.
  void thaw() {
    for (const pid_t child : children()) ::kill(child, SIGCONT);
    ::kill(process_, SIGCONT);
  }

  // Starts this binary from now on.
  void serve_with(const std::filesystem::path &binary) { binary_ = binary; }

  const std::filesystem::path &folder() const { return folder_; }
  const std::string &tcp() const { return tcp_; }
  std::string socket() const { return "unix:" + unix_; }
  std::string shm() const { return "shm:" + namespace_; }

  // Every way to it.
  std::vector<std::string> addresses() const { return {shm(), tcp_, socket()}; }

 private:
  // The process that serves shared memory.
  std::vector<pid_t> children() const {
    std::vector<pid_t> found;
    for (const auto &task : std::filesystem::directory_iterator("/proc/" + std::to_string(process_) + "/task")) {
      std::ifstream file(task.path() / "children");
      for (pid_t child = 0; file >> child;) found.push_back(child);
    }
    return found;
  }

  std::filesystem::path folder_, binary_ = environment("WADE_BIN");
  std::string tcp_, unix_, namespace_, probe_;
  pid_t process_ = 0;
};

// A client that is connected.
inline wade::Client connected(const std::string &address, const char *vehicle = "husky", wade::Options options = {}) {
  wade::Client client;
  CHECK_EQUAL(client.open(address.c_str(), vehicle, options), wade::Status::ok);
  const auto status = client.wait(patience);
  if (status != wade::Status::ok) fail(__FILE__, __LINE__, address + ": " + wade::message(status) + ": " + client.reason());
  return client;
}

// A Husky that drives in shallow water.
inline wade::State wading() {
  wade::State state = wade::state(0.15F);
  state.velocity_mps[0] = 0.5F;
  return state;
}

// Asks until the forces are of this call; every call before it must have been one of the expected failures.
inline void until_answered(wade::Client &client, const wade::State &state, wade::Forces &forces) {
  const auto end = clock::now() + patience;
  for (;;) {
    const auto status = client.evaluate(state, 1s, forces);
    if (status == wade::Status::ok) return;
    if (clock::now() > end) fail(__FILE__, __LINE__, std::string("never answered: ") + wade::message(status));
    std::this_thread::sleep_for(5ms);
  }
}

}  // namespace test

#endif  // WADE_TESTS_SERVER_HPP
