#include "storage/map/map.h"

#include <algorithm>
#include <cassert>
#include <chrono>

#include "proto/base/mutex.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/map/indices.h"
#include "storage/map/map_impl.h"
#include "storage/map/pending_frames.h"

namespace relmap::storage {
namespace {

Status lost(const std::string& what, const Status& why) {
  return Status(Reason::DATA_LOSS, what + ": " + why.to_string());
}

[[noreturn]] void no_frame(FrameId id) {
  throw StatusError(Status(Reason::NO_SUCH_FRAME, "no frame " + id.to_string()));
}

}  // namespace

Map::Map(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Map::~Map() {
  if (impl_->committing) {
    if (impl_->committing->written.valid()) impl_->committing->written.wait();
    impl_->budget->release(Share::kCache, impl_->committing->cache_bytes);
  }
  impl_->budget->release(Share::kDirty, impl_->dirty_bytes + impl_->spare_bytes);
  impl_->budget->release(Share::kSessions, impl_->pending_bytes + impl_->session_bytes);
}

Result<std::unique_ptr<Map>> Map::open(std::shared_ptr<Engine> engine, std::uint64_t epoch,
                                       std::shared_ptr<Budget> budget, EventLimits events) try {
  auto impl = std::make_unique<Impl>();
  impl->snapshot = engine->snapshot();
  const EngineSnapshot& snapshot = *impl->snapshot;

  relmap::storage::visit_sessions(snapshot, {}, 0, [&](const Session& session) {
    impl->session_counts.add(session);
    return true;
  });
  const auto state = snapshot.get(keys::map_state());
  if (!state.ok()) return state.status();
  if (*state) {
    auto decoded = decode_state(**state);
    if (!decoded.ok()) return lost("the map's state", decoded.status());
    impl->state = std::move(*decoded);
  }
  impl->digests_hold = impl->state.digests_commit == snapshot.commit_number();
  impl->events = EventWriter(events);
  if (Status told = impl->events.open(snapshot, impl->state.applied_sequence); !told.ok()) return told;
  Status failed;
  // An edit that cannot be read is forgotten: it is an answer to a question that will hardly be asked.
  throw_if(snapshot.scan(keys::all_edits(), [&](std::string_view key, ByteSpan value) {
    const auto sequence = keys::edit_of(key);
    auto edit = decode_edit(value);
    if (sequence && edit.ok()) impl->edits.emplace(*sequence, *std::move(edit));
    return true;
  }));
  const Status queued = load_pending(snapshot, impl->state.pending, [&](std::string_view, const std::string& what) {
    failed = Status(Reason::DATA_LOSS, what);
  });
  if (!queued.ok()) return queued;
  if (!failed.ok()) return failed;

  impl->engine = std::move(engine);
  impl->epoch = epoch;
  impl->cache = std::make_shared<ChunkCache>(budget, snapshot.commit_number());
  impl->ledger = std::make_shared<ViewLedger>(budget);
  impl->budget = std::move(budget);
  impl->publish_sessions();
  impl->show();
  return std::unique_ptr<Map>(new Map(std::move(impl)));
} catch (const StatusError& error) {
  return error.status();
}

std::shared_ptr<const FrameHot> Map::hot(FrameId id) const {
  if (auto frame = impl_->unwritten<FrameHot>(id)) return *std::move(frame);
  return impl_->recent_hot.get(*impl_->cache, *impl_->snapshot, id);
}

std::shared_ptr<const FrameWarm> Map::warm(FrameId id) const {
  if (auto frame = impl_->unwritten<FrameWarm>(id)) return *std::move(frame);
  return impl_->recent_warm.get(*impl_->cache, *impl_->snapshot, id);
}

std::shared_ptr<const FrameCold> Map::cold(FrameId id) const {
  if (auto frame = impl_->unwritten<FrameCold>(id)) return *std::move(frame);
  const auto session = impl_->session(id.session);
  return session && !is_removed(*session, id) ? impl_->cache->cold(*impl_->snapshot, id) : nullptr;
}

void Map::visit_sessions(SessionNumber from, const SessionVisit& visit) const {
  relmap::storage::visit_sessions(*impl_->snapshot, impl_->sessions, from, visit);
}

std::optional<Session> Map::session(SessionNumber number) const {
  const auto session = impl_->session(number);
  return session ? std::optional<Session>(*session) : std::nullopt;
}

std::shared_ptr<const Session> Map::Impl::session(SessionNumber number) const {
  auto edited = find_session(sessions, number);
  return edited ? edited : cache->session(*snapshot, number);
}

std::shared_ptr<const void> Map::hold_session(SessionNumber number) const {
  impl_->cache->hold_session(number);
  return {nullptr, [cache = impl_->cache, number](const void*) { cache->let_go_session(number); }};
}

void Map::visit_skipped(SessionNumber session, std::uint32_t sequence, const SkippedVisit& visit) const {
  relmap::storage::visit_skipped(*impl_->snapshot, impl_->skipped, session, sequence, visit);
}

std::vector<FrameId> Map::labelled(const std::string& label) const {
  return frames_labelled(*impl_->snapshot, impl_->labels, label);
}

std::vector<std::string> Map::labels(const std::string& prefix) const {
  return labels_beginning(*impl_->snapshot, impl_->labels, prefix);
}

FrameHot& Map::edit_hot(FrameId id) {
  const std::uint32_t slot = slot_of(id);
  if (const WorkingChunk* chunk = impl_->find(chunk_id(id)); chunk && chunk->hot.is_fresh(slot))
    return *chunk->hot.frames[slot];
  const auto frame = hot(id);
  if (!frame) no_frame(id);
  std::shared_ptr<FrameHot> copy = impl_->spare_hot.take(id);
  if (copy)
    *copy = *frame;
  else
    copy = std::make_shared<FrameHot>(*frame);
  FrameHot& edited = *copy;
  WorkingPart<FrameHot>& part = impl_->touch(chunk_id(id)).hot;
  if (part.frames[slot]) impl_->spare_hot.put(std::move(part.frames[slot]), part.bytes[slot], id);
  part.set(slot, std::move(copy));
  return edited;
}

FrameWarm& Map::edit_warm(FrameId id) {
  const std::uint32_t slot = slot_of(id);
  if (const WorkingChunk* chunk = impl_->find(chunk_id(id)); chunk && chunk->warm.is_fresh(slot))
    return *chunk->warm.frames[slot];
  const auto frame = warm(id);
  if (!frame) no_frame(id);
  auto copy = std::make_shared<FrameWarm>(*frame);
  FrameWarm& edited = *copy;
  impl_->touch(chunk_id(id)).warm.set(slot, std::move(copy));
  return edited;
}

void Map::add_frame(FrameId id, FrameHot hot_part, FrameWarm warm_part, FrameCold cold_part) {
  assert(impl_->session(id.session));
  WorkingChunk& chunk = impl_->touch(chunk_id(id));
  chunk.hot.set(slot_of(id), std::make_shared<FrameHot>(std::move(hot_part)));
  chunk.warm.set(slot_of(id), std::make_shared<FrameWarm>(std::move(warm_part)));
  chunk.cold.set(slot_of(id), std::make_shared<FrameCold>(std::move(cold_part)));
}

void Map::remove_last_chunk(SessionNumber number) {
  const Session before = *impl_->session(number);
  assert(is_going(before) && before.frames > 0);
  const ChunkId id = chunk_id({number, before.last});
  std::uint32_t frames = 0;
  std::optional<FrameId> left;  // the last frame that stays
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    const auto frame = hot(frame_in(id, slot));
    if (!frame) continue;
    ++frames;
    for (const std::string& label : std::vector<std::string>(frame->labels))
      set_label(frame_in(id, slot), label, false);
    impl_->state.pending.erase(frame_in(id, slot));
  }
  for (std::uint64_t index = std::uint64_t{id.chunk} * kFramesPerChunk; index > before.first;) {
    const FrameId at{number, static_cast<std::uint32_t>(--index)};
    if (hot(at)) {
      left = at;
      break;
    }
    visit_skipped(number, at.index, [&](const Skipped& gap) {  // a gap of any length is one step
      if (gap.from <= at.index) index = gap.from;
      return false;
    });
  }
  Session& session = impl_->edit_session(number);
  session.frames = left ? session.frames - frames : 0;
  session.last = left ? left->index : 0;
  session.first = left ? session.first : 0;
  session.last_time_us = left ? hot(*left)->time_us : session.first_time_us;
  if (!left) shrink_deleted(session);
  impl_->remove_chunk(id);
}

void Map::Impl::remove_chunk(ChunkId id) {
  WorkingChunk& chunk = touch(id);
  const auto let_go = [&](auto& part) {
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      if (part.bytes[slot] > 0) ledger->retire(part.since[slot], version + 1, part.bytes[slot]);
      budget->release(Share::kDirty, part.bytes[slot]);
      dirty_bytes -= part.bytes[slot];
    }
    part = {};
    part.since.fill(version + 1);
  };
  let_go(chunk.hot);
  let_go(chunk.warm);
  let_go(chunk.cold);
  chunk.removed = true;
}

void Map::add_session(Session session) {
  const SessionNumber number = session.number;
  assert(number != 0 && !impl_->session(number));
  impl_->sessions.insert(place_of(impl_->sessions, number), std::make_shared<Session>(std::move(session)));
  impl_->fresh_sessions.insert(number);
  impl_->dirty_sessions.insert(number);
}

Session& Map::edit_session(SessionNumber number) { return impl_->edit_session(number); }

Session& Map::Impl::edit_session(SessionNumber number) {
  auto at = sessions.begin() + (place_of(sessions, number) - sessions.begin());
  const bool edited = at != sessions.end() && (*at)->number == number;
  if (!edited || !fresh_sessions.contains(number)) {
    const auto before = edited ? *at : cache->session(*snapshot, number);
    if (!before) throw StatusError(no_such_session(number));
    auto copy = std::make_shared<Session>(*before);
    if (edited)
      *at = std::move(copy);
    else
      at = sessions.insert(at, std::move(copy));
    session_counts.remove(*before);
    fresh_sessions.insert(number);
    dirty_sessions.insert(number);
  }
  return const_cast<Session&>(**at);  // fresh: made non-const, and seen by nobody else yet
}

void Map::skip(SessionNumber number, const Skipped& skipped) {
  Session& session = impl_->edit_session(number);
  session.next_sequence = std::max(session.next_sequence, skipped.to + 1);
  if (is_going(session)) return;  // what is left of it must not grow
  (skipped.refused ? session.refused : session.given_up) += std::uint64_t{skipped.to} - skipped.from + 1;
  impl_->set_skipped({number, skipped.to}, skipped);
}

void Map::forget_skipped(SessionNumber number, std::size_t most) {
  Session& session = impl_->edit_session(number);
  assert(is_going(session));
  const std::uint64_t given_up = session.given_up;
  std::vector<Skipped> gone;
  visit_skipped(number, static_cast<std::uint32_t>(end_of(session)), [&](const Skipped& skipped) {
    gone.push_back(skipped);
    return gone.size() < most;
  });
  for (const Skipped& skipped : gone) {
    std::uint64_t& count = skipped.refused ? session.refused : session.given_up;
    count -= std::min(count, std::uint64_t{skipped.to} - skipped.from + 1);
    impl_->set_skipped({number, skipped.to}, std::nullopt);
  }
  if (gone.size() < most) session.refused = session.given_up = 0;  // also where they were wrong
  impl_->state.gaps -= std::min(impl_->state.gaps, given_up - session.given_up);
}

void Map::Impl::set_skipped(const SkippedTable::key_type& key, std::optional<Skipped> value) {
  skipped_touched = true;
  if (!skipped.insert_or_assign(key, std::move(value)).second) return;
  constexpr std::size_t kEntry = 2 * 64;  // a node of this tree, and one of the published tree
  budget->charge(Share::kDirty, kEntry);
  dirty_bytes += kEntry;
}

void Map::set_label(FrameId id, const std::string& label, bool present) {
  auto& labels = edit_hot(id).labels;
  const auto found = std::find(labels.begin(), labels.end(), label);
  if (present == (found != labels.end())) return;
  if (present)
    labels.insert(std::lower_bound(labels.begin(), labels.end(), label), label);
  else
    labels.erase(found);
  impl_->labels[{label, id}] = present;
  impl_->labels_touched = true;
}

MapState& Map::state() { return impl_->state; }

void Map::remember_edit(std::uint64_t sequence, EditKey edit) {
  impl_->edits[sequence] = std::move(edit);
  impl_->changed_edits.insert(sequence);
  if (impl_->edits.size() <= kRememberedEdits) return;
  impl_->changed_edits.insert(impl_->edits.begin()->first);
  impl_->edits.erase(impl_->edits.begin());
}

const std::map<std::uint64_t, EditKey>& Map::edits() const { return impl_->edits; }

void Map::record(const Event& event) {
  impl_->events.record(event);
  impl_->charge_events();
}

void Map::note_moved(FrameId frame) {
  impl_->events.note_moved(frame);
  impl_->charge_events();
}

std::shared_ptr<const MapView> Map::publish() { return impl_->publish(); }
void Map::watch_edits(EditWatcher watcher) { impl_->edit_watcher = std::move(watcher); }

std::shared_ptr<const MapView> Map::view() const {
  const MutexLock lock(impl_->view_mutex);
  return impl_->shown.view;
}

Status Map::commit() {
  (void)impl_->finish_commit();  // if it failed, what it had is dirty again
  if (Status begun = impl_->begin_commit({}); !begun.ok()) return begun;
  return *impl_->finish_commit();
}
bool Map::digests_hold() const { return impl_->digests_hold; }
Status Map::rebuild_digests(const DigestProgress& progress) { return impl_->make_digests(progress, false); }
Status Map::complete_digests(const DigestProgress& progress) { return impl_->make_digests(progress, true); }
Status Map::begin_commit(std::function<void()> written) { return impl_->begin_commit(std::move(written)); }
std::optional<Status> Map::finish_commit() { return impl_->finish_commit(); }
bool Map::commit_is_due() const {
  const std::size_t allowance = impl_->budget->allowance(Share::kDirty);
  const bool writing = impl_->committing && impl_->committing->written.valid() &&
                       impl_->committing->written.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
  if (writing) return impl_->dirty_bytes > allowance / 4 * 3;
  return dirty_bytes() > allowance / 4 || impl_->dirty_sessions.size() > kEditedSessions;
}
std::size_t Map::dirty_bytes() const { return impl_->dirty_bytes - (impl_->committing ? impl_->committing->bytes : 0); }

}  // namespace relmap::storage
