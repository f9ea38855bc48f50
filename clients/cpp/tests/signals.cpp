// Promise: a program that has not touched SIGPIPE lives on when a server goes away under it, whenever that is, and its handling of
// the signal stays its own.

#include <signal.h>
#include <sys/un.h>

#include <atomic>
#include <thread>

#include "server.hpp"

using namespace test;
using wade::Status;

namespace {

bool is_default() {
  struct sigaction now = {};
  sigset_t blocked;
  CHECK(sigaction(SIGPIPE, nullptr, &now) == 0 && pthread_sigmask(SIG_BLOCK, nullptr, &blocked) == 0);
  return now.sa_handler == SIG_DFL && sigismember(&blocked, SIGPIPE) == 0;
}

// A peer that accepts and reads no more: the first byte that is written to it is a broken pipe, every time.
class Deaf {
 public:
  Deaf() {
    std::string folder = (std::filesystem::temp_directory_path() / "wade-cpp-XXXXXX").string();
    CHECK(mkdtemp(folder.data()) != nullptr);
    path_ = folder + "/wade.sock";
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    CHECK(bind(listener_, reinterpret_cast<sockaddr *>(&address), sizeof address) == 0 && listen(listener_, 8) == 0);
    thread_ = std::thread([this] {
      for (int peer; (peer = accept(listener_, nullptr, nullptr)) >= 0; ++accepted_) {
        shutdown(peer, SHUT_RD);
        std::this_thread::sleep_for(20ms);
        ::close(peer);
      }
    });
  }

  ~Deaf() {
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
    std::error_code ignored;
    std::filesystem::remove_all(std::filesystem::path(path_).parent_path(), ignored);
  }

  std::string address() const { return "unix:" + path_; }
  int accepted() const { return accepted_; }

 private:
  std::string path_;
  int listener_ = -1;
  std::atomic<int> accepted_ = 0;
  std::thread thread_;
};

void a_peer_that_is_gone_when_it_is_written_to() {
  Deaf peer;
  wade::Client client;
  CHECK_EQUAL(client.open(peer.address().c_str(), "husky"), Status::ok);
  const auto end = clock::now() + patience;
  while (peer.accepted() < 5) {
    CHECK(clock::now() < end);
    wade::Forces forces;
    CHECK(client.evaluate(wading(), 10ms, forces) != Status::ok);
    std::this_thread::sleep_for(10ms);
  }
  static wade::Vehicle vehicle;
  const int before = peer.accepted();
  CHECK_EQUAL(wade::get_vehicle(peer.address().c_str(), "husky", 2s, vehicle), Status::no_server);
  // the peer counts on a thread of its own
  while (peer.accepted() <= before) CHECK(clock::now() < end);
  CHECK(is_default());
}

// Asks without a pause while the server is ended in the ordinary way and started again.
void a_server_that_is_restarted_again_and_again() {
  Server server;
  server.start();
  wade::Client client = connected(server.addresses()[2]);
  std::atomic<bool> done = false;
  std::atomic<int> answered = 0;
  std::thread host([&] {
    wade::Forces forces;
    while (!done) answered += client.evaluate(wading(), 5ms, forces) == Status::ok;
  });
  for (int round = 0; round < 12; ++round) {
    const int before = answered;
    const auto end = clock::now() + patience;
    while (answered < before + 20) CHECK(clock::now() < end);
    server.terminate();
    server.start();
  }
  done = true;
  host.join();
  CHECK(is_default());
}

// A client is closed in good time while nobody answers it.
void a_client_that_is_closed_while_the_server_hangs() {
  Server server;
  server.start();
  for (const auto &address : server.addresses()) {
    wade::Client client = connected(address);
    server.freeze();
    wade::Forces forces;
    CHECK(client.evaluate(wading(), 1ms, forces) != Status::ok);
    const auto start = clock::now();
    client = wade::Client();
    CHECK(clock::now() - start < 30s);
    server.thaw();
  }
}

}  // namespace

int main() {
  CHECK(is_default());
  a_peer_that_is_gone_when_it_is_written_to();
  a_server_that_is_restarted_again_and_again();
  a_client_that_is_closed_while_the_server_hangs();
  CHECK(is_default());
}
