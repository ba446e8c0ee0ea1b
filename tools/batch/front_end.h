// One relmap-frontend as a child process, whose progress and summary are read from its output.
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

// The progress that relmap-frontend prints (--progress json).
struct Progress {
  std::uint64_t pairs = 0, of = 0;  // `of` 0: not known
  std::uint64_t keyframes = 0, settled = 0;
  std::string trouble;  // why the daemon does not answer; empty if it does
};

// The summary that relmap-frontend prints at its end.
struct Summary {
  std::string json;
  std::uint64_t pairs = 0, lost = 0, keyframes = 0, unsettled = 0, gaps = 0;
  std::optional<double> metric_share;
  std::map<std::string, std::uint64_t> refused, unreadable, stamps_refused;  // by reason
  bool trusted = true;  // false: too few pairs were measured, or the cameras contradict the calibration
  std::uint64_t expected = 0, seen = 0, measured = 0;  // pairs: expected, seen by both eyes, measured
  std::optional<double> measured_share;                // measured / expected; nullopt: no pairs were expected
  std::uint64_t missing = 0;                           // pictures that are missing
  std::vector<std::string> missing_first;              // paths of the first of them
  std::vector<Status> findings;                        // what is wrong with the stereo pair
  std::vector<Status> left_out;                        // why each picture or pair was left out, with its file
  std::optional<RecordingIdentity> recording;          // nullopt: of a log, or of an older version

  std::uint64_t refused_in_all() const;  // keyframes, of all reasons together
};
// CORRUPT if `json` is no summary.
Result<Summary> read_summary(const std::string& json);
// The key "recording" of a summary, or of an object that has only this key.
std::optional<RecordingIdentity> read_recording(const std::string& json);

class FrontEnd {
 public:
  // Starts the program command[0] with the arguments that follow. IO_ERROR.
  static Result<FrontEnd> start(const std::vector<std::string>& command);
  FrontEnd(FrontEnd&& other) noexcept;
  FrontEnd& operator=(FrontEnd&& other) noexcept;
  ~FrontEnd();  // kills it

  // Its standard output and error, for poll(); -1: closed.
  int out() const { return out_; }
  int err() const { return err_; }
  // Reads what it has printed, without waiting. Returns true when it has ended and everything is read.
  bool take();
  // Waits until it prints something more or ends, at most so long.
  void wait(int milliseconds) const;
  const Progress& progress() const { return progress_; }
  void interrupt();  // SIGTERM

  // Valid when take() has returned true. Ok: the recording is done and everything is settled, even if the summary
  // cannot be trusted. Else the front-end's own reason, INTERNAL if a signal ended it, or SHUTTING_DOWN after
  // interrupt().
  const Status& status() const { return status_; }
  bool ended_by_signal() const { return ended_by_signal_; }
  // Its json is empty if there was no summary.
  const Summary& summary() const { return summary_; }
  // The other lines that it printed on standard output.
  const std::vector<std::string>& lines() const { return lines_; }

 private:
  FrontEnd() = default;
  void read(int& file, std::string& text);
  void take_lines();
  void close_all();
  void judge(int wait_status);

  pid_t pid_ = -1;
  int out_ = -1, err_ = -1;
  std::string out_text_, err_text_;  // output that is not yet parsed; of standard error the last part
  Progress progress_;
  Summary summary_;
  std::vector<std::string> lines_;
  Status status_;
  bool interrupted_ = false, ended_by_signal_ = false;
};

// The path of the relmap-frontend beside this program; else its name, to be found in $PATH.
std::string front_end_program();

// Lists recordings with relmap-frontend --list.
RecordingLister front_end_lister();

}  // namespace relmap::batch
