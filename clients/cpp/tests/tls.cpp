// Promise: over TLS the answers are those of the Unix socket. What a client may not have, or cannot read, ends soon in a status and a
// reason that names the cause, and what is renewed on disk is found without opening the client again.

#include <sys/stat.h>

#include <cstring>

#include "server.hpp"

using namespace test;
using wade::Credentials;
using wade::Status;

namespace {

// A reason is there by then, on a machine that is busy with other things too. Connecting takes a second at most.
constexpr auto soon = 10s;

// An authority made by openssl, and what it signs.
class Authority {
 public:
  explicit Authority(const std::string &name) {
    std::string folder = (std::filesystem::temp_directory_path() / "wade-ca-XXXXXX").string();
    CHECK(mkdtemp(folder.data()) != nullptr);
    folder_ = folder;
    openssl("req -x509 -days 2 -subj /CN=" + name + " -keyout ca.key -out ca.pem" + curve);
  }

  ~Authority() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  Authority(const Authority &) = delete;
  Authority &operator=(const Authority &) = delete;

  // Writes NAME.pem and NAME.key, for so many days from now.
  void sign(const std::string &name, int days, const std::string &extensions) const {
    write(name + ".ext", extensions + "\n");
    openssl("req -subj /CN=" + name + " -keyout " + name + ".key -out " + name + ".csr" + curve);
    openssl("x509 -req -in " + name + ".csr -CA ca.pem -CAkey ca.key -CAcreateserial -days " + std::to_string(days) +
            " -extfile " + name + ".ext -out " + name + ".pem");
  }

  void sign_server(const std::string &name, int days) const { sign(name, days, "subjectAltName=DNS:localhost,IP:127.0.0.1"); }
  void sign_client(const std::string &name, int days) const { sign(name, days, "extendedKeyUsage=clientAuth"); }

  // Adds a token to the server's file, and writes it to NAME.token.
  void issue(const std::string &name, const std::string &role) const {
    run("'" + environment("WADE_BIN") + "' token " + name + " --roles " + role + " --file tokens.toml > " + name + ".token");
  }

  void write(const std::string &name, const std::string &text) const { std::ofstream(folder_ / name) << text; }

  std::string path(const std::string &name) const { return (folder_ / name).string(); }

  // Settings of a server with the certificate of this name.
  std::string settings(const std::string &name) const {
    return "[tls]\ncertificate = \"" + path(name + ".pem") + "\"\nkey = \"" + path(name + ".key") + "\"\nclient_ca = \"" +
           path("ca.pem") + "\"\n[access]\ntokens = \"" + path("tokens.toml") + "\"\ncertificates = { rig = [\"query\"] }\n";
  }

 private:
  static constexpr const char *curve = " -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes";

  void openssl(const std::string &arguments) const { run("openssl " + arguments); }
  void run(const std::string &command) const {
    if (std::system(("cd '" + folder_.string() + "' && " + command + " 2>>log").c_str()) != 0) fail(__FILE__, __LINE__, command);
  }

  std::filesystem::path folder_;
};

// The paths of what a client is given; empty for none.
struct Files {
  std::string ca, certificate, key, token;

  Credentials credentials() const { return {ca.c_str(), certificate.c_str(), key.c_str(), token.c_str()}; }
};

std::string encrypted(const Server &server) { return "https://" + server.tcp(); }

wade::Client opened(const std::string &address, const Files &files, const char *vehicle = "husky") {
  wade::Client client;
  CHECK_EQUAL(client.open(address.c_str(), vehicle, {WADE_WAIT_BLOCK, 4, files.credentials()}), Status::ok);
  return client;
}

wade::Client connected_with(const std::string &address, const Files &files) {
  wade::Client client = opened(address, files);
  if (client.wait(patience) != Status::ok) fail(__FILE__, __LINE__, address + ": " + client.reason());
  CHECK_EQUAL(client.reason(), std::string());
  return client;
}

// What the server's model says, without what differs from call to call.
wade::Forces evaluated(wade::Client &client, const wade::State &state) {
  wade::Forces forces;
  CHECK_EQUAL(client.evaluate(state, patience, forces), Status::ok);
  forces.age_ns = forces.answer = forces.compute_ns = 0;
  return forces;
}

void same_answers(const Server &server, const Files &files) {
  wade::Client plain = connected(server.socket(), "husky", {WADE_WAIT_BLOCK, 4}), tls = connected_with(encrypted(server), files);
  for (const std::uint64_t session : {std::uint64_t{0}, std::uint64_t{1}}) {
    for (int step = 0; step < 5; ++step) {
      wade::State state = wading();
      state.velocity_mps[0] += 0.1F * static_cast<float>(step);
      state.session = session;
      state.time_step_s = 0.01F;
      const wade::Forces expected = evaluated(plain, state), forces = evaluated(tls, state);
      CHECK(std::memcmp(&forces, &expected, sizeof forces) == 0 && forces.force_n[2] > 0.0F);
    }
  }
  const std::vector<wade::State> states(4, wading());
  std::vector<wade::Forces> expected(4), batch(4);
  CHECK_EQUAL(plain.evaluate_batch(states, patience, expected), Status::ok);
  CHECK_EQUAL(tls.evaluate_batch(states, patience, batch), Status::ok);
  CHECK(std::memcmp(batch[3].force_n, expected[3].force_n, sizeof batch[3].force_n) == 0);
  static wade::Vehicle vehicle;
  std::string reason = "none";
  CHECK_EQUAL(wade::get_vehicle(encrypted(server).c_str(), "husky", files.credentials(), patience, vehicle, reason), Status::ok);
  CHECK(reason.empty() && vehicle.surface_count > 0);
}

// Neither the client nor the question about the vehicle gets through: each says why, soon.
void refused(const std::string &address, const Files &files, Status expected, const std::vector<std::string> &parts) {
  auto start = clock::now();
  wade::Client client = opened(address, files);
  std::string reason = client.reason();
  while (reason == "the client has not connected yet") {
    CHECK(clock::now() - start < soon);
    std::this_thread::sleep_for(5ms);
    reason = client.reason();
  }
  const std::chrono::duration<double> connecting = clock::now() - start;
  CHECK_EQUAL(client.wait(0s), expected);
  wade::Forces forces;
  start = clock::now();
  CHECK_EQUAL(client.evaluate(wading(), 100s, forces), expected);  // at once
  CHECK(forces.age_ns == WADE_NEVER && forces.force_n[2] == 0.0F);
  std::vector<wade::State> states(4, wading());
  std::vector<wade::Forces> batch(4);
  CHECK_EQUAL(client.evaluate_batch(states, 100s, batch), expected);
  client.close();
  CHECK(clock::now() - start < soon);
  static wade::Vehicle vehicle;
  std::string why;
  start = clock::now();
  CHECK_EQUAL(wade::get_vehicle(address.c_str(), "husky", files.credentials(), 4s, vehicle, why), expected);
  CHECK(clock::now() - start < soon);
  for (const auto &part : parts) {
    if (reason.find(part) == std::string::npos) fail(__FILE__, __LINE__, part + " is not in: " + reason);
    if (why.find(part) == std::string::npos) fail(__FILE__, __LINE__, part + " is not in: " + why);
  }
  std::printf("%.2f s: %s: %s\n", connecting.count(), wade::message(expected), reason.c_str());
}

void files_that_cannot_be_used(const Server &server, const Authority &authority) {
  const std::string address = encrypted(server), ca = authority.path("ca.pem");
  const std::string certificate = authority.path("rig.pem"), key = authority.path("rig.key"), token = authority.path("rig.token");
  const auto wrong = [&](const Files &files, const std::vector<std::string> &parts) {
    refused(address, files, Status::credentials, parts);
  };
  const std::string missing = authority.path("nowhere.pem"), text = authority.path("text.pem"), empty = authority.path("empty");
  authority.write("text.pem", "no certificate\n");
  authority.write("broken.pem", "-----BEGIN CERTIFICATE-----\n!!\n-----END CERTIFICATE-----\n");
  authority.write("empty", "\n");
  wrong({missing, "", "", ""}, {"CA", missing, "No such file"});
  wrong({text, "", "", ""}, {"CA", text, "PEM"});
  wrong({authority.path("broken.pem"), "", "", ""}, {"CA", authority.path("broken.pem"), "PEM"});
  wrong({std::filesystem::temp_directory_path().string(), "", "", ""}, {"CA", "must be a file"});
  // nobody writes to it: whoever opened it would wait
  CHECK(mkfifo(authority.path("pipe").c_str(), 0600) == 0);
  wrong({ca, "", "", authority.path("pipe")}, {"token", authority.path("pipe"), "must be a file"});
  wrong({ca, certificate, "", ""}, {"key", certificate, "go together"});
  wrong({ca, "", key, ""}, {"certificate", key, "go together"});
  wrong({ca, text, key, ""}, {"certificate", text, "PEM"});
  wrong({ca, certificate, text, ""}, {"key", text, "PEM"});
  wrong({ca, certificate, authority.path("server.key"), ""}, {certificate, authority.path("server.key"), "KeyMismatch"});
  wrong({ca, "", "", missing}, {"token", missing, "No such file"});
  wrong({ca, "", "", empty}, {"token", empty});
  wrong({ca, "", "", ca}, {"token", ca});
  // 192.0.2.1 has no host: nothing is sent there
  const std::string elsewhere = "192.0.2.1:50051";
  refused(elsewhere, {"", "", "", token}, Status::credentials, {"token", token, "https://"});
  refused(elsewhere, {ca, "", "", ""}, Status::credentials, {"CA", ca, "https://"});
  // nothing of it is read where the server knows its own user
  (void)connected_with(server.socket(), {missing, missing, missing, missing});
  (void)connected_with(server.shm(), {missing, missing, missing, missing});
}

// A library of another size of the credentials, or none of them.
void arguments(const Server &server) {
  wade_options options = wade_default_options();
  const std::string address = server.socket();
  options.address = address.c_str();
  options.vehicle = "husky";
  wade_credentials credentials = wade_default_credentials();
  wade_client *client = nullptr;
  CHECK(wade_client_open_with_credentials(&options, nullptr, &client) == WADE_STATUS_OK);
  wade_client_close(client);
  credentials.size += 8;
  CHECK(wade_client_open_with_credentials(&options, &credentials, &client) == WADE_STATUS_ABI_MISMATCH && client == nullptr);
  CHECK(wade_client_open_with_credentials(&options, &credentials, nullptr) == WADE_STATUS_INVALID_ARGUMENT);
  static wade::Vehicle vehicle;
  CHECK(wade_get_vehicle_with_credentials(options.address, "husky", &credentials, 1, &vehicle, nullptr, 0) ==
        WADE_STATUS_ABI_MISMATCH);
  credentials = wade_default_credentials();
  credentials.ca_file = "/nowhere/ca.pem";
  char reason[12];
  CHECK(wade_get_vehicle_with_credentials("https://127.0.0.1:1", "husky", &credentials, 1000000000, &vehicle, reason,
                                          sizeof reason) == WADE_STATUS_CREDENTIALS);
  CHECK_EQUAL(std::string(reason), std::string("CA: /nowher"));
}

// Asks until a call ends so.
void until(wade::Client &client, Status expected) {
  wade::Forces forces;
  for (const auto end = clock::now() + patience; client.evaluate(wading(), 1s, forces) != expected;) {
    if (clock::now() > end) fail(__FILE__, __LINE__, wade::message(expected) + std::string(" never came: ") + client.reason());
    std::this_thread::sleep_for(20ms);
  }
}

void renewals(Server &server, const Authority &authority) {
  const std::string ca = authority.path("ca.pem");
  // a certificate that has expired, until it is renewed on disk
  authority.sign_client("rig", -1);
  const Files rig{ca, authority.path("rig.pem"), authority.path("rig.key"), ""};
  wade::Client client = opened(encrypted(server), rig);
  CHECK(client.wait(1s) != Status::ok);
  std::printf("expired: %s: %s\n", wade::message(client.wait(0s)), client.reason().c_str());
  authority.sign_client("rig", 2);
  CHECK_EQUAL(client.wait(patience), Status::ok);
  // the server is started again with another certificate
  wade::Forces before, forces;
  CHECK_EQUAL(client.evaluate(wading(), patience, before), Status::ok);
  server.kill();
  authority.sign_server("server", 1);
  server.start();
  until(client, Status::ok);
  CHECK_EQUAL(client.evaluate(wading(), patience, forces), Status::ok);
  CHECK(std::memcmp(forces.force_n, before.force_n, sizeof forces.force_n) == 0 && forces.answer > before.answer);
  // a token that the server does not take any more, while the connection lives, until there is another
  wade::Client shows = connected_with(encrypted(server), {ca, "", "", authority.path("rig.token")});
  authority.write("tokens.toml", "");
  until(shows, Status::refused);
  CHECK_EQUAL(shows.evaluate(wading(), 100s, forces), Status::refused);
  const auto start = clock::now();
  while (shows.reason().find("Unauthenticated") == std::string::npos) {
    CHECK(clock::now() - start < soon);
    std::this_thread::sleep_for(20ms);
  }
  authority.issue("rig", "query");
  until(shows, Status::ok);
  CHECK_EQUAL(client.evaluate(wading(), patience, forces), Status::ok);
}

// Takes connections and says nothing.
class Silent {
 public:
  Silent() {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    CHECK(bind(listener_, reinterpret_cast<sockaddr *>(&address), size) == 0 && listen(listener_, 64) == 0);
    CHECK(getsockname(listener_, reinterpret_cast<sockaddr *>(&address), &size) == 0);
    address_ = "https://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  ~Silent() { ::close(listener_); }
  Silent(const Silent &) = delete;
  Silent &operator=(const Silent &) = delete;

  const std::string &address() const { return address_; }

 private:
  int listener_;
  std::string address_;
};

}  // namespace

int main() {
  const Authority authority("ca"), other("other");
  authority.sign_server("server", 2);
  authority.sign_server("expired", -1);
  authority.sign("elsewhere", 2, "subjectAltName=DNS:elsewhere");
  for (const char *name : {"rig", "guest"}) authority.sign_client(name, 2);
  authority.issue("rig", "query");
  authority.issue("watch", "observe");
  const std::string ca = authority.path("ca.pem");
  const Files by_certificate{ca, authority.path("rig.pem"), authority.path("rig.key"), ""};
  const Files by_token{ca, "", "", authority.path("rig.token")};
  Server server;

  server.start();
  refused(encrypted(server), by_token, Status::no_server, {"https://"});  // it speaks no TLS
  (void)connected_with(server.tcp(), {"", "", "", authority.path("rig.token")});
  refused("https://127.0.0.1:" + std::to_string(free_port()), by_token, Status::no_server, {"refused"});
  const Silent silent;
  refused(silent.address(), by_token, Status::no_server, {"no connection within"});

  const std::pair<const char *, const char *> wrong[] = {{"expired", "Expired"}, {"elsewhere", "not valid for name"}};
  for (const auto &[name, says] : wrong) {
    server.configure(authority.settings(name));
    server.start();
    refused(encrypted(server), by_certificate, Status::no_server, {"certificate", says});
  }

  server.configure(authority.settings("server"));
  server.start();
  same_answers(server, by_certificate);
  same_answers(server, by_token);
  arguments(server);
  refused(encrypted(server), {other.path("ca.pem"), "", "", by_token.token}, Status::no_server, {"UnknownIssuer"});
  refused(encrypted(server), {ca, "", "", ""}, Status::refused, {"Unauthenticated", "token", "certificate"});
  refused(encrypted(server), {ca, authority.path("guest.pem"), authority.path("guest.key"), ""}, Status::refused,
          {"PermissionDenied", "guest", "query"});
  refused(encrypted(server), {ca, "", "", authority.path("watch.token")}, Status::refused, {"PermissionDenied", "watch", "query"});
  refused(server.tcp(), {}, Status::no_server, {"https://"});
  files_that_cannot_be_used(server, authority);
  renewals(server, authority);
  std::printf("answers over TLS, refusals and renewals\n");
  return 0;
}
