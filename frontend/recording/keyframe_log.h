// Reads the keyframes of one session from a log that lcm-logger wrote while a robot published them. Like a file of
// keyframes (frontend/capture/keyframe_file.h), it returns each keyframe once, in the order of sequences, although on
// the wire they were split, duplicated, lost, reordered and resent.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "frontend/recording/event_log.h"
#include "frontend/recording/keyframe_assembler.h"
#include "frontend/recording/recorded_sessions.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::recording {

class KeyframeLog {
 public:
  // `choice` is the uuid or name of the session; empty for the only one. The reasons of EventLog::open(),
  // list_sessions() and choose_session().
  static Result<KeyframeLog> open(const std::string& path, const std::string& choice = {});
  static Result<KeyframeLog> open(EventLog log, const std::string& choice = {});

  // Returns the next keyframe; nothing at the end. If the end of the log is damaged, returns the reason after the last
  // keyframe (EventLog::next()).
  Result<std::optional<Keyframe>> next();

  const RecordedSession& session() const { return session_; }

  // What was left out so far, by reason. For keyframes: DATA_LOSS (never complete, or too late), CALIBRATION_CHANGED,
  // the reason of a gap, SEQUENCE_CONFLICT (another version of a keyframe that was complete before), and the reasons of
  // decode_keyframe(). For damaged messages and stretches of the log: CORRUPT and the other reasons of
  // decode_lcm_part() and check_part().
  std::map<Reason, std::uint64_t> left_out() const;

  // Maximum size of complete keyframes that wait for an earlier one.
  static constexpr std::size_t kMaxWaitingBytes = std::size_t{64} << 20;

 private:
  KeyframeLog(EventLog log, RecordedSession session)
      : log_(std::move(log)), session_(std::move(session)), next_(session_.first) {}
  void read_event();
  void take(const KeyframePart& part);
  void take(const Gap& gap);
  bool lowest_is_due() const;
  std::optional<Keyframe> give_lowest();
  void skip_to(std::uint64_t sequence);

  EventLog log_;
  RecordedSession session_;
  bool ended_ = false;
  Status end_;  // the error at the end of the log
  KeyframeAssembler assembler_;
  std::set<std::pair<std::uint32_t, std::uint32_t>> whole_;  // sequence and checksum of recently completed keyframes
  std::uint32_t remembered_from_ = 0;                        // whole_ has all of them from this sequence on
  std::map<std::uint32_t, Bytes> waiting_;                   // complete payloads, by sequence
  std::size_t waiting_bytes_ = 0;
  std::map<std::uint32_t, Gap> gaps_;  // by first sequence; only those that end at next_ or later
  std::uint64_t next_;                 // the lowest sequence that was neither returned nor skipped
  std::map<Reason, std::uint64_t> left_out_;
};

}  // namespace relmap::recording
