#include "frontend/capture/picture_file.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <string>
#include <utility>

#include "frontend/capture/pgm.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

Status of_picture(const fs::path& path, const Status& status) {
  if (status.reason() == Reason::NOT_A_PICTURE)
    return {Reason::NOT_A_PICTURE, path.string() + ": neither PNG nor JPEG nor binary PGM"};
  return {status.reason(), path.string() + ": " + status.message()};
}

bool is_small_pgm(ByteSpan file) { return file.size() <= vision::kMaxPictureBytes && is_pgm(file); }

}  // namespace

// One byte more than the limit is enough to refuse a picture.
Result<Bytes> read_picture_bytes(const fs::path& path, std::size_t max_bytes) {
  std::error_code error;
  const auto size = fs::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) return {Reason::NO_SUCH_FILE, path.string() + " cannot be opened"};
  Bytes bytes(std::min<std::size_t>(size, max_bytes));
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (in.bad()) return {Reason::IO_ERROR, path.string() + " cannot be read"};
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

std::string lower_ending(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

bool is_picture_name(const fs::path& path) {
  const std::string ending = lower_ending(path);
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg" || ending == ".pgm";
}

Result<vision::Image> read_picture(const fs::path& path, double max_pixels) {
  const auto file = read_picture_bytes(path);
  if (!file.ok()) return file.status();
  if (is_small_pgm(*file)) {
    auto image = decode_pgm(*file);
    if (!image.ok()) return of_picture(path, image.status());
    return vision::reduce(std::move(*image), max_pixels);
  }
  auto picture = vision::decode_picture(*file, max_pixels);
  if (!picture.ok()) return of_picture(path, picture.status());
  return std::move(picture->grey);
}

Result<vision::PictureSize> read_picture_size(const fs::path& path) {
  const auto file = read_picture_bytes(path);
  if (!file.ok()) return file.status();
  return size_in_bytes(path, *file);
}

Result<vision::PictureSize> size_in_bytes(const fs::path& path, ByteSpan file) {
  if (is_small_pgm(file)) {
    const auto header = read_pgm_header(file);
    if (!header.ok()) return of_picture(path, header.status());
    return vision::PictureSize{header->width, header->height};
  }
  const auto size = vision::picture_size(file);
  if (!size.ok()) return of_picture(path, size.status());
  return size;
}

}  // namespace relmap::capture
