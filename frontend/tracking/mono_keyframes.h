// Pictures of one camera to the keyframes of a mono session: an appearance set and a thumbnail each, nothing measured.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "frontend/tracking/pipeline.h"
#include "frontend/vision/rectify.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::tracking {

// With fewer features a picture can neither be recognised nor confirmed (docs/method.md, 7).
inline constexpr std::size_t kMinPlaceFeatures = 30;

// `rectified` is of the session's camera. The appearance set is that of a question (vision/picture_appearance.h), so
// that words mean the same in both.
Keyframe mono_keyframe(const SessionHeader& session, std::uint32_t sequence, std::int64_t time_us,
                       vision::ImageView rectified);

// A picture that became a keyframe.
struct MonoPicture {
  Keyframe keyframe;
  std::uint64_t index = 0;  // in the source
  std::string picture;      // its file name
  double description_ms = 0;
};

struct MonoStages {
  // The next picture, as the left one; nothing ends the run. An error is one picture that cannot be had.
  std::function<Result<std::optional<CapturedPair>>()> capture;
  std::function<Status(MonoPicture&)> publish;  // in order; an error ends the run
  std::function<void(const Status&)> refused;   // why a picture was left out; the message names it
};

// Pictures described at once: one of half a megapixel, to which they are reduced, takes 30 MB meanwhile, so all of them
// take 240 MB on whatever machine.
inline constexpr unsigned kMaxDescribedAtOnce = 8;

struct MonoOptions {
  std::uint32_t first_sequence = 0;
  std::optional<std::int64_t> resumed_us;  // time of the last keyframe where a session goes on
  unsigned threads = 0;  // described at once; 0: as many as there are processors. At most kMaxDescribedAtOnce
};

// Every picture becomes a keyframe but one that is not later than the one before (TIME_BACKWARDS), has too few features
// (TOO_FEW_FEATURES) or is not of the camera's size (BAD_SIZE). Stages are called by the caller's thread. Returns
// publish()'s error; what a stage throws comes out.
Status run_mono(const vision::Rectifier& rectifier, const SessionHeader& session, const MonoStages& stages,
                const MonoOptions& options = {});

}  // namespace relmap::tracking
