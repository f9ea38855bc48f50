// A network between client and server: a TCP relay on the loopback that adds a delay, keeps the order of the bytes, and is cut on
// command.
//
// The delay is added round-trip time: half of it in each direction, counted from when the relay has read the bytes. Bytes never
// leave early; how late they leave is measured (`benches/remote`). TCP's own handshake is not delayed, nor is there loss or a
// limit to the rate.

#ifndef WADE_BENCHES_RELAY_HPP
#define WADE_BENCHES_RELAY_HPP

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <list>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace relay {

using std::chrono::nanoseconds;
using clock = std::chrono::steady_clock;

class Relay {
 public:
  // To a server at 127.0.0.1.
  Relay(int server_port, nanoseconds round_trip) : server_port_(server_port), delay_(round_trip / 2) {
    wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (wake_ < 0 || !take_port() || listen(listener_, 64) != 0) throw std::runtime_error("the relay cannot listen");
    thread_ = std::thread([this] { run(); });
  }

  ~Relay() {
    command(Command::stop, never);
    thread_.join();
    ::close(listener_);
    ::close(wake_);
  }

  Relay(const Relay &) = delete;
  Relay &operator=(const Relay &) = delete;

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

  // Resets every connection and refuses new ones until `restore`. Returns when that is done.
  void cut() { command(Command::cut, never); }
  // The same for a time, after which the relay lets connections through by itself.
  void cut(nanoseconds time) { command(Command::cut, clock::now() + time); }
  // Lets connections through again. Returns when that is done.
  void restore() { command(Command::restore, never); }
  // When it last let connections through after a cut; none while it is cut, and before the first cut.
  std::optional<clock::time_point> restored() const {
    const std::lock_guard lock(mutex_);
    return restored_;
  }

 private:
  enum class Command { none, cut, restore, stop };
  static constexpr clock::time_point never = clock::time_point::max();

  struct Chunk {
    clock::time_point due;
    std::vector<char> bytes;  // none: the end of what the sender writes
    std::size_t sent = 0;
  };

  // One way of a connection.
  struct Way {
    int from = -1, to = -1;
    std::deque<Chunk> chunks{};
    bool ended = false, full = false;
  };

  struct Connection {
    std::array<Way, 2> ways;
    bool broken = false;
  };

  // The thread sleeps until so long before bytes are due and then polls, since a sleeper may wake late.
  static constexpr nanoseconds polled{100000};
  // Reads whose bytes may be under way in one direction of a connection.
  static constexpr std::size_t most_chunks = 4096;

  static sockaddr_in loopback(int port) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return address;
  }

  static sockaddr *as_any(sockaddr_in &address) { return reinterpret_cast<sockaddr *>(&address); }

  void command(Command what, clock::time_point until) {
    std::unique_lock lock(mutex_);
    command_ = what;
    until_ = until;
    const std::uint64_t one = 1;
    if (write(wake_, &one, sizeof one) != sizeof one) std::abort();
    done_.wait(lock, [this] { return command_ == Command::none; });
  }

  void run() {
    // sleeps end when they should
    prctl(PR_SET_TIMERSLACK, 1UL);
    clock::time_point restore_at = never;
    bool is_cut = false;
    std::vector<pollfd> watched;
    for (;;) {
      watched.assign({{wake_, POLLIN, 0}, {is_cut ? -1 : listener_, POLLIN, 0}});
      clock::time_point next = restore_at;
      for (const Connection &connection : connections_) {
        for (const Way &way : connection.ways) {
          const bool reads = !way.ended && way.chunks.size() < most_chunks;
          // each socket once: what it is read for by one way, and written to by the other
          const bool writes = other(connection, way).full;
          watched.push_back({way.from, static_cast<short>((reads ? POLLIN : 0) | (writes ? POLLOUT : 0)), 0});
          if (!way.chunks.empty() && !way.full) next = std::min(next, way.chunks.front().due);
        }
      }
      wait(watched, next);

      if (watched[0].revents != 0) {
        std::uint64_t count = 0;
        if (read(wake_, &count, sizeof count) < 0) count = 0;
        const std::lock_guard lock(mutex_);
        const Command what = std::exchange(command_, Command::none);
        if (what == Command::cut) {
          break_all();
          // a port that is taken and not listened on refuses
          ::close(listener_);
          if (!take_port()) std::abort();
          is_cut = true;
          restored_.reset();
          restore_at = until_;
        }
        if (what == Command::restore && is_cut) listen_again(is_cut, restore_at);
        if (what == Command::stop) break_all();
        done_.notify_all();
        if (what == Command::stop) return;
        continue;
      }
      if (clock::now() >= restore_at) {
        const std::lock_guard lock(mutex_);
        listen_again(is_cut, restore_at);
      }
      if (watched[1].revents != 0) accept_one();
      for (Connection &connection : connections_) {
        for (Way &way : connection.ways) {
          receive(connection, way);
          pass_on(connection, way);
        }
      }
      connections_.remove_if([](const Connection &connection) {
        const bool over = connection.broken || (done(connection.ways[0]) && done(connection.ways[1]));
        if (over) close_both(connection, connection.broken);
        return over;
      });
    }
  }

  static const Way &other(const Connection &connection, const Way &way) {
    return connection.ways[&way == &connection.ways[0] ? 1 : 0];
  }

  static bool done(const Way &way) { return way.ended && way.chunks.empty(); }

  static void wait(std::vector<pollfd> &watched, clock::time_point next) {
    timespec timeout = {};
    if (next != never) {
      const auto left = next - clock::now() - polled;
      if (left > nanoseconds(0)) {
        const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(left);
        timeout.tv_sec = seconds.count();
        timeout.tv_nsec = static_cast<long>(nanoseconds(left - seconds).count());
      }
    }
    ppoll(watched.data(), watched.size(), next != never ? &timeout : nullptr, nullptr);
  }

  void accept_one() {
    const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (client < 0) return;
    const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = loopback(server_port_);
    if (server < 0 || connect(server, as_any(address), sizeof address) != 0) {
      if (server >= 0) ::close(server);
      ::close(client);
      return;
    }
    fcntl(server, F_SETFL, O_NONBLOCK);
    const int on = 1;
    for (const int end : {client, server}) setsockopt(end, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    Connection connection;
    connection.ways[0].from = connection.ways[1].to = client;
    connection.ways[0].to = connection.ways[1].from = server;
    connections_.push_back(std::move(connection));
  }

  void receive(Connection &connection, Way &way) {
    static thread_local std::array<char, 65536> room;
    while (!way.ended && !connection.broken && way.chunks.size() < most_chunks) {
      const ssize_t count = recv(way.from, room.data(), room.size(), 0);
      if (count < 0) {
        connection.broken = errno != EAGAIN && errno != EINTR;
        return;
      }
      way.ended = count == 0;
      way.chunks.push_back({clock::now() + delay_, std::vector<char>(room.data(), room.data() + count)});
    }
  }

  static void pass_on(Connection &connection, Way &way) {
    way.full = false;
    while (!way.chunks.empty() && !connection.broken && way.chunks.front().due <= clock::now()) {
      Chunk &chunk = way.chunks.front();
      if (chunk.bytes.empty()) shutdown(way.to, SHUT_WR);
      while (chunk.sent < chunk.bytes.size()) {
        const ssize_t count = send(way.to, chunk.bytes.data() + chunk.sent, chunk.bytes.size() - chunk.sent, MSG_NOSIGNAL);
        if (count < 0) {
          way.full = errno == EAGAIN || errno == EINTR;
          connection.broken = !way.full;
          return;
        }
        chunk.sent += static_cast<std::size_t>(count);
      }
      way.chunks.pop_front();
    }
  }

  // A socket at this relay's port, any at first, that does not listen yet.
  bool take_port() {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const int on = 1;
    setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address = loopback(port_);
    socklen_t size = sizeof address;
    const bool taken = bind(listener_, as_any(address), size) == 0 && getsockname(listener_, as_any(address), &size) == 0;
    port_ = ntohs(address.sin_port);
    return taken;
  }

  void listen_again(bool &is_cut, clock::time_point &restore_at) {
    if (listen(listener_, 64) != 0) std::abort();
    is_cut = false;
    restore_at = never;
    restored_ = clock::now();
  }

  void break_all() {
    for (const Connection &connection : connections_) close_both(connection, true);
    connections_.clear();
  }

  static void close_both(const Connection &connection, bool by_reset) {
    const linger at_once = {1, 0};
    for (const Way &way : connection.ways) {
      if (by_reset) setsockopt(way.from, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
      ::close(way.from);
    }
  }

  const int server_port_;
  const nanoseconds delay_;
  int port_ = 0, listener_ = -1, wake_ = -1;
  std::list<Connection> connections_;

  mutable std::mutex mutex_;
  std::condition_variable done_;
  Command command_ = Command::none;
  clock::time_point until_ = never;
  std::optional<clock::time_point> restored_;
  std::thread thread_;
};

}  // namespace relay

#endif  // WADE_BENCHES_RELAY_HPP
