// The shape of the map, or of some of its sessions, for drawing: the skeleton that the daemon tells, laid out in one
// frame for each connected part. Of a small map it has every keyframe, of a larger one so many points that a picture
// shows no more.
#pragma once

#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "client/skeleton_relaxation.h"
#include "client/tear.h"
#include "proto/base/quantile.h"
#include "tools/relmap/chosen_sessions.h"

namespace relmap::cli {

struct ShapeChoice {
  std::vector<std::string> sessions = {};  // numbers or names; none: all except mono sessions
  bool removed = false;                    // with closures that were removed
  std::vector<FrameId> points = {};        // frames that become points whatever the level: labels, ends of routes
};

struct MapShape {
  ChosenSessions chosen;
  client::Skeleton skeleton;  // with closures that are not in force
  client::RelaxedSkeleton layout;

  std::uint64_t closures_in_force() const;  // with those that are not told, but stand behind one that is
  std::uint64_t keyframes() const { return skeleton.frames; }
  const SE3* find(FrameId frame) const;  // T_root_frame; null: the frame is no point

  // Where the points are in the layout.
  struct At {
    std::size_t part = 0, place = 0;
  };
  std::unordered_map<FrameId, At> at;
};

// Reads the skeleton of the chosen sessions, with progress on stderr, and makes the frames of the choice its points.
// EMPTY_MAP: the sessions have no frames. The reasons of read_chosen_sessions() and Client::skeleton().
Result<MapShape> read_map_shape(const ShapeChoice& choice, client::Client& client, terminal::Console& console);
// Lays it out. The reasons of client::relax_skeleton().
Status lay_out(MapShape& shape);

// Makes `frames` points of the skeleton: a step that goes over one of them is divided in proportion to the frames
// before and after it. Frames that the skeleton does not go over are left out. The time of a new point is not known (0)
// if that of a neighbour is not.
void add_points(client::Skeleton& skeleton, std::vector<FrameId> frames);

// "72,250 points stand for 1,000,000 keyframes"; empty if every keyframe is a point.
std::string shape_text(const MapShape& shape);

// The edges that the layout stretches by more than kTearSigmas, the worst first.
std::vector<client::Tear> tears_of(const MapShape& shape);
// The loop closures that it stretches most, by more than one standard deviation; the worst first, at most ten.
std::vector<client::Tear> strained_of(const MapShape& shape);

// For each part, of each of its points: the standard deviation of its position relative to the part's root, metres;
// infinite where steps that nothing measured lie between.
std::vector<std::vector<double>> uncertainty_of(const MapShape& shape);

// Those of the largest part, ascending, each with the number of keyframes that its point stands for; without infinite
// ones.
std::vector<Weighted> keyframe_sigmas(const MapShape& shape);

// The keyframes of each day (UTC, "2026-11-30"). Those between two points are taken for evenly spaced in time. A point
// whose time is not known has no day, nor have the keyframes between it and its neighbours.
std::map<std::string, std::uint64_t> keyframes_by_day(const client::Skeleton& skeleton);

}  // namespace relmap::cli
