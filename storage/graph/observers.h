// Who sees a landmark. Facts are the observations; each landmark's list of its first observers is derived from them
// (Landmark::observers, docs/method.md, 2). It ends when the landmark is *settled*: 32 frames have seen it, or a fifth
// pass has. What is seen of it later measures the frame that sees it, and moves the landmark no more.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "storage/graph/graph.h"
#include "storage/graph/local_graph.h"

namespace relmap::storage {

inline constexpr std::size_t kMaxObservers = 32;
inline constexpr std::size_t kMaxPasses = 4;
// Frames of one session, so many apart at most, see a landmark in one pass.
inline constexpr std::uint32_t kPassFrames = 30;

// Whether a landmark with this list is settled: the list is full.
bool is_settled(const std::vector<FrameId>& observers);

// The landmarks in force, those that are there, that a frame's observations mean, each once, ascending; into
// `not_needed`, likewise, those that it sees and of which there is no need (storage/graph/binding.h).
std::vector<LandmarkId> landmarks_seen(const Graph& graph, const FrameWarm& frame,
                                       std::vector<LandmarkId>* not_needed = nullptr);

// Orders a list of frames as the map took them in, each once and lost ones not at all, and cuts it where it is full.
void keep_first_observers(const Graph& graph, std::vector<FrameId>* frames);

// Whether two frames see a landmark in one pass.
bool in_one_pass(FrameId a, FrameId b);

// Frames whose walk up (storage/graph/local_graph.h) leads over one of `frames`, in `depth` steps at most; these among
// them. What a place has been passed by, however often, is there.
std::vector<FrameId> frames_above(const Graph& graph, const std::vector<FrameId>& frames, std::uint32_t depth);
// Frames that may have a path from a base.
std::vector<FrameId> frames_in_reach(const Graph& graph, FrameId base);

// Landmark::observers, found anew: reads all frames in reach of a base, once for the landmarks of one base that are
// asked for in turn, and what a frame sees once for bases near each other. The graph must not change meanwhile.
class FirstObservers {
 public:
  explicit FirstObservers(const Graph& graph) : graph_(graph), local_(graph) {}

  std::vector<FrameId> of(LandmarkId landmark);

 private:
  const std::vector<LandmarkId>& seen_from(FrameId frame);

  const Graph& graph_;
  LocalGraph local_;
  std::vector<LocalStep> path_;
  FrameId base_;
  std::vector<FrameId> in_reach_;  // of base_
  std::unordered_map<FrameId, std::vector<LandmarkId>> seen_;
};

}  // namespace relmap::storage
