// A connection to a server of HTTP on this machine that says exactly what a test wants, over TCP without TLS.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cctype>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace relmap::console::testing {

struct Answer {
  int status = 0;                              // 0: the connection was closed without an answer
  std::map<std::string, std::string> headers;  // names in lower case; the last of those that are repeated
  std::string body;                            // without the framing of chunks
  bool whole = false;                          // it came to its end
};

class RawBrowser {
 public:
  // All of 127.0.0.0/8 is this machine.
  explicit RawBrowser(std::uint16_t port, const char* to = "127.0.0.1", const char* from = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_in own = address_of(from, 0), other = address_of(to, port);
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0 ||
        ::connect(socket_, reinterpret_cast<const sockaddr*>(&other), sizeof other) != 0)
      throw std::runtime_error("nobody listens");
  }
  ~RawBrowser() { close(); }
  RawBrowser(const RawBrowser&) = delete;
  RawBrowser& operator=(const RawBrowser&) = delete;

  void close() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }

  // As much of it as the server takes.
  RawBrowser& send(std::string_view text) {
    while (!text.empty()) {
      const ssize_t sent = ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
      if (sent <= 0) break;
      text.remove_prefix(static_cast<std::size_t>(sent));
    }
    return *this;
  }

  // Reads more; false: the connection was closed, or nothing came within `patience`.
  bool receive(std::chrono::milliseconds patience = std::chrono::minutes(5)) {
    pollfd ready{socket_, POLLIN, 0};
    if (::poll(&ready, 1, static_cast<int>(patience.count())) <= 0) return false;
    char bytes[65536];
    const ssize_t got = ::recv(socket_, bytes, sizeof bytes, 0);
    if (got <= 0) return false;
    unread_.append(bytes, static_cast<std::size_t>(got));
    return true;
  }

  // Whether the server has closed the connection, after what it still had to say.
  bool is_closed() {
    while (receive()) {
    }
    char byte = 0;
    return ::recv(socket_, &byte, 1, MSG_DONTWAIT | MSG_PEEK) == 0 || errno == ECONNRESET;
  }

  // The next answer. `head_only`: to a HEAD.
  Answer answer(bool head_only = false) {
    Answer answer = head();
    if (answer.status == 0) return answer;
    if (head_only || answer.status == 204 || answer.status == 304) {
      answer.whole = true;
    } else if (answer.headers["transfer-encoding"] == "chunked") {
      while (const auto next = chunk()) {
        if (next->empty()) answer.whole = true;
        if (next->empty()) break;
        answer.body += *next;
      }
    } else {
      const auto size = static_cast<std::size_t>(std::atoll(answer.headers["content-length"].c_str()));
      while (unread_.size() < size && receive()) {
      }
      answer.whole = unread_.size() >= size;
      answer.body = take(std::min(size, unread_.size()));
    }
    return answer;
  }

  // Its status and headers only. The body is read by chunk().
  Answer head() {
    Answer answer;
    std::size_t end = 0;
    while ((end = unread_.find("\r\n\r\n")) == std::string::npos)
      if (!receive()) return answer;
    std::string head = take(end + 4);
    answer.status = std::atoi(head.c_str() + std::string_view("HTTP/1.1 ").size());
    for (std::size_t at = head.find("\r\n") + 2; at + 2 < head.size();) {
      const std::size_t stop = head.find("\r\n", at), colon = head.find(": ", at);
      std::string name = head.substr(at, colon - at);
      for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      answer.headers[name] = head.substr(colon + 2, stop - colon - 2);
      at = stop + 2;
    }
    return answer;
  }

  // The next chunk of a body, empty at its end; nullopt: the connection was closed before.
  std::optional<std::string> chunk() {
    std::size_t line = 0;
    while ((line = unread_.find("\r\n")) == std::string::npos)
      if (!receive()) return {};
    std::size_t size = 0;
    std::from_chars(unread_.data(), unread_.data() + line, size, 16);
    while (unread_.size() < line + 2 + size + 2)
      if (!receive()) return {};
    take(line + 2);
    std::string bytes = take(size);
    take(2);
    return bytes;
  }

 private:
  static sockaddr_in address_of(const char* host, std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    if (::inet_pton(AF_INET, host, &address.sin_addr) != 1) throw std::runtime_error("no address");
    return address;
  }

  std::string take(std::size_t size) {
    std::string taken = unread_.substr(0, size);
    unread_.erase(0, size);
    return taken;
  }

  int socket_;
  std::string unread_;
};

}  // namespace relmap::console::testing
