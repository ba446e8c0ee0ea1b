// The framing of gRPC-Web (application/grpc-web+proto): each frame is a byte of flags, its length as four bytes, the
// highest first, and as many bytes. Flag 0x80 says that these are trailers as text, 0x01 that they are compressed. See
// https://github.com/grpc/grpc/blob/master/doc/PROTOCOL-WEB.md
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/status.h"

namespace relmap::console {

inline constexpr std::size_t kFrameHead = 5;

struct Frame {
  bool trailers = false;
  std::string_view bytes;  // within the text that it was read from
};

// All frames of a body. TRUNCATED: it ends within one. UNSUPPORTED: one is compressed, or has unknown flags.
Result<std::vector<Frame>> frames_of(std::string_view body);

// The message of a request: its only frame. TRUNCATED and UNSUPPORTED as above; INVALID_ARGUMENT: there are none or
// several frames, or it has trailers; BAD_SIZE: it has more than `limit` bytes.
Result<std::string_view> request_message(std::string_view body, std::size_t limit);

std::string message_frame(std::string_view message);

// How a call ended, as its last frame tells it.
struct CallEnd {
  int code = 0;  // grpc-status
  std::string message = {};
  std::string details = {};  // grpc-status-details-bin, before base64
};
std::string trailers_frame(const CallEnd& end);
// What such a frame says; CORRUPT if it has no grpc-status. Details stay in base64.
Result<CallEnd> read_trailers(std::string_view bytes);

// The value of a grpc-timeout header: at most eight digits and one of H, M, S, m, u and n. Rounded up. nullopt: it is
// malformed.
std::optional<std::chrono::microseconds> timeout_of(std::string_view text);

// Whether callers may have this method forwarded: "/relmap.v1.SERVICE/METHOD" or one of gRPC's health service.
bool is_forwarded(std::string_view service, std::string_view method);

}  // namespace relmap::console
