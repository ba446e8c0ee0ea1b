#include "frontend/capture/keyframe_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace relmap {

namespace fs = std::filesystem;

namespace {

// What is not complete yet.
std::string part_of(const std::string& path) { return path + ".part"; }

}  // namespace

bool is_keyframe_file(const std::string& path) {
  std::uint32_t head[2] = {};  // the length, and what every keyframe begins with
  std::ifstream in(path, std::ios::binary);
  return in.read(reinterpret_cast<char*>(head), sizeof head) && head[1] == kKeyframeMagic;
}

Result<KeyframeFileReader> KeyframeFileReader::open(const std::string& path) {
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
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
  std::error_code error;
  if (fs::is_directory(path, error)) return {Reason::IO_ERROR, path + " is a folder"};
  if (fs::is_regular_file(path, error) && fs::file_size(path, error) > 0 && !is_keyframe_file(path))
    return {Reason::INVALID_ARGUMENT, path + " is there and holds no keyframes: it is not replaced"};
  std::ofstream out(part_of(path), std::ios::binary | std::ios::trunc);
  if (!out) return {Reason::IO_ERROR, part_of(path) + ": " + std::strerror(errno)};
  return KeyframeFileWriter(path, std::move(out));
}

KeyframeFileWriter::~KeyframeFileWriter() {
  std::error_code ignored;
  if (out_.is_open() && !any_) fs::remove(part_of(path_), ignored);
}

Status KeyframeFileWriter::write(const Keyframe& keyframe) {
  any_ = true;
  const Bytes payload = encode_keyframe(keyframe);
  const auto length = static_cast<std::uint32_t>(payload.size());
  out_.write(reinterpret_cast<const char*>(&length), sizeof length);
  out_.write(reinterpret_cast<const char*>(payload.data()), static_cast<std::streamsize>(payload.size()));
  if (!out_) return {Reason::IO_ERROR, path_ + " cannot be written"};
  return {};
}

Status KeyframeFileWriter::close() {
  out_.close();
  if (!out_) return {Reason::IO_ERROR, part_of(path_) + " cannot be written"};
  std::error_code error;
  fs::rename(part_of(path_), path_, error);
  if (error) return {Reason::IO_ERROR, "rename " + part_of(path_) + ": " + error.message()};
  return {};
}

}  // namespace relmap
