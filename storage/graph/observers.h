// Who sees a landmark. The observations are the facts; each landmark's list of its first observers is derived from them
// (Landmark::observers, docs/method.md, 2). The list is full when the landmark is *fixed*: 32 frames have seen it, or a
// fifth pass has. Later observations measure the frame that sees the landmark, and move the landmark no more.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "storage/graph/graph.h"
#include "storage/graph/local_graph.h"

namespace relmap::storage {

inline constexpr std::size_t kMaxObservers = 32;
inline constexpr std::size_t kMaxPasses = 4;
// Frames of one session that are at most this far apart see a landmark in one pass.
inline constexpr std::uint32_t kPassFrames = 30;

// Whether a landmark with this list of observers is fixed, that is, whether the list is full.
bool is_fixed(const std::vector<FrameId>& observers);

// The landmarks in force that a frame's observations mean, without those that are lost; each once, ascending.
// `not_needed` receives, likewise, those that the frame sees but that are not needed (storage/graph/binding.h).
std::vector<LandmarkId> landmarks_seen(const Graph& graph, const FrameWarm& frame,
                                       std::vector<LandmarkId>* not_needed = nullptr);

// Sorts frames into the order in which the map took them in, removes duplicates and frames that are lost, and cuts the
// list where it is full.
void keep_first_observers(const Graph& graph, std::vector<FrameId>* frames);

// Whether two frames see a landmark in one pass.
bool in_one_pass(FrameId a, FrameId b);

// Frames whose walk up (storage/graph/local_graph.h) leads to one of `frames` in at most `depth` steps, `frames`
// included. Every pass of a place is among them, however many there are.
std::vector<FrameId> frames_above(const Graph& graph, const std::vector<FrameId>& frames, std::uint32_t depth);
// Frames that may have a path from `base`.
std::vector<FrameId> frames_in_reach(const Graph& graph, FrameId base);

// Computes Landmark::observers anew. It reads all frames in reach of a base, once for landmarks of one base that are
// asked for in a row, and what a frame sees once for bases near each other. The graph must not change meanwhile.
class FirstObservers {
 public:
  explicit FirstObservers(const Graph& graph) : graph_(graph), local_(graph) {}

  std::vector<FrameId> of(LandmarkId landmark);

 private:
  const std::vector<LandmarkId>& seen_from(FrameId frame);  // valid until the next call

  const Graph& graph_;
  LocalGraph local_;
  std::vector<LocalStep> path_;
  FrameId base_;
  std::vector<FrameId> in_reach_;  // of base_
  std::unordered_map<FrameId, std::vector<LandmarkId>> seen_;
};

}  // namespace relmap::storage
