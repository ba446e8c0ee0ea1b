#include "server/map/map_builder.h"

#include <algorithm>
#include <chrono>
#include <type_traits>

#include "server/map/deletion.h"
#include "server/map/edge_edit.h"
#include "server/map/event_teller.h"
#include "server/map/sorted.h"
#include "server/map/support.h"
#include "server/map/tracks.h"
#include "storage/graph/binding.h"

namespace relmap::map {

namespace {

// Standard deviations of 10 m and a radian: practically no information, but enough to keep the solution unique.
const Matrix6 kUnknownStep = Vector6(100, 100, 100, 1, 1, 1).asDiagonal();

// The edge from the session's last frame to a new one. It is a prior edge if the robot did not see the step, or if
// keyframes in between are missing; the covariance is then multiplied by the number of steps.
storage::Edge motion_edge(FrameId previous, const storage::FrameHot& previous_hot, FrameId id,
                          const Keyframe& keyframe) {
  storage::Edge edge;
  edge.id = {id, 0};
  edge.a = previous;
  edge.b = id;
  // A robot that starts anew within a session does not know how it came from its last keyframe.
  const bool unknown = keyframe.source == MotionSource::kStart;
  edge.source = unknown ? MotionSource::kUnsensed : keyframe.source;
  const std::uint32_t steps = id.index - previous.index;
  edge.kind = steps == 1 && is_vision(keyframe.source) ? storage::EdgeKind::kOdometry : storage::EdgeKind::kPrior;
  edge.reason = steps == 1 ? Reason::MOTION : Reason::DECLARED_GAP;
  edge.T_ab = edge.prior_T_ab = (previous_hot.T_odom_frame.inverse() * keyframe.T_odom_frame).normalized();
  edge.covariance = edge.prior_covariance =
      unknown ? kUnknownStep : Matrix6(keyframe.step_covariance * static_cast<double>(steps));
  edge.prior_active = true;  // until its support has been counted
  edge.driven_s = static_cast<float>(static_cast<double>(keyframe.driven_us) * 1e-6);
  edge.standing_s = static_cast<float>(static_cast<double>(keyframe.standing_us) * 1e-6);
  return edge;
}

storage::Observation observe(LandmarkId landmark, const TrackMeasurement& z) {
  return {landmark, {}, z.u_left, z.v, z.u_right, z.level};
}

}  // namespace

MapBuilder::MapBuilder(storage::Map& map, storage::WordFunction words, rba::RbaOptions rba,
                       std::uint32_t loop_edge_spacing, ConsistencyRules rules)
    : map_(map), words_(std::move(words)), relaxer_(map, rba), loop_edge_spacing_(loop_edge_spacing), rules_(rules) {
  map_.visit_sessions(0, [&](const storage::Session& session) {
    if (stands_still(session)) relaxer_.freeze(session.number, true);
    return true;
  });
}

// Whether the frames that the session has do not move.
bool MapBuilder::stands_still(const storage::Session& session) {
  return storage::is_frozen(session) || (storage::is_going(session) && session.frames > 0);
}

void MapBuilder::freeze(const storage::Session& session) { relaxer_.freeze(session.number, stands_still(session)); }

Applied MapBuilder::apply(std::uint64_t sequence, const storage::JournalRecord& record,
                          std::optional<PreparedKeyframe> prepared) {
  EventTeller events(map_, record);
  Applied applied = std::visit(
      [&](const auto& r) {
        if constexpr (std::is_same_v<std::decay_t<decltype(r)>, storage::KeyframeRecord>)
          return apply_keyframe(sequence, r, prepared ? *std::move(prepared) : prepare(r, words_));
        else
          return apply_record(sequence, r);
      },
      record);
  if (const storage::EditKey* edit = storage::edit_key(record); edit && !edit->key.empty())
    map_.remember_edit(sequence, *edit);
  storage::MapState& state = map_.state();
  if (std::holds_alternative<storage::IdleWorkRecord>(record))
    ++state.idle_records;
  else if (!std::holds_alternative<storage::SetSessionStateRecord>(record))  // a session's end causes no work
    state.idle_records = 0;
  state.applied_sequence = sequence;
  map_.publish();
  events.tell(sequence, record, applied);
  return applied;
}

template <typename Work>
void MapBuilder::timed(Applied& applied, Work work) {
  const auto start = std::chrono::steady_clock::now();
  applied.relaxation = work();
  applied.relax_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  map_.state().numerical_failures += applied.relaxation.failures;
}

Applied MapBuilder::apply_record(std::uint64_t, const storage::SessionRecord& record) {
  if (map_.session(record.number)) return {};
  storage::Session session;
  session.number = record.number;
  session.header = record.header;
  session.display_name = record.display_name;
  map_.add_session(std::move(session));
  return {};
}

Applied MapBuilder::apply_keyframe(std::uint64_t sequence, const storage::KeyframeRecord& record,
                                   PreparedKeyframe prepared) {
  const auto session = map_.session(record.session);
  if (!prepared.keyframe.ok() || !session) return {};
  Keyframe& keyframe = *prepared.keyframe;
  const FrameId id{record.session, keyframe.sequence};
  if (map_.hot(id) || keyframe.sequence < session->next_sequence) return {};  // taken in or skipped before
  if (storage::is_going(*session))  // deletion began while the record was queued
    return apply_record(sequence,
                        storage::RefusalRecord{record.session, id.index, record.crc, Reason::SESSION_DELETED});

  storage::FrameHot hot;
  hot.present = true;
  hot.time_us = keyframe.time_us;
  hot.journal_sequence = sequence;
  hot.payload_crc = record.crc;
  hot.T_odom_frame = keyframe.T_odom_frame;
  hot.appearance_count = static_cast<std::uint32_t>(keyframe.appearance.size());
  hot.unknown = std::move(keyframe.unknown);
  // The motion of a single camera has no metric scale, so frames of a mono session have no edges.
  std::optional<FrameId> previous;
  if (session->frames > 0 && session->header.camera.is_stereo()) {
    previous = FrameId{record.session, session->last};
    hot.edges.push_back(motion_edge(*previous, *map_.hot(*previous), id, keyframe));
  }
  const auto tracks = previous ? live_tracks(map_, *previous) : std::unordered_map<TrackId, LandmarkId>{};
  Applied applied;
  applied.frame = id;
  applied.words = prepared.words;
  storage::FrameCold cold;
  cold.words = std::move(prepared.words);
  cold.appearance = std::move(keyframe.appearance);
  cold.picture = std::move(keyframe.picture);
  map_.add_frame(id, std::move(hot), {}, std::move(cold));
  if (previous) insert_sorted(map_.edit_hot(*previous).incoming, EdgeId{id, 0});

  // A track continues its landmark while a path leads to it; after that it starts a new one.
  PathsTo paths(map_, id);
  storage::FrameWarm& warm = map_.edit_warm(id);
  storage::FrameHot& own = map_.edit_hot(id);
  warm.observations.reserve(keyframe.tracks.size());
  for (const TrackMeasurement& z : keyframe.tracks) {
    const auto known = tracks.find(z.track);
    if (known != tracks.end() && paths.reachable_from(storage::meaning_of(map_, known->second).landmark.base)) {
      warm.observations.push_back(observe(known->second, z));
    } else {
      warm.observations.push_back(observe({id, static_cast<std::uint32_t>(own.landmarks.size())}, z));
      own.landmarks.push_back(start_landmark(session->header.camera, z));
    }
  }
  add_support(map_, paths);

  storage::Session& edited = map_.edit_session(record.session);
  if (edited.frames == 0) {
    edited.first = id.index;
    edited.first_time_us = keyframe.time_us;
  }
  edited.last = id.index;
  edited.last_time_us = keyframe.time_us;
  edited.next_sequence = id.index + 1;
  // A keyframe opens its session again. If the session was frozen meanwhile, it will be open once it is thawed.
  if (edited.state == storage::SessionState::kEnded) edited.state = storage::SessionState::kOpen;
  edited.before_frozen = storage::SessionState::kOpen;
  ++edited.frames;
  ++map_.state().keyframes;

  const FrameId seeds[] = {id};
  timed(applied, [&] { return relaxer_.relax(seeds); });
  return applied;
}

Applied MapBuilder::apply_record(std::uint64_t, const storage::GapRecord& record) {
  const auto session = map_.session(record.session);
  if (!session || record.to < record.from || record.from < session->next_sequence) return {};
  map_.skip(record.session, {record.from, record.to, 0, false, record.reason});
  if (!storage::is_going(*session)) map_.state().gaps += record.to - record.from + 1;
  return {};
}

Applied MapBuilder::apply_record(std::uint64_t, const storage::RefusalRecord& record) {
  ++map_.state().refused[static_cast<std::size_t>(record.reason)];
  const auto session = map_.session(record.session);
  if (!session || record.sequence < session->next_sequence) return {};
  map_.skip(record.session, {record.sequence, record.sequence, record.crc, true, record.reason});
  return {};
}

Applied MapBuilder::relax_from(ClosureChange change) {
  Applied applied;
  if (!change.seeds.empty()) timed(applied, [&] { return relaxer_.relax(change.seeds, !change.withdrawn.empty()); });
  applied.closures = std::move(change);
  return applied;
}

template <typename Edit>
Applied MapBuilder::recorded(Edit edit) {
  EdgeRecorder recorder(map_);
  ClosureChange change = edit(recorder);
  std::vector<EdgeChange> edges = recorder.changes();
  Applied applied = relax_from(std::move(change));
  applied.edges = std::move(edges);
  return applied;
}

Applied MapBuilder::apply_record(std::uint64_t sequence, const storage::ClosureProposalRecord& record) {
  return recorded([&](storage::EditableGraph& map) {
    ClosureChange change = apply_proposal(map, sequence, record, loop_edge_spacing_, rules_);
    if (record.unseen.valid())
      change.append(
          apply_unseen(map, sequence, {record.query, record.unseen, {}, record.submitted}, loop_edge_spacing_));
    return change;
  });
}

Applied MapBuilder::apply_record(std::uint64_t, const storage::BindingRecord& record) {
  return relax_from(apply_binding(map_, record));
}

Applied MapBuilder::apply_record(std::uint64_t sequence, const storage::UnseenRecord& record) {
  return recorded([&](storage::EditableGraph& map) { return apply_unseen(map, sequence, record, loop_edge_spacing_); });
}

Applied MapBuilder::apply_record(std::uint64_t sequence, const storage::SetEdgeStateRecord& record) {
  return recorded(
      [&](storage::EditableGraph& map) { return apply_edge_edit(map, sequence, record, loop_edge_spacing_); });
}

Applied MapBuilder::apply_record(std::uint64_t, const storage::SetLabelRecord& record) {
  if (map_.hot(record.frame) && !is_going(map_, record.frame))
    map_.set_label(record.frame, record.label, record.present);
  return {};
}

Applied MapBuilder::apply_record(std::uint64_t, const storage::IdleWorkRecord& record) {
  Applied applied;
  timed(applied, [&] { return relaxer_.relax_pending(record.budget); });
  return applied;
}

Applied MapBuilder::apply_record(std::uint64_t, const storage::SetSessionStateRecord& record) {
  const auto session = map_.session(record.session);
  if (!session || storage::is_going(*session) || session->state == record.state) return {};
  // Ending applies to open sessions only: it neither freezes nor thaws one.
  if (record.state == storage::SessionState::kEnded && session->state != storage::SessionState::kOpen) return {};
  storage::Session& edited = map_.edit_session(record.session);
  const bool thaws = storage::is_frozen(*session) && record.state == storage::SessionState::kOpen;
  edited.state = thaws ? session->before_frozen : record.state;
  edited.before_frozen = record.state == storage::SessionState::kFrozen ? session->state : storage::SessionState::kOpen;
  if (storage::is_going(edited)) edited.deleted_by = record.submitted.author;
  if (storage::is_deleted(edited)) storage::shrink_deleted(edited);
  freeze(edited);
  return {};
}

Applied MapBuilder::apply_record(std::uint64_t sequence, const storage::RemoveChunkRecord& record) {
  const Applied applied = relax_from(apply_deletion(map_, sequence, record, loop_edge_spacing_));
  if (const auto session = map_.session(record.session)) freeze(*session);
  return applied;
}

}  // namespace relmap::map
