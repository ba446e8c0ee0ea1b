#include "frontend/publishing/publisher.h"

#include <algorithm>
#include <string>
#include <thread>
#include <utility>

#include "frontend/publishing/disk_spool.h"
#include "frontend/publishing/memory_spool.h"
#include "frontend/publishing/publisher_core.h"
#include "proto/base/crc32c.h"
#include "proto/base/mutex.h"

namespace relmap::publishing {

namespace {

constexpr std::chrono::milliseconds kTick{10};  // while something is unsettled
constexpr std::chrono::milliseconds kIdle{1000};
constexpr std::chrono::milliseconds kEndAgain{200};
constexpr std::chrono::milliseconds kLook{50};
constexpr std::size_t kMinSpoolBytes = std::size_t{1} << 20;

Result<std::unique_ptr<Spool>> open_spool(const PublisherOptions& options, SessionHeader header) {
  if (options.in_memory) return std::unique_ptr<Spool>(std::make_unique<MemorySpool>(std::move(header)));
  auto spool = DiskSpool::open(options.spool, std::move(header), options.recording);
  if (!spool.ok()) return spool.status();
  if (options.begin_anew)
    if (Status s = (*spool)->begin_anew(); !s.ok()) return s;
  return std::unique_ptr<Spool>(std::move(*spool));
}

}  // namespace

struct Publisher::Impl {
  Impl(PublisherOptions o, std::unique_ptr<Spool> s, std::unique_ptr<PublishTransport> t)
      : options(std::move(o)),
        session(s->session()),
        spool(std::move(s)),
        transport(std::move(t)),
        core(session.uuid, {options.repeatable(), transport->lossless(), options.map}) {
    core.load_map(spool->map());
    for (const auto& [sequence, entry] : spool->keyframes()) core.load_keyframe(sequence, entry.crc, entry.bytes);
    for (const Gap& gap : spool->gaps()) core.load_gap(gap);
    spooled = core.unsettled();
    went_on = core.next_sequence() > 0;
  }

  PublishSummary summary() const RELMAP_REQUIRES(mutex) {
    const PublishCounts& counts = core.counts();
    PublishSummary s;
    s.pushed = pushed;
    s.spooled = spooled;
    s.sent = counts.sent;
    s.resent = counts.resent;
    s.parts_resent = counts.parts_resent;
    s.settled = counts.settled;
    s.unsettled = core.unsettled();
    s.gaps = counts.gaps;
    s.lost_in_restores = counts.lost_in_restores;
    for (const auto& [reason, count] : counts.refused)
      if (count > 0) s.refused.emplace(reason, count);
    s.restarts_seen = counts.restarts_seen;
    s.heard = core.heard();
    s.session = session_status();
    s.must_begin_anew = core.closed() == Reason::OK && !must_begin_anew().ok();
    return s;
  }

  Status make_room(std::size_t bytes) RELMAP_REQUIRES(mutex) {
    const auto fits = [&]() RELMAP_REQUIRES(mutex) { return core.unsettled_bytes() + bytes <= options.spool_bytes; };
    std::uint64_t settled = core.counts().settled;
    auto moved = std::chrono::steady_clock::now();
    while (!fits() && !closed) {
      const auto gap = options.live ? core.oldest_to_drop() : std::nullopt;
      if (gap) {
        if (Status s = spool->append_gap(*gap); !s.ok()) return s;
        core.give_up(*gap);
      } else if (options.live) {
        break;  // the daemon holds all of it: settled in a moment
      } else if (options.patience.count() == 0) {
        changed.wait(mutex);
      } else {
        changed.wait_for(mutex, options.patience);
        const auto now = std::chrono::steady_clock::now();
        if (std::exchange(settled, core.counts().settled) != core.counts().settled)
          moved = now;
        else if (now - moved >= options.patience && !fits())
          return {Reason::UNREACHABLE, "the spool is full and the daemon has settled nothing in " +
                                           std::to_string(options.patience.count() / 1000) + " s"};
      }
    }
    if (closed) return {Reason::SHUTTING_DOWN, "the publisher was closed"};
    return {};
  }

  // Ok if the daemon accepts keyframes of the session.
  Status session_status() const RELMAP_REQUIRES(mutex) {
    const std::string name = "session " + session.uuid.to_string();
    if (core.closed() == Reason::SESSION_DELETED)
      return {Reason::SESSION_DELETED, name + " was deleted from the map; under another name it is a new one"};
    if (core.closed() != Reason::OK) return {core.closed(), name + " takes nothing"};
    return map_status();
  }

  Status map_status() const RELMAP_REQUIRES(mutex) { return core.map_status(std::chrono::steady_clock::now()); }
  // Why a repeatable source has to be published from its beginning; ok if it has not.
  Status must_begin_anew() const RELMAP_REQUIRES(mutex) { return options.repeatable() ? map_status() : Status(); }

  // A deleted session accepts nothing. If the daemon has other keyframes of this session, those that follow would be
  // appended to them.
  Status check_session() const RELMAP_REQUIRES(mutex) {
    if (Status status = session_status(); status.reason() == Reason::SESSION_DELETED) return status;
    if (Status status = must_begin_anew(); !status.ok()) return status;
    const auto conflicts = core.counts().refused.find(Reason::SEQUENCE_CONFLICT);
    if (options.repeatable() && conflicts != core.counts().refused.end() && conflicts->second > 0)
      return {Reason::SEQUENCE_CONFLICT, "the daemon has other keyframes of session " + session.uuid.to_string() +
                                             ": of another recording, or made with other options"};
    return {};
  }

  Status push(const Keyframe& keyframe) {
    if (keyframe.session.uuid != session.uuid)
      return {Reason::INVALID_ARGUMENT, "keyframe of session " + keyframe.session.uuid.to_string()};
    if (keyframe.tracks.size() > kMaxTracks || keyframe.appearance.size() > kMaxAppearance ||
        keyframe.picture.size() > kMaxKeyframePictureBytes)
      return {Reason::BAD_SIZE, "too many tracks or features, or too large a picture"};
    const Bytes payload = encode_keyframe(keyframe);
    if (payload.size() > kMaxKeyframeBytes)
      return {Reason::BAD_SIZE,
              "keyframe of " + std::to_string(payload.size()) + " bytes; at most " + std::to_string(kMaxKeyframeBytes)};
    const std::uint32_t crc = crc32c(payload);
    MutexLock lock(mutex);
    if (keyframe.sequence < core.next_sequence())
      return {Reason::INVALID_ARGUMENT,
              "keyframe " + std::to_string(keyframe.sequence) + " after " + std::to_string(core.next_sequence() - 1)};
    if (Status s = check_session(); !s.ok()) return s;
    if (Status s = make_room(payload.size()); !s.ok()) return s;
    if (const auto gap = core.skipped(keyframe.sequence))
      if (Status s = spool->append_gap(*gap); !s.ok()) return s;
    if (options.live || went_on)
      if (Status s = spool->mark_unrepeatable(); !s.ok()) return s;
    if (Status s = spool->append(keyframe.sequence, payload, crc); !s.ok()) return s;
    core.push(keyframe.sequence, crc, static_cast<std::uint32_t>(payload.size()));
    if (options.in_memory) (void)spool->remove_below(core.keep_from());
    ++pushed;
    changed.notify_all();
    return {};
  }

  void acknowledge(const Acknowledgement& ack) {
    const MutexLock lock(mutex);
    core.acknowledge(ack, std::chrono::steady_clock::now());
    // What cannot be removed now is removed later. Nothing is removed before the map that has it is on record.
    if (keep_map()) (void)spool->remove_below(core.keep_from());
    acknowledged = true;
    changed.notify_all();
  }

  void introduce(const DaemonIdentity& daemon) {
    const MutexLock lock(mutex);
    core.introduce(daemon, std::chrono::steady_clock::now());
    (void)keep_map();
    changed.notify_all();
  }

  // The gaps are stored before the map: with the map alone, a later process would not know that there are gaps.
  bool keep_map() RELMAP_REQUIRES(mutex) {
    for (const Gap& hole : core.take_holes())
      if (!spool->append_gap(hole).ok()) return false;
    return core.map() == spool->map() || spool->set_map(core.map()).ok();
  }

  // The map that the session is in, or is to be in; nil if any will do.
  Uuid map_sent_to() const {
    const MutexLock lock(mutex);
    return core.map().known() ? core.map().uuid : options.map;
  }

  void broken() {
    const MutexLock lock(mutex);
    core.broken();
  }

  void hear(const PoseNews& news) {
    if (news.session != session.uuid) return;
    {
      const MutexLock lock(mutex);
      if (core.is_other(news.boot)) return;
      if (news.kind == PoseNews::Kind::kEnded) {
        ended |= ending;
        changed.notify_all();
      }
    }
    const MutexLock lock(news_mutex);
    if (news_listener) news_listener(news);
  }

  void run() {
    MutexLock lock(mutex);
    while (!stopping) {
      acknowledged = false;
      const auto sends = core.poll(std::chrono::steady_clock::now(), part_bytes());
      for (const PublisherCore::Send& send : sends) {
        if (stopping || !may_send()) break;
        transmit(send);
      }
      if (ending && !ended && may_send()) say_end();
      const std::uint64_t next = core.next_sequence();
      const bool idle = core.all_settled() && !ending;
      changed.wait_for(mutex, idle ? kIdle : kTick, [&]() RELMAP_REQUIRES(mutex) {
        return stopping || acknowledged || core.next_sequence() != next || (idle && ending);
      });
    }
  }

  // False if, for example, a daemon of another map has answered meanwhile.
  bool may_send() const RELMAP_REQUIRES(mutex) { return core.may_send(std::chrono::steady_clock::now()); }

  void say_end() RELMAP_REQUIRES(mutex) {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_end) return;
    next_end = now + kEndAgain;
    const SessionEnd end{session.uuid, core.next_sequence()};
    const MutexUnlock unlocked(mutex);
    transport->send(end);
  }

  // The lock is not held while the transport sends.
  void transmit(const PublisherCore::Send& send) RELMAP_REQUIRES(mutex) {
    if (send.gap) {
      const MutexUnlock unlocked(mutex);
      transport->send(Gap{session.uuid, send.sequence, send.to, send.reason});
      return;
    }
    const auto entry = spool->keyframes().find(send.sequence);
    if (entry == spool->keyframes().end()) return;  // settled meanwhile
    const std::uint32_t crc = entry->second.crc;
    const Result<Bytes> payload = spool->read(send.sequence);
    if (!payload.ok()) {  // the disk lost it: declare a gap, so that the daemon does not wait for ever
      const Gap gap{session.uuid, send.sequence, send.sequence, Reason::DROPPED_BY_ROBOT};
      (void)spool->append_gap(gap);
      core.give_up(gap);
      return;
    }
    const MutexUnlock unlocked(mutex);
    const std::uint32_t count = count_parts(payload->size(), part_bytes());
    const auto cut = [&](std::uint32_t part) {
      transport->send(cut_part(session.uuid, send.sequence, *payload, crc, part_bytes(), part));
    };
    if (send.parts.empty())
      for (std::uint32_t part = 0; part < count; ++part) cut(part);
    else
      for (const std::uint32_t part : send.parts) cut(part);
  }

  std::uint32_t part_bytes() const { return static_cast<std::uint32_t>(options.part_bytes); }

  void stop() {
    {
      const MutexLock lock(mutex);
      closed = stopping = true;
      changed.notify_all();
    }
    transport->stop();
    if (thread.joinable()) thread.join();
  }

  const PublisherOptions options;
  const SessionHeader session;
  const std::unique_ptr<Spool> spool;
  const std::unique_ptr<PublishTransport> transport;

  Mutex news_mutex;
  std::function<void(const PoseNews&)> news_listener RELMAP_GUARDED_BY(news_mutex);

  mutable Mutex mutex;
  ConditionVariable changed;
  PublisherCore core RELMAP_GUARDED_BY(mutex);
  std::uint64_t pushed RELMAP_GUARDED_BY(mutex) = 0;
  std::uint64_t spooled RELMAP_GUARDED_BY(mutex) = 0;
  bool went_on RELMAP_GUARDED_BY(mutex) = false;  // the spool held something at start
  bool acknowledged RELMAP_GUARDED_BY(mutex) = false;
  bool closed RELMAP_GUARDED_BY(mutex) = false;       // push() is refused
  bool interrupted RELMAP_GUARDED_BY(mutex) = false;  // waits end at once
  bool ending RELMAP_GUARDED_BY(mutex) = false;       // the daemon is to be told that the session has ended
  bool ended RELMAP_GUARDED_BY(mutex) = false;        // the daemon has confirmed that
  std::chrono::steady_clock::time_point next_end RELMAP_GUARDED_BY(mutex){};  // when it is told again
  bool stopping RELMAP_GUARDED_BY(mutex) = false;
  std::thread thread;
};

Publisher::Publisher(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Publisher::~Publisher() { impl_->stop(); }

Result<std::unique_ptr<Publisher>> Publisher::start(PublisherOptions options, SessionHeader header,
                                                    std::unique_ptr<PublishTransport> transport) {
  if (options.spool_bytes < kMinSpoolBytes)
    return {Reason::INVALID_ARGUMENT, "a spool needs at least " + std::to_string(kMinSpoolBytes) + " bytes"};
  const PublishTransport::PartBytes part_bytes = transport->part_bytes();
  if (options.part_bytes == 0) options.part_bytes = part_bytes.usual;
  if (options.part_bytes < part_bytes.min || options.part_bytes > part_bytes.max)
    return {Reason::INVALID_ARGUMENT, "parts of " + std::to_string(options.part_bytes) + " bytes; must be " +
                                          std::to_string(part_bytes.min) + ".." + std::to_string(part_bytes.max)};
  Result<std::unique_ptr<Spool>> spool = open_spool(options, std::move(header));
  if (!spool.ok()) return spool.status();
  auto impl = std::make_unique<Impl>(std::move(options), std::move(*spool), std::move(transport));
  Impl* const running = impl.get();
  running->transport->sends_for(running->session.uuid, running->map_sent_to());
  running->transport->listen({[running](const Acknowledgement& ack) { running->acknowledge(ack); },
                              [running](const PoseNews& news) { running->hear(news); },
                              [running] { running->broken(); },
                              [running](const DaemonIdentity& daemon) { running->introduce(daemon); }});
  running->thread = std::thread([running] { running->run(); });
  return std::unique_ptr<Publisher>(new Publisher(std::move(impl)));
}

const SessionHeader& Publisher::session() const { return impl_->session; }

std::optional<Keyframe> Publisher::last_keyframe() const {
  const MutexLock lock(impl_->mutex);
  if (impl_->spool->keyframes().empty()) return std::nullopt;
  const Result<Bytes> payload = impl_->spool->read(impl_->spool->keyframes().rbegin()->first);
  if (!payload.ok()) return std::nullopt;
  Result<Keyframe> keyframe = decode_keyframe(*payload);
  if (!keyframe.ok()) return std::nullopt;
  return std::move(*keyframe);
}

std::uint32_t Publisher::next_sequence() const {
  const MutexLock lock(impl_->mutex);
  return static_cast<std::uint32_t>(impl_->core.next_sequence());
}

Status Publisher::push(const Keyframe& keyframe) { return impl_->push(keyframe); }

void Publisher::hear(std::function<void(const PoseNews&)> listener) {
  const MutexLock lock(impl_->news_mutex);
  impl_->news_listener = std::move(listener);
}

PublishSummary Publisher::progress() const {
  const MutexLock lock(impl_->mutex);
  return impl_->summary();
}

PublishSummary Publisher::finish(std::chrono::steady_clock::time_point deadline) {
  MutexLock lock(impl_->mutex);
  impl_->closed = true;
  impl_->changed.notify_all();
  impl_->changed.wait_until(impl_->mutex, deadline, [&]() RELMAP_REQUIRES(impl_->mutex) {
    return impl_->interrupted || impl_->core.all_settled() || !impl_->must_begin_anew().ok();
  });
  return impl_->summary();
}

bool Publisher::end_session(std::chrono::steady_clock::time_point deadline) {
  MutexLock lock(impl_->mutex);
  impl_->ending = true;
  impl_->changed.notify_all();
  impl_->changed.wait_until(impl_->mutex, deadline,
                            [&]() RELMAP_REQUIRES(impl_->mutex) { return impl_->interrupted || impl_->ended; });
  impl_->ending = false;
  return impl_->ended;
}

Status Publisher::await_map(std::chrono::steady_clock::time_point deadline) {
  using Clock = std::chrono::steady_clock;
  MutexLock lock(impl_->mutex);
  const auto known = [&]() RELMAP_REQUIRES(impl_->mutex) {
    return impl_->interrupted || !impl_->core.map().known() || impl_->core.introduced() || !impl_->map_status().ok();
  };
  while (!known() && Clock::now() < deadline && impl_->transport->trouble().ok())
    impl_->changed.wait_until(impl_->mutex, std::min(deadline, Clock::now() + kLook));
  return impl_->map_status();
}

Status Publisher::trouble() const {
  {
    const MutexLock lock(impl_->mutex);
    if (Status map = impl_->map_status(); !map.ok()) return map;
  }
  return impl_->transport->trouble();
}

void Publisher::interrupt() {
  const MutexLock lock(impl_->mutex);
  impl_->closed = impl_->interrupted = true;
  impl_->changed.notify_all();
}

}  // namespace relmap::publishing
