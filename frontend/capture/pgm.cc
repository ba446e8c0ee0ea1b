#include "frontend/capture/pgm.h"

#include <algorithm>
#include <string>

namespace relmap::capture {

namespace {

constexpr int kMaxSide = 16384;

bool is_space(std::uint8_t c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// Returns the number after white space and comments at `at`, and moves `at` behind it. -1 if there is none, or if it
// has more than six digits.
int next_number(ByteSpan file, std::size_t& at) {
  while (at < file.size() && (is_space(file[at]) || file[at] == '#')) {
    if (file[at] == '#')
      while (at < file.size() && file[at] != '\n') ++at;
    else
      ++at;
  }
  const std::size_t begin = at;
  int number = 0;
  while (at < file.size() && file[at] >= '0' && file[at] <= '9' && at - begin < 6)
    number = 10 * number + file[at++] - '0';
  return at == begin ? -1 : number;
}

}  // namespace

bool is_pgm(ByteSpan file) { return file.size() >= 3 && file[0] == 'P' && file[1] == '5' && is_space(file[2]); }

Result<PgmHeader> read_pgm_header(ByteSpan file) {
  PgmHeader header;
  std::size_t at = 2;
  header.width = next_number(file, at);
  header.height = next_number(file, at);
  header.max_value = next_number(file, at);
  if (header.width < 1 || header.height < 1 || header.max_value < 1 || header.max_value > 65535 || at >= file.size() ||
      !is_space(file[at]))
    return {Reason::PICTURE_DAMAGED, "PGM without a header"};
  header.pixels = at + 1;  // one white space, and no comment, before the first pixel
  if (header.width > kMaxSide || header.height > kMaxSide)
    return {Reason::PICTURE_TOO_LARGE,
            "declares " + std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels"};
  const std::size_t needed = static_cast<std::size_t>(header.width) * static_cast<std::size_t>(header.height) *
                             (header.max_value > 255 ? 2u : 1u);
  if (file.size() - header.pixels < needed) return {Reason::PICTURE_DAMAGED, "PGM is cut short"};
  return header;
}

Result<vision::Image> decode_pgm(ByteSpan file) {
  const auto header = read_pgm_header(file);
  if (!header.ok()) return header.status();
  const auto max_value = static_cast<std::uint32_t>(header->max_value);
  const bool deep = max_value > 255;
  vision::Image image(header->width, header->height);
  const std::uint8_t* from = file.data() + header->pixels;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const std::uint32_t value = deep ? 256u * from[0] + from[1] : from[0];
      from += deep ? 2 : 1;
      image.row(y)[x] = static_cast<std::uint8_t>((255 * std::min(value, max_value) + max_value / 2) / max_value);
    }
  return image;
}

}  // namespace relmap::capture
