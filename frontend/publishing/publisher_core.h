// What to send, and when: the robot's half of the exchange as a state machine. Knows sizes and sequences, not bytes;
// time is an argument; no threads, no I/O.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "frontend/publishing/served_maps.h"
#include "proto/base/status.h"
#include "proto/keyframe/ingest_messages.h"

namespace relmap::publishing {

struct PublishCounts {
  std::uint64_t sent = 0;    // keyframes, first time in this process
  std::uint64_t resent = 0;  // whole
  std::uint64_t parts_resent = 0;
  std::uint64_t settled = 0;
  std::uint64_t gaps = 0;  // sequences given up
  std::uint64_t restarts_seen = 0;
  std::uint64_t lost_in_restores = 0;  // of the gaps: what a restored map lacks and the spool has no more
  std::map<Reason, std::uint64_t> refused;
};

struct PublisherCoreOptions {
  // The source can be read again, and gives the same keyframes then. So they may have been published before, by another
  // process: what the daemon has settled of them is not sent, but for the first keyframe, with which it is asked. And
  // where the map lacks what was published, the source is published again from its beginning.
  bool repeated = false;
  // The transport loses nothing without saying so: nothing is sent again just because no answer has come yet, which on
  // a slow line would only make it slower.
  bool lossless = false;
};

class PublisherCore {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit PublisherCore(const SessionUuid& session, PublisherCoreOptions options = {})
      : session_(session), options_(options), maps_({options.repeated, options.lossless}) {}

  // What a spool held when it was opened; before anything else. Keyframes and gaps may overlap: a gap is final.
  void load_keyframe(std::uint32_t sequence, std::uint32_t crc, std::uint32_t bytes);
  void load_gap(const Gap& gap);
  void load_map(const MapIdentity& map) { maps_.load(map); }

  // A keyframe that is in the spool now. `sequence` >= next_sequence(); what lies between is given up
  // (CAPTURE_FAILED), and returned to be kept in the spool.
  std::optional<Gap> skipped(std::uint32_t sequence) const;
  void push(std::uint32_t sequence, std::uint32_t crc, std::uint32_t bytes);
  void give_up(const Gap& gap);
  // The oldest keyframe that the daemon does not hold yet, as a gap (DROPPED_BY_ROBOT) to be given to give_up().
  std::optional<Gap> oldest_to_drop() const;

  // Which map a daemon serves. A session that is in a map sends nothing to a daemon of another one, and believes
  // nothing that it says; the daemon that spoke last decides.
  void introduce(const DaemonIdentity& daemon, Time now) { maps_.introduce(daemon, boot_, now); }
  // Gaps that an acknowledgement has brought about, for the spool; once.
  std::vector<Gap> take_holes() { return std::exchange(holes_, {}); }
  // As of the daemon that was introduced with its boot, if it is believed (ServedMaps).
  void acknowledge(const Acknowledgement& ack, Time now);
  // Whatever was sent and is not known to have come may be lost; of a lossless transport, the next daemon introduces
  // itself.
  void broken();

  struct Send {
    bool gap = false;
    std::uint32_t sequence = 0;        // of a gap the first
    std::uint32_t to = 0;              // of a gap
    Reason reason = Reason::OK;        // of a gap
    std::vector<std::uint32_t> parts;  // of a keyframe; empty: all of them
  };
  // What is to be sent now. `part_bytes` is the size it will be cut into.
  std::vector<Send> poll(Time now, std::uint32_t part_bytes);

  std::uint64_t next_sequence() const { return next_; }
  std::uint64_t unsettled_bytes() const { return unsettled_bytes_; }
  std::uint64_t unsettled() const { return unsettled_; }  // keyframes
  bool all_settled() const { return items_.empty() || items_.rbegin()->second.settled; }
  // Nothing below is needed again, even if the daemon should lose its last settled group.
  std::uint64_t keep_from() const;
  bool heard() const { return boot_.has_value(); }
  // Of the maps that daemons serve (ServedMaps). The session's is to be kept with the spool.
  const MapIdentity& map() const { return maps_.map(); }
  bool introduced() const { return maps_.introduced(); }
  Status map_status(Time now) const { return maps_.status(session_, now); }
  bool may_send(Time now) const { return maps_.may_send(now); }
  bool is_other(const BootId& boot) const { return maps_.is_other(boot); }
  const PublishCounts& counts() const { return counts_; }
  // Why the daemon takes nothing of the session, as it said last: SESSION_DELETED, SESSION_FROZEN. OK: it does.
  Reason closed() const { return closed_; }

 private:
  struct Item {
    bool gap = false;
    std::uint32_t to = 0;  // == its sequence, for a keyframe
    Reason reason = Reason::OK;
    std::uint32_t crc = 0;
    std::uint32_t bytes = 0;
    bool loaded = false;  // of another process too: may have been settled before this one began
    bool settled = false;
    bool held = false;  // the daemon has it whole
    std::uint32_t sends = 0;
    Time last_sent{};
    bool wanted = false;               // asked for again, whole
    std::vector<std::uint32_t> parts;  // asked for again
    Reason refused = Reason::OK;
  };
  using Items = std::map<std::uint32_t, Item>;

  void adopt_boot(const BootId& boot);
  void settle_below(std::uint64_t next);
  void unsettle_from(std::uint64_t next);
  void fill_holes(std::uint64_t from, Reason reason);
  void mark_held(const std::vector<SequenceRange>& held);
  void want_missing(const Acknowledgement& ack, Time now);
  void forget_settled();
  bool due_again(const Item& item, Time now, bool probing) const;
  Send make_send(std::uint32_t sequence, Item& item, Time now, std::uint32_t part_bytes);
  std::vector<Send> probe(Time now, std::uint32_t part_bytes);
  void set_settled(Item& item, std::uint32_t sequence, bool settled);

  const SessionUuid session_;
  const PublisherCoreOptions options_;
  Items items_;  // contiguous: each begins where the one before ends
  std::uint64_t next_ = 0;
  std::uint64_t acknowledged_ = 0;  // the daemon's next_sequence
  std::uint64_t send_end_ = 0;      // by credits
  std::uint64_t unsettled_ = 0;
  std::uint64_t unsettled_bytes_ = 0;
  std::uint64_t window_bytes_ = std::uint64_t{512} << 10;  // under way at a time
  ServedMaps maps_;
  std::vector<Gap> holes_;  // that the spool does not have yet
  std::optional<BootId> boot_;
  std::set<BootId> past_boots_;
  Time last_ack_{};
  Reason closed_ = Reason::OK;
  PublishCounts counts_;
};

}  // namespace relmap::publishing
