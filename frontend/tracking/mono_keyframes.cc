#include "frontend/tracking/mono_keyframes.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <future>
#include <string>
#include <thread>
#include <utility>

#include "frontend/vision/encoded_picture.h"
#include "frontend/vision/picture_appearance.h"

namespace relmap::tracking {

namespace {

using Described = Result<MonoPicture>;

Status of_picture(const CapturedPair& picture, Reason reason, const std::string& what) {
  return {reason, "picture " + std::to_string(picture.index) + " (" + picture.picture + "): " + what};
}

Described describe(const vision::Rectifier& rectifier, const SessionHeader& session, const CapturedPair& captured) {
  const auto begin = std::chrono::steady_clock::now();
  vision::Image rectified;
  if (!rectifier.passes_through())
    if (Status status = rectifier.left(captured.left, rectified); !status.ok())
      return of_picture(captured, status.reason(), status.message());
  const vision::ImageView picture = rectified.empty() ? vision::ImageView(captured.left) : vision::ImageView(rectified);
  if (picture.width != session.camera.width || picture.height != session.camera.height)
    return of_picture(captured, Reason::BAD_SIZE, "not of the camera's size");
  MonoPicture result;
  result.keyframe = mono_keyframe(session, 0, captured.time_us, picture);
  if (const std::size_t features = result.keyframe.appearance.size(); features < kMinPlaceFeatures)
    return of_picture(captured, Reason::TOO_FEW_FEATURES,
                      std::to_string(features) + " features; a place needs " + std::to_string(kMinPlaceFeatures));
  result.index = captured.index;
  result.picture = captured.picture;
  result.description_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace

Keyframe mono_keyframe(const SessionHeader& session, std::uint32_t sequence, std::int64_t time_us,
                       vision::ImageView rectified) {
  Keyframe keyframe;
  keyframe.session = session;
  keyframe.sequence = sequence;
  keyframe.time_us = time_us;
  keyframe.appearance = vision::picture_appearance(rectified);
  std::erase_if(keyframe.appearance,
                [&](const AppearanceFeature& feature) { return !session.camera.in_picture(feature.u, feature.v); });
  keyframe.picture = vision::make_thumbnail(rectified);
  return keyframe;
}

Status run_mono(const vision::Rectifier& rectifier, const SessionHeader& session, const MonoStages& stages,
                const MonoOptions& options) {
  const unsigned threads = options.threads > 0 ? options.threads : std::max(1U, std::thread::hardware_concurrency());
  const std::size_t at_once = std::min(threads, kMaxDescribedAtOnce);
  std::optional<std::int64_t> last_us = options.resumed_us;
  std::uint32_t sequence = options.first_sequence;
  std::deque<std::future<Described>> in_work;  // the destructor of each waits for its thread
  for (bool more = true; more || !in_work.empty();) {
    while (more && in_work.size() < at_once) {
      auto captured = stages.capture();
      if (!captured.ok()) {
        stages.refused(captured.status());
        continue;
      }
      more = captured->has_value();
      if (!more) break;
      CapturedPair& picture = **captured;
      if (last_us && picture.time_us <= *last_us) {
        stages.refused(of_picture(picture, Reason::TIME_BACKWARDS,
                                  std::to_string(picture.time_us) + " us is not later than the picture before, " +
                                      std::to_string(*last_us) + " us"));
        continue;
      }
      last_us = picture.time_us;
      in_work.push_back(std::async(std::launch::async, [&rectifier, &session, taken = std::move(picture)] {
        return describe(rectifier, session, taken);
      }));
    }
    if (in_work.empty()) break;
    Described described = in_work.front().get();
    in_work.pop_front();
    if (!described.ok()) {
      stages.refused(described.status());
      continue;
    }
    described->keyframe.sequence = sequence++;
    if (Status status = stages.publish(*described); !status.ok()) return status;
  }
  return {};
}

}  // namespace relmap::tracking
