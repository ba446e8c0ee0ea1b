#include "client/server_address.h"

#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "proto/base/hex.h"

namespace relmap::client {

namespace {

bool is_host_port(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return false;
  unsigned port = 0;
  const char *begin = text.data() + colon + 1, *end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, port);
  return error == std::errc{} && stop == end && port > 0 && port < 65536;
}

// gRPC reads the address as a URI (RFC 3986).
std::string uri_of_socket(const std::string& path) {
  std::string uri = "unix:";
  for (const char c : path) {
    const auto byte = static_cast<std::uint8_t>(c);
    if (c == '%' || c == '?' || c == '#')
      uri += "%" + hex(ByteSpan(&byte, 1));
    else
      uri += c;
  }
  return uri;
}

// Replaces the address of a daemon that listens on all interfaces by loopback.
std::string reachable(const std::string& address) {
  for (const std::string any : {"0.0.0.0:", "[::]:"})
    if (address.starts_with(any)) return "localhost:" + address.substr(any.size());
  return address;
}

}  // namespace

Result<ServerAddress> resolve_server(const std::string& server) {
  std::error_code error;
  const bool folder = std::filesystem::is_directory(server, error);
  const auto refused = [&](const std::string& what) -> Status {
    return {
        Reason::NOT_ALLOWED,
        "you may not read " + what +
            ": run this as the user of the daemon, or as a member of the group that may use its socket (socket_group; "
            "relmap in the package: adduser USER relmap)"};
  };
  if (!folder) {
    if (is_host_port(server) || server.starts_with("unix:/")) return ServerAddress{server, 0, ""};
    if (error == std::errc::permission_denied) return refused(server);
    return {Reason::INVALID_ARGUMENT, "'" + server + "' is neither a data folder nor HOST:PORT"};
  }
  const std::string path = server + "/endpoint";
  std::ifstream file(path);
  if (!file && errno == EACCES) return refused(path);
  if (!file) return {Reason::UNREACHABLE, "no daemon serves " + server + " (there is no " + path + ")"};
  ServerAddress address;
  std::string socket;
  for (std::string key; file >> key;) {
    if (key == "socket")
      std::getline(file >> std::ws, socket);
    else if (key == "address")
      file >> address.address;
    else if (key == "pid")
      file >> address.pid;
    else if (key == "boot")
      file >> address.boot_id;
    else
      std::getline(file, key);  // ignores the lines of later versions
  }
  if ((socket.empty() && !is_host_port(address.address)) || address.boot_id.empty())
    return {Reason::CORRUPT, path + " does not say where the daemon answers"};
  address.address = socket.empty() ? reachable(address.address) : uri_of_socket(socket);
  return address;
}

}  // namespace relmap::client
