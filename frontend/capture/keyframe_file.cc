#include "frontend/capture/keyframe_file.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>

namespace relmap {

bool is_keyframe_file(const std::string& path) {
  // The length, and the magic number that a keyframe's canonical bytes begin with (docs/protocol.md).
  std::array<char, 8> begin{};
  std::ifstream in(path, std::ios::binary);
  return in.read(begin.data(), begin.size()) && std::string_view(begin.data() + 4, 4) == "RMKF";
}

Result<KeyframeFileReader> KeyframeFileReader::open(const std::string& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) return {Reason::NO_SUCH_FILE, path + " cannot be opened"};
  return KeyframeFileReader(path, std::move(in), bytes);
}

Result<std::optional<Keyframe>> KeyframeFileReader::next() {
  const auto refuse = [&](Reason reason, const std::string& what) -> Status {
    return {reason, path_ + ", byte " + std::to_string(position_) + ": " + what};
  };
  if (position_ == bytes_) return std::optional<Keyframe>();
  std::uint32_t length = 0;
  if (!in_.read(reinterpret_cast<char*>(&length), sizeof length)) return refuse(Reason::TRUNCATED, "no length");
  if (length > kMaxKeyframeBytes)
    return refuse(Reason::BAD_SIZE,
                  "a keyframe of " + std::to_string(length) + " bytes; at most " + std::to_string(kMaxKeyframeBytes));
  Bytes payload(length);
  if (!in_.read(reinterpret_cast<char*>(payload.data()), length))
    return refuse(Reason::TRUNCATED, "ends within a keyframe");
  auto keyframe = decode_keyframe(payload);
  if (!keyframe.ok()) return refuse(keyframe.reason(), keyframe.status().message());
  position_ += sizeof length + length;
  return std::optional<Keyframe>(std::move(*keyframe));
}

Result<KeyframeFileWriter> KeyframeFileWriter::create(const std::string& path) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  if (!out) return {Reason::IO_ERROR, path + ": " + std::strerror(errno)};
  return KeyframeFileWriter(path, std::move(out));
}

Status KeyframeFileWriter::write(const Keyframe& keyframe) {
  const Bytes payload = encode_keyframe(keyframe);
  const auto length = static_cast<std::uint32_t>(payload.size());
  out_.write(reinterpret_cast<const char*>(&length), sizeof length);
  out_.write(reinterpret_cast<const char*>(payload.data()), static_cast<std::streamsize>(payload.size()));
  if (!out_) return {Reason::IO_ERROR, path_ + " cannot be written"};
  return {};
}

Status KeyframeFileWriter::close() {
  out_.close();
  if (!out_) return {Reason::IO_ERROR, path_ + " cannot be written"};
  return {};
}

}  // namespace relmap
