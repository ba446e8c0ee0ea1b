#include "frontend/capture/keyframe_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

// The name of a file that is not complete yet.
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

Status KeyframeFileReader::refuse(Reason reason, const std::string& what) const {
  return {reason, path_ + ", byte " + std::to_string(position_) + ": " + what};
}

Result<std::uint32_t> KeyframeFileReader::next_length() {
  std::uint32_t length = 0;
  if (!in_.read(reinterpret_cast<char*>(&length), sizeof length)) return refuse(Reason::TRUNCATED, "no length");
  if (length > kMaxKeyframeBytes)
    return refuse(Reason::BAD_SIZE,
                  "a keyframe of " + std::to_string(length) + " bytes; at most " + std::to_string(kMaxKeyframeBytes));
  if (length > bytes_ - position_ - sizeof length) return refuse(Reason::TRUNCATED, "ends within a keyframe");
  return length;
}

Result<std::optional<Keyframe>> KeyframeFileReader::next() {
  if (position_ == bytes_) return std::optional<Keyframe>();
  const auto length = next_length();
  if (!length.ok()) return length.status();
  Bytes payload(*length);
  if (!in_.read(reinterpret_cast<char*>(payload.data()), *length))
    return refuse(Reason::TRUNCATED, "ends within a keyframe");
  auto keyframe = decode_keyframe(payload);
  if (!keyframe.ok()) return refuse(keyframe.reason(), keyframe.status().message());
  position_ += sizeof *length + *length;
  return std::optional<Keyframe>(std::move(*keyframe));
}

Result<std::optional<Bytes>> KeyframeFileReader::skip(std::size_t max_bytes) {
  if (position_ == bytes_) return std::optional<Bytes>();
  const auto length = next_length();
  if (!length.ok()) return length.status();
  Bytes beginning(std::min<std::size_t>(*length, max_bytes));
  position_ += sizeof *length + *length;
  if (!in_.read(reinterpret_cast<char*>(beginning.data()), static_cast<std::streamsize>(beginning.size())) ||
      !in_.seekg(static_cast<std::streamoff>(position_)))
    return refuse(Reason::TRUNCATED, "cannot be read");
  return std::optional<Bytes>(std::move(beginning));
}

void KeyframeFileReader::rewind() {
  in_.clear();
  in_.seekg(0);
  position_ = 0;
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

}  // namespace relmap::capture
