// The front-end's way to the map: keyframes go into a spool and from there to relmapd, again and again until the daemon
// says that they are settled (applied, refused, or given up as a gap).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "frontend/publishing/publish_transport.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::publishing {

struct PublisherOptions {
  std::string lcm_url = "udpm://239.255.76.67:7667?ttl=0";
  std::string spool;      // folder of this session's spool; made if absent
  std::string recording;  // what the session is made of: DiskSpool::open()
  // No spool on disk: the source can be read again, and gives the same keyframes then. A run that was broken off begins
  // anew, with the same uuid: what the daemon has is a repeat.
  bool in_memory = false;
  // Whether the source can be read again and gives the same keyframes then.
  bool repeatable() const { return in_memory || (!live && !recording.empty()); }
  std::size_t spool_bytes = std::size_t{256} << 20;  // of keyframes that are not settled yet; >= 1 MiB
  // With a daemon that settles nothing while the spool is full: then push() fails (UNREACHABLE). 0: it waits for ever.
  std::chrono::milliseconds patience{0};
  // The source cannot wait: when the spool is full its oldest keyframe is given up as a gap. Otherwise push() blocks.
  bool live = false;
  // What the spool holds is forgotten, and the session begun anew (DiskSpool::begin_anew()).
  bool begin_anew = false;
  std::size_t part_bytes = 0;  // of payload a part, as the transport takes them; 0: its usual ones
};

struct PublishSummary {
  std::uint64_t pushed = 0;   // keyframes given to push() in this process
  std::uint64_t spooled = 0;  // found in the spool at start, not settled then
  std::uint64_t sent = 0;     // keyframes sent for the first time in this process
  std::uint64_t resent = 0;   // keyframes sent again, whole
  std::uint64_t parts_resent = 0;
  std::uint64_t settled = 0;           // keyframes settled in this process, refused ones and gaps among them
  std::uint64_t unsettled = 0;         // still in the spool: a later front-end continues with them
  std::uint64_t gaps = 0;              // keyframes given up
  std::uint64_t lost_in_restores = 0;  // of them those that a restored map lacks and the spool has no more
  std::map<Reason, std::uint64_t> refused;
  std::uint64_t restarts_seen = 0;  // of the daemon
  bool heard = false;               // the daemon has acknowledged this session at least once
  // SESSION_DELETED, SESSION_FROZEN: the daemon takes nothing of it. WRONG_MAP, MAP_RESTORED: nothing is sent to the
  // daemon that answers (await_map()).
  Status session;
  bool must_begin_anew = false;  // that is so, and the source can be read again: nothing more of it gets settled

  bool all_settled() const { return unsettled == 0; }
};

// Thread-safe; push() is meant for one thread.
class Publisher {
 public:
  // A folder without a spool begins the session `header`; a nil uuid is replaced by a random one. A folder with one
  // continues its session, whose header must equal `header` but for a nil uuid: CALIBRATION_CHANGED if camera or flags
  // differ, INVALID_ARGUMENT if uuid, robot, name or recording do. FOLDER_LOCKED: another front-end holds it. IO_ERROR,
  // NO_MULTICAST_ROUTE (with the commands that mend it). Starts one thread. Over LCM.
  static Result<std::unique_ptr<Publisher>> start(PublisherOptions options, SessionHeader header);
  // The same over another transport.
  static Result<std::unique_ptr<Publisher>> start(PublisherOptions options, SessionHeader header,
                                                  std::unique_ptr<PublishTransport> transport);
  // As interrupt(); what is not settled stays in the spool.
  ~Publisher();

  // With its uuid: what every keyframe pushed must carry.
  const SessionHeader& session() const;
  // The newest keyframe that the spool holds, settled or not: where a continued session goes on (sequence, time,
  // odometry). nullopt: nothing was pushed yet.
  std::optional<Keyframe> last_keyframe() const;
  // The lowest sequence that may be pushed next.
  std::uint32_t next_sequence() const;

  // In the spool on return. Sequences must grow; those left out are declared as gaps (CAPTURE_FAILED). Blocks while the
  // spool is full unless live. INVALID_ARGUMENT (sequence or session), BAD_SIZE, IO_ERROR, SHUTTING_DOWN after finish()
  // or interrupt(); WRONG_MAP and MAP_RESTORED of a source that can be read again, as await_map(); SESSION_DELETED: the
  // map's operator wants it no more; SEQUENCE_CONFLICT: a source that can be read again does not give what was
  // published under this uuid. What check_keyframe() would refuse is sent all the same: the daemon refuses it by name
  // and counts it.
  Status push(const Keyframe& keyframe);

  // Waits until the daemon has said which map it serves. OK: the session is in that one, or in none yet, or there is no
  // telling by then. WRONG_MAP: it serves another map than the one that the session was begun in; a source that cannot
  // be read again then keeps its keyframes in the spool. MAP_RESTORED: the source can be read again, and the map lacks
  // what came after its backup. Either way nothing is sent; `begin_anew` publishes such a source from its beginning.
  Status await_map(std::chrono::steady_clock::time_point deadline);

  // News of this session's keyframes from now on, from a thread of the transport's: return at once, call nothing here.
  // None ends it: the listener before has then returned for the last time.
  void hear(std::function<void(const PoseNews&)> listener);

  PublishSummary progress() const;

  // No more pushes. Returns when everything is settled, or at the deadline.
  PublishSummary finish(std::chrono::steady_clock::time_point deadline);

  // After finish(), where everything is settled: tells the daemon that the session has no more keyframes for now.
  // Returns whether it has said that it noted so, at the deadline, at an interrupt, or before.
  bool end_session(std::chrono::steady_clock::time_point deadline);

  // WRONG_MAP and MAP_RESTORED, as await_map(); else PublishTransport::trouble().
  Status trouble() const;

  // Ends a blocked push() or finish() at once; from any thread.
  void interrupt();

 private:
  struct Impl;
  explicit Publisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::publishing
