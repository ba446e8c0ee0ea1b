// The keyframes of one session, out of a log that lcm-logger wrote while a robot published them. As from a file of
// keyframes (frontend/capture/keyframe_file.h) they come in the order of their sequences, each once; on the wire they
// were in parts, doubled, lost, reordered and sent again.
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
  // `choice`: uuid or name of the session; empty: the only one. Reasons: EventLog::open()'s, list_sessions()'s,
  // choose_session()'s.
  static Result<KeyframeLog> open(const std::string& path, const std::string& choice = {});
  static Result<KeyframeLog> open(EventLog log, const std::string& choice = {});

  // The next; nothing at the end. After the last one, where the log is damaged to its end: the reason (EventLog::next).
  Result<std::optional<Keyframe>> next();

  const RecordedSession& session() const { return session_; }

  // So far, by reason. Keyframes: DATA_LOSS (never whole, or too late), CALIBRATION_CHANGED, a gap's reason;
  // SEQUENCE_CONFLICT, other versions of keyframes that were whole before; those of decode_keyframe(). Damaged messages
  // and stretches of the log: CORRUPT and others of decode_lcm_part() and check_part().
  std::map<Reason, std::uint64_t> left_out() const;

  // Whole keyframes that may wait for one before them.
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
  Status end_;  // of the log
  KeyframeAssembler assembler_;
  std::set<std::pair<std::uint32_t, std::uint32_t>> whole_;  // sequence and checksum of what was whole lately
  std::uint32_t remembered_from_ = 0;                        // the sequence from which on whole_ is complete
  std::map<std::uint32_t, Bytes> waiting_;                   // whole, by sequence
  std::size_t waiting_bytes_ = 0;
  std::map<std::uint32_t, Gap> gaps_;  // by first sequence; those that end at next_ or later
  std::uint64_t next_;                 // the lowest sequence that was neither given nor skipped
  std::map<Reason, std::uint64_t> left_out_;
};

}  // namespace relmap::recording
