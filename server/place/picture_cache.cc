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

void PictureCache::drop_oldest() {
  while (entries_.size() > 1 && (bytes_ > kMaxCachedBytes || entries_.size() > kMaxEntries)) {
    bytes_ -= entries_.back()->bytes;
    entries_.pop_back();
  }
}

std::shared_ptr<const FramePicture> PictureCache::find(const storage::Graph& graph, FrameId frame) {
  MutexLock lock(mutex_);
  const auto known = std::find_if(entries_.begin(), entries_.end(), [&](const auto& e) { return e->frame == frame; });
  if (known != entries_.end())
    entries_.splice(entries_.begin(), entries_, known);
  else
    entries_.push_front(std::make_shared<Entry>(Entry{frame}));
  const std::shared_ptr<Entry> entry = entries_.front();
  drop_oldest();
  decoded_.wait(mutex_, [&]() RELMAP_REQUIRES(mutex_) { return entry->stage != Stage::kInWork; });
  if (entry->stage == Stage::kDecoded) return entry->picture;
  entry->stage = Stage::kInWork;
  std::shared_ptr<const FramePicture> picture;
  lock.unlock();
  try {
    picture = decode(graph, frame);
  } catch (...) {
    lock.lock();
    entry->stage = Stage::kNew;  // for the next who wants it
    decoded_.notify_all();
    throw;
  }
  lock.lock();
  entry->picture = picture;
  entry->stage = Stage::kDecoded;
  decoded_.notify_all();
  if (std::find(entries_.begin(), entries_.end(), entry) != entries_.end()) {
    entry->bytes = bytes_of(picture.get());
    bytes_ += entry->bytes;
    drop_oldest();
  }
  return picture;
}

}  // namespace relmap::place
