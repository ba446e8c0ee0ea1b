// Stereo pairs, wherever they come from, through the tracking pipeline into a session: what recordings and cameras have
// in common.
#pragma once

#include <functional>
#include <string>

#include "frontend/capture/stereo_source.h"
#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Says what the source is. NOT_STEREO: it has one eye.
Status introduce_stereo(const Run& run, const capture::StereoSource& source);

struct PairsToTrack {
  capture::StereoSource& source;
  std::string name;  // of the session, unless the options give one
  // Keyframes of a new session wait until two pairs hang together (HeldBack). What cannot be read again is sent as it
  // comes.
  bool hold_back = false;
  std::function<void(const capture::StereoFrame&)> read = {};  // each pair, as it came
  std::function<void()> ended = {};                            // the last one is tracked and counted
};
// Reasons: ImuFeed::open()'s, Delivery's, PairOutputs', Pipeline::run()'s; untracked()'s: nothing could be tracked, and
// what was held back is not sent.
Status track_pairs(Run& run, const PairsToTrack& pairs);

}  // namespace relmap::workflow
