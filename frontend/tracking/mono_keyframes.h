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

// Makes a keyframe of a picture: an appearance set and a thumbnail. `rectified` is of the session's camera. The
// appearance set is that of a localisation query (vision/picture_appearance.h), so that words mean the same in both.
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
  // Returns the next picture, as the left one of a pair; nothing ends the run. An error means that one picture is not
  // available; the run goes on.
  std::function<Result<std::optional<CapturedPair>>()> capture;
  std::function<Status(MonoPicture&)> publish;  // takes the keyframes in order; an error ends the run
  std::function<void(const Status&)> refused;   // told why a picture was left out; the message names it
};

// The number of pictures described at once is limited, since describing a picture of half a megapixel (to which they
// are reduced) takes 30 MB: 240 MB in all on any machine.
inline constexpr unsigned kMaxDescribedAtOnce = 8;

struct MonoOptions {
  std::uint32_t first_sequence = 0;
  std::optional<std::int64_t> resumed_us;  // time of the last keyframe if a session is continued
  unsigned threads = 0;  // pictures described at once, at most kMaxDescribedAtOnce; 0 means one per processor
};

// Turns each picture into a keyframe, except those that are not later than the one before (TIME_BACKWARDS), have too
// few features (TOO_FEW_FEATURES) or are not of the camera's size (BAD_SIZE). Stages are called on the caller's thread.
// Returns publish()'s error; exceptions of a stage propagate.
Status run_mono(const vision::Rectifier& rectifier, const SessionHeader& session, const MonoStages& stages,
                const MonoOptions& options = {});

}  // namespace relmap::tracking
