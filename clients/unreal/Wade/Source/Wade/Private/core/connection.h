// Where a vehicle's server is, the files with which a client connects to it, and why it is not connected.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "wade_client.h"

namespace wade {

struct Connection {
  // As wade_options wants it.
  std::string address;
  std::string vehicle;
  // As wade_credentials wants them; empty for none.
  std::string ca_file;
  std::string certificate_file;
  std::string key_file;
  std::string token_file;
};

// The texts are those of the connection.
inline wade_credentials credentials_of(const Connection& connection) {
  wade_credentials credentials = wade_default_credentials();
  credentials.ca_file = connection.ca_file.c_str();
  credentials.certificate_file = connection.certificate_file.c_str();
  credentials.key_file = connection.key_file.c_str();
  credentials.token_file = connection.token_file.c_str();
  return credentials;
}

// Begins to look for the server; null where that fails. A file that cannot be used is not such a failure: it is a reason.
inline wade_status open_client(const Connection& connection, std::uint32_t wait, std::uint32_t max_batch, wade_client*& client) {
  wade_options options = wade_default_options();
  options.address = connection.address.c_str();
  options.vehicle = connection.vehicle.c_str();
  options.wait = wait;
  options.max_batch = max_batch;
  const wade_credentials credentials = credentials_of(connection);
  return wade_client_open_with_credentials(&options, &credentials, &client);
}

// What the server says of the vehicle; without an answer the reason.
inline wade_status ask_vehicle(const Connection& connection, std::uint64_t timeout_ns, wade_vehicle& answer, std::string& reason) {
  const wade_credentials credentials = credentials_of(connection);
  char text[1024] = {};
  const wade_status status = wade_get_vehicle_with_credentials(connection.address.c_str(), connection.vehicle.c_str(),
                                                               &credentials, timeout_ns, &answer, text, sizeof text);
  // an argument that is wrong has no reason of its own
  reason = text[0] != '\0' || status == WADE_STATUS_OK ? text : wade_status_message(status);
  return status;
}

// Why a client is not connected. A link that stays Connecting or Lost may change its reason, such as from a server that is not there
// to one with the certificate of another authority.
class ConnectionReason {
 public:
  // How often `changes` looks [s].
  static constexpr double interval = 1.0;

  // Empty where it is connected.
  const std::string& read(const wade_client* client) {
    char text[1024] = {};
    wade_client_reason(client, text, sizeof text);
    return last_ = text;
  }

  // The reason where it is another one than that read last, and not empty; else null. `time`: since the call before [s].
  const std::string* changes(const wade_client* client, double time) {
    since_ += time;
    if (since_ < interval) return nullptr;
    since_ = 0.0;
    const std::string before = last_;
    return read(client) != before && !last_.empty() ? &last_ : nullptr;
  }

 private:
  std::string last_;
  double since_ = 0.0;
};

}  // namespace wade
