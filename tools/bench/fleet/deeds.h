// A log of what the robots of a fleet did and heard, written at once, so that it survives kill -9.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace relmap::bench {

struct Deed {
  enum class Kind : std::uint32_t {
    kStarted,       // its process; `number`: the sequence it goes on at
    kPushed,        // push() of sequence `number` has returned
    kAcknowledged,  // everything below `number` is settled, as the robot has heard for the first time
    kRefused,       // at its end: `number` keyframes, as the robot was told
    kGivenUp,       // likewise: gaps
    kEnded,         // everything below `number` was pushed
  };
  Kind kind = Kind::kStarted;
  std::uint32_t robot = 0;
  std::uint64_t number = 0;
  std::uint64_t sent_bytes = 0;  // of keyframes in parts, by this process of the robot, until now
  std::int64_t time_ns = 0;      // of the monotonic clock, which all processes share
};

std::int64_t monotonic_ns();

// Appends to a file that several processes may write at a time. Thread-safe.
class DeedLog {
 public:
  explicit DeedLog(const std::string& file);  // throws
  ~DeedLog();
  void add(const Deed& deed) const;

 private:
  int file_ = -1;
};

// In the order in which they were written.
std::vector<Deed> read_deeds(const std::string& file);

}  // namespace relmap::bench
