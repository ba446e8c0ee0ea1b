#include "frontend/capture/picture_camera.h"

#include <libexif/exif-data.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "frontend/capture/picture_file.h"

namespace relmap::capture {

namespace {

constexpr double kFilmWidth = 36;          // mm
constexpr std::size_t kHead = 256 * 1024;  // bytes; nearly all pictures have their size and EXIF in these
constexpr int kMaxFocal35mm = 10000;       // mm; no lens has more

int focal_35mm(ByteSpan file) {
  const std::unique_ptr<ExifData, void (*)(ExifData*)> exif(
      exif_data_new_from_data(file.data(), static_cast<unsigned>(file.size())), exif_data_unref);
  if (!exif) return 0;
  const ExifEntry* entry = exif_content_get_entry(exif->ifd[EXIF_IFD_EXIF], EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM);
  if (!entry || entry->format != EXIF_FORMAT_SHORT || entry->components != 1 || !entry->data) return 0;
  const int focal = exif_get_short(entry->data, exif_data_get_byte_order(exif.get()));
  return focal <= kMaxFocal35mm ? focal : 0;
}

}  // namespace

std::string PictureCamera::name() const {
  const std::string size = std::to_string(width) + 'x' + std::to_string(height);
  return focal_35mm > 0 ? size + '-' + std::to_string(focal_35mm) + "mm" : size;
}

double PictureCamera::focal_length() const { return focal_35mm * std::max(width, height) / kFilmWidth; }

Result<PictureCamera> read_picture_camera(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::file_size(path, error) <= vision::kMaxPictureBytes && !error) {
    const auto head = read_picture_bytes(path, kHead);
    const auto size = head.ok() ? size_in_bytes(path, *head) : Result<vision::PictureSize>(head.status());
    if (size.ok()) return PictureCamera{size->width, size->height, focal_35mm(*head)};
  }
  const auto file = read_picture_bytes(path);
  if (!file.ok()) return file.status();
  const auto size = size_in_bytes(path, *file);
  if (!size.ok()) return size.status();
  return PictureCamera{size->width, size->height, focal_35mm(*file)};
}

std::vector<PicturesOfCamera> by_camera(const std::vector<std::filesystem::path>& pictures) {
  std::map<PictureCamera, std::vector<std::filesystem::path>> of_camera;
  std::vector<std::filesystem::path> unreadable;
  for (const std::filesystem::path& picture : pictures) {
    const auto camera = read_picture_camera(picture);
    (camera.ok() ? of_camera[*camera] : unreadable).push_back(picture);
  }
  std::vector<PicturesOfCamera> cameras;
  for (auto& [camera, taken] : of_camera) cameras.push_back({camera, std::move(taken)});
  std::stable_sort(cameras.begin(), cameras.end(), [](const PicturesOfCamera& a, const PicturesOfCamera& b) {
    return a.pictures.size() > b.pictures.size();
  });
  if (unreadable.empty()) return cameras;
  if (cameras.empty()) cameras.emplace_back();
  std::vector<std::filesystem::path>& first = cameras.front().pictures;
  first.insert(first.end(), unreadable.begin(), unreadable.end());
  return cameras;
}

}  // namespace relmap::capture
