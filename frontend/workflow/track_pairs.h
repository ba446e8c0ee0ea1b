// Tracks stereo pairs and delivers their keyframes as a session: the common part of the workflows for recordings and
// cameras.
#pragma once

#include <functional>
#include <string>

#include "frontend/capture/stereo_source.h"
#include "frontend/workflow/run.h"
#include "proto/base/status.h"

namespace relmap::workflow {

// Prints the source's description, unless options.quiet. NOT_STEREO if it has one eye.
Status introduce_stereo(const Run& run, const capture::StereoSource& source);

struct PairsToTrack {
  capture::StereoSource& source;
  std::string name;  // the session's, unless the options give one
  // Keyframes of a new session wait until a pair was tracked from another (HeldBack). Not for a live camera, whose
  // keyframes are sent as they come.
  bool hold_back = false;
  std::function<void(const capture::StereoFrame&)> read = {};  // called with each pair as it was read
  std::function<void()> ended = {};                            // called after the last pair was tracked and counted
};
// The reasons of ImuFeed::open(), Delivery, PairOutputs and Pipeline::run(). untracked()'s reasons if no pair could be
// tracked from another; keyframes that were held back are then not sent.
Status track_pairs(Run& run, const PairsToTrack& pairs);

}  // namespace relmap::workflow
