// Decides what to send and when: the robot's half of the protocol as a state machine. It knows sizes and sequences but
// not payloads, takes the time as an argument, and uses no threads and no I/O.
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
  std::uint64_t sent = 0;    // keyframes sent for the first time in this process
  std::uint64_t resent = 0;  // keyframes sent again as a whole
  std::uint64_t parts_resent = 0;
  std::uint64_t settled = 0;  // sequences
  std::uint64_t gaps = 0;     // sequences given up
  std::uint64_t restarts_seen = 0;
  std::uint64_t lost_in_restores = 0;  // of the gaps, sequences that a restored map lacks and the spool no longer has
  std::map<Reason, std::uint64_t> refused;
};

struct PublisherCoreOptions {
  // The source gives the same keyframes when it is read again, so another process may have published them before.
  // Keyframes that the daemon has settled are then not sent, except the first one, which is sent to learn what the
  // daemon has. If the map lacks what was published, the source is published again from its beginning.
  bool repeated = false;
  // The transport loses nothing without reporting it. Messages are not sent again merely because no answer has come
  // yet, since that would make a slow line slower.
  bool lossless = false;
  Uuid map = {};  // publish into this map only; nil: into any
};

// Not thread-safe.
class PublisherCore {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit PublisherCore(const SessionUuid& session, PublisherCoreOptions options = {})
      : session_(session), options_(options), maps_({options.repeated, options.lossless, options.map}) {}

  // Load what a spool held when it was opened; before all other calls. Where keyframes and gaps overlap, the gap
  // counts.
  void load_keyframe(std::uint32_t sequence, std::uint32_t crc, std::uint32_t bytes);
  void load_gap(const Gap& gap);
  void load_map(const MapIdentity& map) { maps_.load(map); }

  // The gap (CAPTURE_FAILED) between next_sequence() and `sequence`, to be stored in the spool before push().
  std::optional<Gap> skipped(std::uint32_t sequence) const;
  // Takes a keyframe that is in the spool now; `sequence` >= next_sequence(). Sequences in between are given up.
  void push(std::uint32_t sequence, std::uint32_t crc, std::uint32_t bytes);
  // Replaces the unsettled keyframes in the range of the gap by the gap.
  void give_up(const Gap& gap);
  // The oldest keyframe that the daemon does not hold yet, as a gap (DROPPED_BY_ROBOT) to be given to give_up().
  std::optional<Gap> oldest_to_drop() const;

  // A daemon says which map it serves. A session that is in a map sends nothing to a daemon of another one and ignores
  // its messages; the daemon that spoke last decides.
  void introduce(const DaemonIdentity& daemon, Time now) { maps_.introduce(daemon, boot_, now); }
  // Returns the gaps that acknowledgements have caused since the last call, to be stored in the spool.
  std::vector<Gap> take_holes() { return std::exchange(holes_, {}); }
  // Takes in an acknowledgement, if its daemon is believed (ServedMaps).
  void acknowledge(const Acknowledgement& ack, Time now);
  // The transport broke: what was sent and is not acknowledged may be lost. Over a lossless transport, the next daemon
  // introduces itself.
  void broken();

  struct Send {
    bool gap = false;
    std::uint32_t sequence = 0;        // of the keyframe, or the first of the gap
    std::uint32_t to = 0;              // last sequence of the gap
    Reason reason = Reason::OK;        // of the gap
    std::vector<std::uint32_t> parts;  // of the keyframe; empty for all
  };
  // What is to be sent now. `part_bytes` is the size of parts.
  std::vector<Send> poll(Time now, std::uint32_t part_bytes);

  std::uint64_t next_sequence() const { return next_; }
  std::uint64_t unsettled_bytes() const { return unsettled_bytes_; }
  std::uint64_t unsettled() const { return unsettled_; }  // keyframes
  bool all_settled() const { return items_.empty() || items_.rbegin()->second.settled; }
  // Sequences below this are not needed again, even if the daemon loses its last settled group.
  std::uint64_t keep_from() const;
  bool heard() const { return boot_.has_value(); }
  // The state of ServedMaps. map() must be stored with the spool.
  const MapIdentity& map() const { return maps_.map(); }
  bool introduced() const { return maps_.introduced(); }
  Status map_status(Time now) const { return maps_.status(session_, now); }
  bool may_send(Time now) const { return maps_.may_send(now); }
  bool is_other(const BootId& boot) const { return maps_.is_other(boot); }
  const PublishCounts& counts() const { return counts_; }
  // Why the daemon accepts nothing of the session, as it said last: SESSION_DELETED, SESSION_FROZEN; OK if it does.
  Reason closed() const { return closed_; }

 private:
  struct Item {
    bool gap = false;
    std::uint32_t to = 0;  // == its sequence, for a keyframe
    Reason reason = Reason::OK;
    std::uint32_t crc = 0;
    std::uint32_t bytes = 0;
    bool loaded = false;  // an earlier process may have sent it, so the daemon may have it already
    bool settled = false;
    bool held = false;  // the daemon has all of it
    std::uint32_t sends = 0;
    Time last_sent{};
    bool wanted = false;               // must be sent again as a whole
    std::vector<std::uint32_t> parts;  // parts that must be sent again
    Reason refused = Reason::OK;
  };
  using Items = std::map<std::uint32_t, Item>;
  // What the daemon has settled, against what it had when it was heard last.
  enum class Progress {
    kAhead,      // as much or more
    kOvertaken,  // less: a newer acknowledgement overtook this one
    kForgotten,  // less, and has been for a while: it has forgotten a session of which it had only refused keyframes
  };

  Progress progress_of(const Acknowledgement& ack, Time now);
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
  std::uint64_t send_end_ = 0;      // credits allow sequences below this
  std::uint64_t unsettled_ = 0;
  std::uint64_t unsettled_bytes_ = 0;
  std::uint64_t window_bytes_ = std::uint64_t{512} << 10;  // maximum number of bytes in flight
  ServedMaps maps_;
  std::vector<Gap> holes_;  // gaps that the spool does not have yet
  std::optional<BootId> boot_;
  std::set<BootId> past_boots_;
  Time last_ack_{};
  std::optional<Time> behind_since_;  // since when acknowledgements say less than the newest one
  Reason closed_ = Reason::OK;
  PublishCounts counts_;
};

}  // namespace relmap::publishing
