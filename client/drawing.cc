#include "client/drawing.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace relmap::client {

Colour mix(Colour from, Colour to, double t) {
  const auto channel = [t](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(a + t * (b - a)), 0L, 255L));
  };
  return {channel(from.red, to.red), channel(from.green, to.green), channel(from.blue, to.blue)};
}

void Drawing::rectangle(const Vector2& corner, const Vector2& size, Colour fill, double opacity) {
  polygon({corner, corner + Vector2(size.x(), 0), corner + size, corner + Vector2(0, size.y())}, fill, opacity);
}

Status Drawing::save(const std::string& path) const {
  const auto bytes = file();
  return bytes.ok() ? write_file(path, *bytes) : bytes.status();
}

Status write_file(const std::string& path, const std::string& bytes) {
  std::ofstream out(path, std::ios::binary);
  out << bytes;
  out.close();
  if (!out) return {Reason::IO_ERROR, "cannot write " + path + ": " + std::strerror(errno)};
  return {};
}

Result<PictureFormat> picture_format(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".svg") return PictureFormat::kSvg;
  if (ending == ".png") return PictureFormat::kPng;
  return {Reason::INVALID_ARGUMENT, path + " ends neither in .svg nor in .png"};
}

std::unique_ptr<Drawing> make_drawing(PictureFormat format, double width, double height, Colour paper, double scale) {
  return format == PictureFormat::kSvg ? make_svg_drawing(width, height, paper)
                                       : make_png_drawing(width, height, paper, scale);
}

}  // namespace relmap::client
