// One relmap-frontend as a process: started with its arguments, read while it works, ended with its batch.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "tools/batch/recording_identity.h"
#include "tools/batch/sequence.h"

namespace relmap::batch {

// As its lines of progress say it.
struct Progress {
  std::uint64_t pairs = 0, of = 0;  // of: 0, not known
  std::uint64_t keyframes = 0, settled = 0;
  std::string trouble;  // why the daemon does not answer; empty: it does
};

// As its summary says it.
struct Summary {
  std::string json;
  std::uint64_t pairs = 0, lost = 0, keyframes = 0, unsettled = 0, gaps = 0;
  std::optional<double> metric_share;
  std::map<std::string, std::uint64_t> refused, unreadable, stamps_refused;  // by reason
  bool trusted = true;  // too few pairs were measured, or the eyes are not as the calibration says
  std::uint64_t expected = 0, seen = 0, measured = 0;  // pairs: that there should be, that both eyes saw, measured
  std::optional<double> measured_share;                // nothing: there were no pairs
  std::uint64_t missing = 0;                           // pictures
  std::vector<std::string> missing_first;              // of them, by their paths
  std::vector<Status> findings;                        // of the eyes
  std::vector<Status> left_out;                        // pictures and pairs one by one, with their files
  std::optional<RecordingIdentity> recording;          // nothing: of a log, or an older version did not say it

  std::uint64_t refused_in_all() const;  // keyframes
};
// CORRUPT if it is none.
Result<Summary> read_summary(const std::string& json);
// "recording" of an object that is a summary, or has nothing else.
std::optional<RecordingIdentity> read_recording(const std::string& json);

class FrontEnd {
 public:
  // IO_ERROR.
  static Result<FrontEnd> start(const std::vector<std::string>& command);
  FrontEnd(FrontEnd&& other) noexcept;
  FrontEnd& operator=(FrontEnd&& other) noexcept;
  ~FrontEnd();  // kills it

  // Its standard output and error, to be waited on; -1: closed.
  int out() const { return out_; }
  int err() const { return err_; }
  // Takes in what it has said. True once it has ended and said all.
  bool take();
  // Until it has said something more, or ended, or for so long.
  void wait(int milliseconds) const;
  const Progress& progress() const { return progress_; }
  void interrupt();  // SIGTERM

  // Once take() is true. Ok: done, all settled, whether its summary is to be trusted or not. Its reason, or INTERNAL if
  // a signal ended it; SHUTTING_DOWN after interrupt().
  const Status& status() const { return status_; }
  bool ended_by_signal() const { return ended_by_signal_; }
  // Empty json: it gave none.
  const Summary& summary() const { return summary_; }
  // What it said on standard output beside that, line by line.
  const std::vector<std::string>& lines() const { return lines_; }

 private:
  FrontEnd() = default;
  void read(int& file, std::string& text);
  void take_lines();
  void close_all();
  void judge(int wait_status);

  pid_t pid_ = -1;
  int out_ = -1, err_ = -1;
  std::string out_text_, err_text_;  // not yet taken; of err the last lines
  Progress progress_;
  Summary summary_;
  std::vector<std::string> lines_;
  Status status_;
  bool interrupted_ = false, ended_by_signal_ = false;
};

// relmap-frontend beside this program, or the one in $PATH.
std::string front_end_program();

// By relmap-frontend --list.
RecordingLister front_end_lister();

}  // namespace relmap::batch
