#include "server/place/picture_cache.h"

#include <algorithm>
#include <utility>

#include "frontend/vision/encoded_picture.h"
#include "frontend/vision/picture.h"

namespace relmap::place {

namespace {

constexpr std::size_t kMaxCachedBytes = 16 << 20;
constexpr std::size_t kMaxEntries = 128;  // including frames without a picture

std::size_t bytes_of(const FramePicture* picture) {
  if (!picture) return 0;
  const vision::ImageView whole = picture->level(picture->first);
  return static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height) * 4 / 3;
}

std::shared_ptr<const FramePicture> decode(const storage::Graph& graph, FrameId frame) {
  const auto cold = graph.cold(frame);
  const auto session = graph.session(frame.session);
  if (!cold || cold->picture.empty() || !session) return nullptr;
  const auto size = vision::picture_size(cold->picture);  // checked before it is decoded, since it may be huge
  if (!size.ok() || size->png || size->width <= vision::kThumbnailWidth ||
      double{1} * size->width * size->height > vision::kMaxKeyframePixels)
    return nullptr;
  const StereoCamera& camera = session->header.camera;
  int first = 0;
  while (first <= vision::kMaxHalvings &&
         (size->width != camera.width >> first || size->height != camera.height >> first))
    ++first;
  if (first > vision::kMaxHalvings) return nullptr;
  auto picture = vision::decode_picture(cold->picture, 0);
  if (!picture.ok()) return nullptr;
  return std::make_shared<FramePicture>(FramePicture{vision::Pyramid(std::move(picture->grey)), first});
}

}  // namespace

std::shared_ptr<const FramePicture> PictureCache::find(const storage::Graph& graph, FrameId frame) {
  const auto known =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.frame == frame; });
  if (known != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, known);
  } else {
    entries_.push_front({frame, decode(graph, frame)});
    bytes_ += bytes_of(entries_.front().picture.get());
    while (entries_.size() > 1 && (bytes_ > kMaxCachedBytes || entries_.size() > kMaxEntries)) {
      bytes_ -= bytes_of(entries_.back().picture.get());
      entries_.pop_back();
    }
  }
  return entries_.front().picture;
}

}  // namespace relmap::place
