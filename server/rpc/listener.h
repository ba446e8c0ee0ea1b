// Accepts connections and hands them over to gRPC, which would neither limit their number nor show who opened a Unix
// socket.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "proto/base/status.h"
#include "server/rpc/connections.h"

namespace relmap::rpc {

// The number of a group of users. BAD_CONFIG: there is none of this name.
Result<gid_t> group_of(const std::string& name);

// Whether the other end of a TCP connection is on this machine, which it is not if that cannot be told.
bool is_of_this_machine(int connection);

// A socket that listens. Closed when destroyed, and its file removed.
class ListeningSocket {
 public:
  // At a path, with mode 0600 or, for `group`, 0660 and that group. A file of this name is replaced, so the caller must
  // own the folder. IO_ERROR; BAD_CONFIG if the path is too long or there is no such group.
  static Result<ListeningSocket> at_path(const std::string& path, const std::string& group);
  // At each address of `host`; port 0 is any free one, the same at all. PORT_IN_USE.
  static Result<std::vector<ListeningSocket>> at_host(const std::string& host, std::uint16_t port);

  ListeningSocket(ListeningSocket&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)), path_(std::exchange(other.path_, {})) {}
  ~ListeningSocket();

  int fd() const { return fd_; }
  std::uint16_t port() const;  // of TCP
  bool is_v6() const;
  bool is_local() const;  // of TCP: only this machine itself can reach it

 private:
  explicit ListeningSocket(int fd) : fd_(fd) {}
  int fd_;
  std::string path_;  // removed with the socket; empty: TCP
};

class Listener {
 public:
  // Gets a connection of its own, for which it is responsible from then on.
  using Take = std::function<void(int listening, int connection)>;
  struct Source {
    ListeningSocket socket;
    Take take;
  };

  // Starts the thread that accepts. `connections` must outlive it.
  Listener(std::vector<Source> sources, Connections& connections);
  // Calls stop().
  ~Listener();

  // Accepts no more, and closes the sockets.
  void stop();

 private:
  void run();
  void accept_from(const Source& source);
  bool tells();
  bool turn_away(int listening);

  std::vector<Source> sources_;  // constant while the thread runs
  Connections& connections_;
  int wake_ = -1;
  int spare_ = -1;  // for turn_away()
  std::chrono::steady_clock::time_point told_{};
  std::thread thread_;
};

}  // namespace relmap::rpc
