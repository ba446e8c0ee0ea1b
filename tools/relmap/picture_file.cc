#include "tools/relmap/picture_file.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace relmap::cli {

namespace {

constexpr std::uintmax_t kMaxBytes = 16u << 20;

// A big-endian number at `at`; 0 beyond the end.
std::uint32_t number(std::string_view file, std::size_t at, std::size_t bytes) {
  if (at + bytes > file.size()) return 0;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | static_cast<std::uint8_t>(file[at + i]);
  return value;
}

// Whether the marker is a start of frame: C0..CF, except DHT (C4), JPG (C8) and DAC (CC).
bool is_frame(std::uint32_t marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

Result<PixelSize> checked(std::uint32_t width, std::uint32_t height) {
  if (width == 0 || height == 0 || width > 0x7fffffff || height > 0x7fffffff)
    return {Reason::PICTURE_DAMAGED, "the picture does not say how large it is"};
  return PixelSize{static_cast<int>(width), static_cast<int>(height)};
}

}  // namespace

Result<std::string> read_picture_file(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    return {Reason::NOT_A_PICTURE, path + " is a folder; give one of the pictures in it, a JPEG or PNG file"};
  const auto size = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) return {Reason::NO_SUCH_FILE, path + " cannot be read"};
  if (size > kMaxBytes)
    return {Reason::PICTURE_TOO_LARGE, path + " has " + std::to_string(size) + " bytes; at most 16 MB are taken"};
  return std::string(std::istreambuf_iterator<char>(in), {});
}

Status write_thumbnails(std::span<const client::PlaceMatch> places, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return {Reason::IO_ERROR, "cannot make the folder " + folder + ": " + error.message()};
  for (const client::PlaceMatch& place : places) {
    if (place.thumbnail.empty()) continue;
    const std::string name = std::to_string(place.frame.session) + "-" + std::to_string(place.frame.index) + ".jpg";
    const std::filesystem::path path = std::filesystem::path(folder) / name;
    std::ofstream out(path, std::ios::binary);
    out.write(place.thumbnail.data(), static_cast<std::streamsize>(place.thumbnail.size()));
    out.close();
    if (!out) return {Reason::IO_ERROR, path.string() + " cannot be written"};
  }
  return {};
}

Result<PixelSize> pixel_size(std::string_view file) {
  if (file.starts_with("\x89PNG\r\n\x1a\n")) return checked(number(file, 16, 4), number(file, 20, 4));
  if (!file.starts_with("\xff\xd8")) return {Reason::NOT_A_PICTURE, "the file is neither JPEG nor PNG"};
  for (std::size_t at = 2; at + 4 <= file.size();) {
    const std::uint32_t marker = number(file, at, 2);
    if (marker == 0xffff) {  // a fill byte
      ++at;
      continue;
    }
    if (marker >> 8 != 0xff) break;
    if (is_frame(marker & 0xff)) return checked(number(file, at + 7, 2), number(file, at + 5, 2));
    at += 2 + number(file, at + 2, 2);
  }
  return {Reason::PICTURE_DAMAGED, "the picture does not say how large it is"};
}

}  // namespace relmap::cli
