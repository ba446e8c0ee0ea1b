// The scenarios of `relmap-bench rba`.
#pragma once

#include <cstdint>
#include <string>

#include "tools/bench/report.h"

namespace relmap::bench {

// The figure of eight of docs/method.md, 5: the cost of a keyframe, and the accuracy of the adaptive solution compared
// with the full one and with a sliding window by Ceres.
struct Figure8Options {
  std::uint32_t window = 8;
  int seeds = 1;
  double births = 11.1;  // landmarks born in a frame
  bool full = true;      // compare with the full solution
  std::string picture;   // empty: none
};

// Time of an update, by keyframe (paper, Figure 12).
void run_figure8(const Figure8Options& options, Report& report);
// Registration error by the size of the region that a new keyframe activates (paper, Figure 14).
void run_regions(const Figure8Options& options, Report& report);

// Which closures should become edges of the graph (paper, 3.1: an open question; docs/method.md, 2): few, so that the
// graph stays nearly a tree, or every one.
struct EdgesOptions {
  std::uint32_t window = 8;
  int seeds = 1;
  bool full = true;     // also compute the full solution
  std::string picture;  // empty: none
};

void run_edges(const EdgesOptions& options, Report& report);

// The relative solution against the Euclidean one, by Ceres to convergence: on the simulated figure eight (paper,
// Figure 16), and on recorded stereo measurements.
struct EuclideanOptions {
  std::uint32_t window = 8;
  int seeds = 1;
  double births = 0;    // landmarks born in a frame
  std::string data;     // folder of the data sets
  std::string picture;  // empty: none
};

void run_euclidean(const EuclideanOptions& options, Report& report);
// Throws StatusError (NO_SUCH_FILE) where a data set is not there.
void run_real(const EuclideanOptions& options, Report& report);

// Motion that the robot cannot sense, by train or lift: its camera sees the cabin stand still while both move.
// Afterwards it closes a loop, so that no single global frame fits the measurements.
struct LiftOptions {
  std::uint32_t window = 8;
  int seeds = 1;
  std::string picture;  // of the train: error by keyframe; empty: none
};

void run_lift(const LiftOptions& options, Report& report);

// The cost of relative bundle adjustment in growing maps: at loops of any length, over many laps of one circuit, and
// over a drive that is far larger than memory.
struct ScaleOptions {
  std::uint32_t frames = 0;  // of the loop, of a lap, or of the exploration
  std::uint32_t laps = 1000;
  std::uint32_t window = 8;
  int seeds = 1;
  std::uint64_t memory_budget_mb = 256;  // of the exploration
  std::string data;                      // its folder; empty: a temporary one
  std::string picture;                   // file for a plot; empty: none
};

// Closes a loop of `frames` frames once, and drives on for a window.
void run_loop(const ScaleOptions& options, Report& report);
// Drives one circuit again and again: the cost of the second and of the last lap.
void run_laps(const ScaleOptions& options, Report& report);
// Drives without loops, through the store: the cost of the first and of the last tenth.
void run_exploration(const ScaleOptions& options, Report& report);

}  // namespace relmap::bench
