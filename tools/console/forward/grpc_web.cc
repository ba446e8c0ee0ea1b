#include "tools/console/forward/grpc_web.h"

#include <algorithm>
#include <charconv>

#include "proto/base/base64.h"
#include "proto/base/percent.h"

namespace relmap::console {

namespace {

constexpr std::uint8_t kTrailers = 0x80, kCompressed = 0x01;

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= 64 && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

void put_head(std::string& out, std::uint8_t flags, std::size_t size) {
  out += static_cast<char>(flags);
  for (const unsigned shift : {24u, 16u, 8u, 0u}) out += static_cast<char>(static_cast<std::uint8_t>(size >> shift));
}

}  // namespace

Result<std::vector<Frame>> frames_of(std::string_view body) {
  std::vector<Frame> frames;
  while (!body.empty()) {
    if (body.size() < kFrameHead) return Status(Reason::TRUNCATED, "the body ends within the head of a frame");
    const auto flags = static_cast<std::uint8_t>(body[0]);
    if ((flags & kCompressed) != 0) return Status(Reason::UNSUPPORTED, "a frame is compressed, which is not supported");
    if ((flags & ~kTrailers) != 0)
      return Status(Reason::UNSUPPORTED, "a frame has unknown flags: " + std::to_string(flags));
    std::uint32_t size = 0;
    for (std::size_t i = 1; i < kFrameHead; ++i) size = size << 8 | static_cast<std::uint8_t>(body[i]);
    body.remove_prefix(kFrameHead);
    if (size > body.size())
      return Status(Reason::TRUNCATED,
                    "a frame of " + std::to_string(size) + " bytes has only " + std::to_string(body.size()));
    frames.push_back({(flags & kTrailers) != 0, body.substr(0, size)});
    body.remove_prefix(size);
  }
  return frames;
}

Result<std::string_view> request_message(std::string_view body, std::size_t limit) {
  const auto frames = frames_of(body);
  if (!frames.ok()) return frames.status();
  if (frames->size() != 1 || frames->front().trailers)
    return Status(Reason::INVALID_ARGUMENT,
                  "the request has " + std::to_string(frames->size()) + " frames, and should have one message");
  if (frames->front().bytes.size() > limit)
    return Status(Reason::BAD_SIZE, "the message has " + std::to_string(frames->front().bytes.size()) +
                                        " bytes, and may have " + std::to_string(limit));
  return frames->front().bytes;
}

std::string message_frame(std::string_view message) {
  std::string frame;
  frame.reserve(kFrameHead + message.size());
  put_head(frame, 0, message.size());
  return frame.append(message);
}

std::string trailers_frame(const CallEnd& end) {
  std::string text = "grpc-status:" + std::to_string(end.code) + "\r\n";
  if (!end.message.empty()) text += "grpc-message:" + percent_encoded(end.message) + "\r\n";
  if (!end.details.empty()) text += "grpc-status-details-bin:" + base64(end.details) + "\r\n";
  std::string frame;
  put_head(frame, kTrailers, text.size());
  return frame + text;
}

Result<CallEnd> read_trailers(std::string_view bytes) {
  CallEnd end;
  bool has_status = false;
  while (!bytes.empty()) {
    const std::size_t stop = std::min(bytes.find("\r\n"), bytes.size());
    const std::string_view line = bytes.substr(0, stop);
    bytes.remove_prefix(std::min(stop + 2, bytes.size()));
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos) continue;
    const std::string_view name = line.substr(0, colon), value = line.substr(colon + 1);
    if (name == "grpc-status") {
      const auto [last, error] = std::from_chars(value.data(), value.data() + value.size(), end.code);
      has_status = error == std::errc{} && last == value.data() + value.size();
    } else if (name == "grpc-message") {
      end.message = percent_decoded(value).value_or(std::string(value));
    } else if (name == "grpc-status-details-bin") {
      end.details = value;
    }
  }
  if (!has_status) return Status(Reason::CORRUPT, "the trailers have no grpc-status");
  return end;
}

std::optional<std::chrono::microseconds> timeout_of(std::string_view text) {
  constexpr std::size_t kMaxDigits = 8;
  if (text.size() < 2 || text.size() > kMaxDigits + 1) return {};
  std::int64_t count = 0;
  for (const char c : text.substr(0, text.size() - 1)) {
    if (c < '0' || c > '9') return {};
    count = 10 * count + (c - '0');
  }
  switch (text.back()) {
    case 'H':
      return std::chrono::hours(count);
    case 'M':
      return std::chrono::minutes(count);
    case 'S':
      return std::chrono::seconds(count);
    case 'm':
      return std::chrono::milliseconds(count);
    case 'u':
      return std::chrono::microseconds(count);
    case 'n':
      return std::chrono::microseconds((count + 999) / 1000);
    default:
      return {};
  }
}

bool is_forwarded(std::string_view service, std::string_view method) {
  constexpr std::string_view kOwn = "relmap.v1.";
  if (!is_name(method)) return false;
  return service == "grpc.health.v1.Health" || (service.starts_with(kOwn) && is_name(service.substr(kOwn.size())));
}

}  // namespace relmap::console
