#include "tests/support/raw_http2.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

namespace relmap::testing {

namespace {

// RFC 9113, 6.
constexpr std::uint8_t kData = 0, kHeaders = 1, kResetStream = 3, kSettings = 4;
constexpr std::uint8_t kEndStream = 1, kEndHeaders = 4;
constexpr std::size_t kFrameHeader = 9;

std::string big_endian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text.push_back(static_cast<char>(value >> 8 * i));
  return text;
}

// A field of a header, literally, without compression (RFC 7541, 6.2.2).
std::string field(const std::string& name, const std::string& value) {
  return std::string(1, '\0') + big_endian(static_cast<std::uint32_t>(name.size()), 1) + name +
         big_endian(static_cast<std::uint32_t>(value.size()), 1) + value;
}

}  // namespace

RawHttp2::RawHttp2(const std::string& address, const std::string& from) {
  const std::size_t colon = address.rfind(':');
  const auto numeric = [](const std::string& host, int port) {
    sockaddr_in socket_address{};
    socket_address.sin_family = AF_INET;
    socket_address.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, host.c_str(), &socket_address.sin_addr);
    return socket_address;
  };
  const sockaddr_in to = numeric(address.substr(0, colon), std::stoi(address.substr(colon + 1)));
  const sockaddr_in own = numeric(from.empty() ? "0.0.0.0" : from, 0);
  fd_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd_ < 0) return;
  if (bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0 ||
      connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    close(fd_);
    fd_ = -1;
  }
}

RawHttp2::RawHttp2(RawHttp2&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      stream_(other.stream_),
      heard_(std::move(other.heard_)),
      ended_(other.ended_),
      closed_(other.closed_) {}

RawHttp2::~RawHttp2() {
  if (fd_ >= 0) close(fd_);
}

void RawHttp2::begin(std::uint32_t window) {
  const std::string preface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
  (void)!send(fd_, preface.data(), preface.size(), MSG_NOSIGNAL);
  constexpr std::uint32_t kInitialWindowSize = 4;
  frame(kSettings, 0, 0, big_endian(kInitialWindowSize, 2) + big_endian(window, 4));
}

void RawHttp2::call(const std::string& path, const std::string& request, std::size_t withheld) {
  stream_ = stream_ == 0 ? 1 : stream_ + 2;
  frame(kHeaders, kEndHeaders, stream_,
        field(":method", "POST") + field(":scheme", "http") + field(":path", path) + field(":authority", "relmapd") +
            field("content-type", "application/grpc") + field("te", "trailers"));
  std::string message = std::string(1, '\0') + big_endian(static_cast<std::uint32_t>(request.size()), 4) + request;
  message.resize(message.size() - withheld);
  frame(kData, withheld == 0 ? kEndStream : 0, stream_, message);
}

void RawHttp2::frame(std::uint8_t type, std::uint8_t flags, std::uint32_t stream, const std::string& payload) {
  const std::string bytes = big_endian(static_cast<std::uint32_t>(payload.size()), 3) + big_endian(type, 1) +
                            big_endian(flags, 1) + big_endian(stream, 4) + payload;
  (void)!send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

void RawHttp2::hear() {
  std::array<char, 65536> buffer{};
  for (;;) {
    const ssize_t size = recv(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) closed_ = ended_ = true;
    if (size <= 0) break;
    heard_.append(buffer.data(), static_cast<std::size_t>(size));
  }
  while (heard_.size() >= kFrameHeader) {
    const auto byte = [&](std::size_t at) { return static_cast<std::uint8_t>(heard_[at]); };
    const std::size_t size = static_cast<std::size_t>(byte(0)) << 16 | static_cast<std::size_t>(byte(1)) << 8 | byte(2);
    if (heard_.size() < kFrameHeader + size) break;
    const bool last = byte(3) == kResetStream || (byte(3) == kHeaders && (byte(4) & kEndStream) != 0);
    if (last && byte(8) == (stream_ & 0xff)) ended_ = true;
    heard_.erase(0, kFrameHeader + size);
  }
}

bool RawHttp2::ended() {
  hear();
  return ended_;
}

bool RawHttp2::closed() {
  hear();
  return closed_;
}

}  // namespace relmap::testing
