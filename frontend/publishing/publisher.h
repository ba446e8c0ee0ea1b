// Publishes keyframes to relmapd: they go into a spool and are sent, if necessary repeatedly, until the daemon
// acknowledges them as settled (durable in its journal, refused, or given up as a gap).
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
  Uuid map = {};          // publish into this map only; nil: into that of the first daemon that answers
  std::string spool;      // folder of this session's spool; created if missing
  std::string recording;  // identifies the source of the session (DiskSpool::open())
  // Keep the spool in memory. The source can be read again and then gives the same keyframes: a run that was
  // interrupted starts over with the same uuid, and keyframes that the daemon already has are repeats.
  bool in_memory = false;
  // Whether the source gives the same keyframes when it is read again.
  bool repeatable() const { return in_memory || (!live && !recording.empty()); }
  std::size_t spool_bytes = std::size_t{256} << 20;  // maximum size of the unsettled keyframes; at least 1 MiB
  // push() fails with UNREACHABLE if the spool is full and the daemon has settled nothing for this long. 0 waits for
  // ever.
  std::chrono::milliseconds patience{0};
  // The source cannot wait: when the spool is full, its oldest keyframe is given up as a gap. Otherwise push() blocks.
  bool live = false;
  // Delete what the spool holds and start the session over (DiskSpool::begin_anew()).
  bool begin_anew = false;
  std::size_t part_bytes = 0;  // payload per part, within the transport's limits; 0 for its usual size
};

struct PublishSummary {
  std::uint64_t pushed = 0;   // keyframes given to push() in this process
  std::uint64_t spooled = 0;  // unsettled keyframes found in the spool at start
  std::uint64_t sent = 0;     // keyframes sent for the first time in this process
  std::uint64_t resent = 0;   // keyframes sent again as a whole
  std::uint64_t parts_resent = 0;
  std::uint64_t settled = 0;           // sequences settled in this process, including refused ones and gaps
  std::uint64_t unsettled = 0;         // keyframes still in the spool, with which a later front-end continues
  std::uint64_t gaps = 0;              // sequences given up
  std::uint64_t lost_in_restores = 0;  // of these, those that a restored map lacks and the spool no longer has
  std::map<Reason, std::uint64_t> refused;
  std::uint64_t restarts_seen = 0;  // restarts of the daemon
  bool heard = false;               // the daemon has acknowledged this session at least once
  // SESSION_DELETED or SESSION_FROZEN if the daemon accepts no keyframes of the session. WRONG_MAP or MAP_RESTORED if
  // nothing is sent to the daemon that answers (await_map()).
  Status session;
  bool must_begin_anew = false;  // WRONG_MAP or MAP_RESTORED, and the source is repeatable: no more of it gets settled

  bool all_settled() const { return unsettled == 0; }
};

// Thread-safe, except that push() must be called by one thread at a time.
class Publisher {
 public:
  // Starts publishing over LCM, with one thread. If the folder has no spool, a new session `header` begins, in which a
  // nil uuid is replaced by a random one. Otherwise the spool's session is continued, whose header must equal `header`
  // except for a nil uuid: CALIBRATION_CHANGED if camera or flags differ, INVALID_ARGUMENT if uuid, robot, name or
  // recording do. FOLDER_LOCKED if another front-end uses the spool; IO_ERROR; NO_MULTICAST_ROUTE (with the commands
  // that fix it).
  static Result<std::unique_ptr<Publisher>> start(PublisherOptions options, SessionHeader header);
  // The same over another transport.
  static Result<std::unique_ptr<Publisher>> start(PublisherOptions options, SessionHeader header,
                                                  std::unique_ptr<PublishTransport> transport);
  // Like interrupt(). Unsettled keyframes stay in the spool.
  ~Publisher();

  // The session with its uuid, which every pushed keyframe must carry.
  const SessionHeader& session() const;
  // The newest keyframe in the spool, settled or not, after which a session is continued (sequence, time, odometry).
  // nullopt if nothing was pushed yet.
  std::optional<Keyframe> last_keyframe() const;
  // The lowest sequence that may be pushed next.
  std::uint32_t next_sequence() const;

  // Puts a keyframe into the spool before it returns. Sequences must increase; those left out are declared as gaps
  // (CAPTURE_FAILED). Blocks while the spool is full, unless live. A keyframe that check_keyframe() would refuse is
  // sent all the same: the daemon refuses it with a reason and counts it.
  //
  // INVALID_ARGUMENT (sequence or session), BAD_SIZE, IO_ERROR; UNREACHABLE when patience ends; SHUTTING_DOWN after
  // finish() or interrupt(); SESSION_DELETED if an operator deleted the session; for a repeatable source, WRONG_MAP and
  // MAP_RESTORED as of await_map(), and SEQUENCE_CONFLICT if its keyframes differ from those published under this uuid.
  Status push(const Keyframe& keyframe);

  // Waits until the daemon has said which map it serves. Ok if the session is in that map or in none yet, or if it is
  // not known by the deadline. WRONG_MAP if it serves another map than the one the session began in; a source that is
  // not repeatable then keeps its keyframes in the spool. MAP_RESTORED if the source is repeatable and the map was
  // restored from a backup. In both cases nothing is sent; `begin_anew` publishes a repeatable source from its
  // beginning.
  Status await_map(std::chrono::steady_clock::time_point deadline);

  // Registers a listener for news of this session's keyframes, in place of the one before; an empty function
  // unregisters it. It is called on a thread of the transport; it must not block and must not call the publisher. When
  // this returns, the previous listener is no longer running.
  void hear(std::function<void(const PoseNews&)> listener);

  PublishSummary progress() const;

  // Ends pushing. Returns when everything is settled, when no more of the session can get settled (must_begin_anew), at
  // an interrupt, or at the deadline.
  PublishSummary finish(std::chrono::steady_clock::time_point deadline);

  // Tells the daemon that the session has no more keyframes for now. Call it after finish() and only if everything is
  // settled. Returns true once the daemon has confirmed it, false at the deadline or an interrupt.
  bool end_session(std::chrono::steady_clock::time_point deadline);

  // WRONG_MAP and MAP_RESTORED as of await_map(); otherwise PublishTransport::trouble().
  Status trouble() const;

  // Ends a blocked push(), finish() or end_session() at once. Thread-safe.
  void interrupt();

 private:
  struct Impl;
  explicit Publisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::publishing
