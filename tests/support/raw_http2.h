// A caller that speaks HTTP/2 by hand, so that it can do what gRPC's clients never do: take nothing of an answer, or
// send half of a request. Over TCP without TLS.
#pragma once

#include <cstdint>
#include <string>

namespace relmap::testing {

class RawHttp2 {
 public:
  // Connects to HOST:PORT, numeric, from an address of this machine, as every one of 127.0.0.0/8 is; empty: from any.
  // Not connected() if that fails.
  explicit RawHttp2(const std::string& address, const std::string& from = "");
  ~RawHttp2();
  RawHttp2(RawHttp2&& other) noexcept;
  RawHttp2(const RawHttp2&) = delete;
  RawHttp2& operator=(const RawHttp2&) = delete;

  bool connected() const { return fd_ >= 0; }
  // Begins HTTP/2. `window`: how many bytes of each answer the daemon may send.
  void begin(std::uint32_t window);
  // Calls "/relmap.v1.Map/GetStatus" with the bytes of its request, of which the last `withheld` are not sent.
  void call(const std::string& path, const std::string& request, std::size_t withheld = 0);
  // Whether the daemon has closed the connection, or ended or reset the newest call.
  bool ended();
  // Whether it has closed the connection, or there was none.
  bool closed();

 private:
  void hear();
  void frame(std::uint8_t type, std::uint8_t flags, std::uint32_t stream, const std::string& payload);

  int fd_ = -1;
  std::uint32_t stream_ = 0;  // of the newest call
  std::string heard_;
  bool ended_ = false, closed_ = false;
};

}  // namespace relmap::testing
