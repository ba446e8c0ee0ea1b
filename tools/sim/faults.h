// Faults of a simulated camera, as a function of the requested episodes and a seed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "proto/base/status.h"

namespace relmap::sim {

enum class FaultKind {
  kNone,
  kDropped,    // the pair is missing
  kBlack,      // both pictures black, for 1 s
  kLongBlack,  // for 10 s
  kSwivel,     // the head yaws at 190 deg/s, 0.25 s to the right and 0.25 s back
  kBlur,       // exposed for 40 ms, for 1 s
  kOneEye,     // one picture black for 2 s: the right one, in the next such episode the left one, alternating
  kMover,      // for 3 s a moving board (board.h) covers some 30 % of the picture
  kDoubled,    // the pixels of the previous pair, with this pair's own time
  kTimeBack,   // a time stamp 0.5 s before the previous one's
  kTimeAhead,  // a time stamp 1 h ahead; the next is right again
};

// As on the command line: "none", "dropped", "black", "long_black", "swivel", "blur", "one_eye", "mover", "doubled",
// "time_back", "time_ahead".
const char* fault_name(FaultKind kind);

struct FaultEpisode {
  FaultKind kind = FaultKind::kNone;
  int begin = 0;  // its first frame

  // The frame after its last one, at `rate` frames per second.
  int end(double rate) const;
};

// "none", "kind:frame,kind:frame...", or "all": one of each kind but dropped and long_black, with equal gaps.
// INVALID_ARGUMENT says what cannot be read.
Result<std::vector<FaultEpisode>> parse_faults(const std::string& text, int frames, double rate);

// INVALID_ARGUMENT unless the episodes begin in 1 .. frames - 1 and do not overlap.
Status check_faults(const std::vector<FaultEpisode>& episodes, int frames, double rate);

// Rotation of the head about the vertical axis between the eyes; positive to the right. Radians and seconds.
struct HeadTurn {
  double angle = 0, rate = 0, acceleration = 0;
};

class FaultSchedule {
 public:
  FaultSchedule(std::vector<FaultEpisode> episodes, double drop_share, double rate, std::uint64_t seed);

  const std::vector<FaultEpisode>& episodes() const { return episodes_; }  // sorted by their beginnings
  FaultKind at(int i) const;
  // Whether pair i is missing. The first pair is never dropped, nor is one that another fault needs.
  bool dropped(int i) const;
  bool black(int i, bool right) const;
  int shown(int i) const;  // the frame whose pixels pair i has
  HeadTurn head_turn(double frame) const;
  // Seconds since the beginning of the episode of this kind that covers the frame; negative if there is none.
  double since(FaultKind kind, double frame) const;

 private:
  const FaultEpisode* episode_at(int i) const;

  std::vector<FaultEpisode> episodes_;
  double drop_share_, rate_;
  std::uint64_t seed_;
};

}  // namespace relmap::sim
