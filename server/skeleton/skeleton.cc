#include "server/skeleton/skeleton.h"

#include <algorithm>

#include "proto/base/read_number.h"
#include "server/skeleton/level.h"

namespace relmap::skeleton {

using storage::ChunkDigest;
using storage::ChunkId;
using storage::ClosureDigest;
using storage::DigestsOf;

namespace {

constexpr std::size_t kPointBytes = 40, kClosureBytes = 64;  // in a message, about
constexpr std::uint32_t kChunksPerCheck = 64;

bool in_force(const ClosureDigest& closure) { return closure.state == storage::EdgeState::kAccepted; }

ChunkId next_chunk(ChunkId id) {
  return id.chunk == ~std::uint32_t{0} ? ChunkId{id.session + 1, 0} : ChunkId{id.session, id.chunk + 1};
}

}  // namespace

std::string Position::to_string() const { return last.to_string() + ":" + std::to_string(frames_done); }

std::optional<Position> Position::parse(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return std::nullopt;
  const auto frame = FrameId::parse(text.substr(0, colon));
  Position position;
  if (!frame || !read_number(std::string_view(text).substr(colon + 1), position.frames_done)) return std::nullopt;
  position.last = *frame;
  return position;
}

SkeletonReader::SkeletonReader(std::shared_ptr<const storage::MapView> view, SkeletonOptions options,
                               Suspicion suspicion, Proceed proceed)
    : view_(std::move(view)),
      options_(std::move(options)),
      suspicion_(std::move(suspicion)),
      proceed_(std::move(proceed)),
      contraction_(options_.level) {}

Result<std::unique_ptr<SkeletonReader>> SkeletonReader::open(std::shared_ptr<const storage::MapView> view,
                                                             SkeletonOptions options, Suspicion suspicion,
                                                             Proceed proceed) {
  if (options.level >= kLevels)
    return {Reason::INVALID_ARGUMENT, "level " + std::to_string(options.level) + " of a skeleton: 0 to 3"};
  std::unique_ptr<SkeletonReader> reader(
      new SkeletonReader(std::move(view), std::move(options), std::move(suspicion), std::move(proceed)));
  if (Status chosen = reader->choose_sessions(); !chosen.ok()) return chosen;
  return reader;
}

Status SkeletonReader::choose_sessions() {
  for (const SessionNumber number : options_.sessions) {
    const auto session = storage::existing_session(*view_, number);
    if (!session.ok()) return session.status();
    if (!session->header.camera.is_stereo())
      return {Reason::NOT_STEREO,
              "session " + std::to_string(number) + " is a mono session: nothing connects its frames"};
  }
  std::vector<SessionNumber> wanted = options_.sessions;
  std::sort(wanted.begin(), wanted.end());
  view_->visit_sessions(0, [&](const storage::Session& session) {
    if (session.frames == 0 || !session.header.camera.is_stereo()) return true;
    if (!wanted.empty() && !std::binary_search(wanted.begin(), wanted.end(), session.number)) return true;
    sessions_.push_back(session.number);
    frames_total_ += session.frames;
    return true;
  });
  return {};
}

bool SkeletonReader::is_chosen(SessionNumber session) const {
  return std::binary_search(sessions_.begin(), sessions_.end(), session);
}

std::vector<ChosenClosure> SkeletonReader::chosen_of(const ChunkDigest& chunk) const {
  std::vector<const ClosureDigest*> closures;
  for (const storage::FrameDigest& frame : chunk.frames)
    for (const ClosureDigest& closure : frame.closures)
      if (closure.kind == storage::EdgeKind::kLoop && (in_force(closure) || options_.candidates) &&
          is_chosen(closure.a.session) && closure.a != closure.id.frame)
        closures.push_back(&closure);
  return choose_closures(closures, closure_stretch(options_.level), suspicion_);
}

// Visits the chunks of the chosen sessions from `from` on.
Status SkeletonReader::visit(ChunkId from, DigestsOf which, const std::function<bool(const ChunkDigest&)>& visit) {
  Status stopped;
  std::uint32_t count = 0;
  const auto proceed = [&] {
    if (count++ % kChunksPerCheck != 0 || !proceed_) return true;
    stopped = proceed_(older_ends_.capacity() * sizeof(FrameId) + sessions_.capacity() * sizeof(SessionNumber));
    return stopped.ok();
  };
  bool going = true;
  const auto next = [&](SessionNumber session) {
    return std::lower_bound(sessions_.begin(), sessions_.end(), session);
  };
  for (auto session = next(from.session); going && stopped.ok() && session != sessions_.end();) {
    ChunkId leave{};  // where sessions begin that are not chosen
    const Status visited = view_->visit_digests(
        std::max(from, ChunkId{*session, 0}),
        [&](const ChunkDigest& chunk) {
          if (!is_chosen(chunk.id.session)) {
            leave = chunk.id;
            return false;
          }
          if (!proceed()) return false;
          return going = visit(chunk);
        },
        which);
    if (!visited.ok()) return visited;
    if (leave.session == 0) break;
    session = next(leave.session);
  }
  return stopped;
}

Status SkeletonReader::find_older_ends() {
  const Status visited = visit({}, DigestsOf::kClosures, [&](const ChunkDigest& chunk) {
    for (const ChosenClosure& chosen : chosen_of(chunk)) older_ends_.push_back(chosen.closure->a);
    return true;
  });
  if (!visited.ok()) return visited;
  std::sort(older_ends_.begin(), older_ends_.end());
  older_ends_.erase(std::unique(older_ends_.begin(), older_ends_.end()), older_ends_.end());
  ends_known_ = true;
  return {};
}

std::uint64_t SkeletonReader::kept_in(const ChunkDigest& chunk, const std::vector<ChosenClosure>& closures) const {
  std::uint64_t kept = 0;
  for (const ChosenClosure& chosen : closures) kept |= std::uint64_t{1} << storage::slot_of(chosen.closure->id.frame);
  for (auto end = std::lower_bound(older_ends_.begin(), older_ends_.end(), frame_in(chunk.id, 0));
       end != older_ends_.end() && storage::chunk_id(*end) == chunk.id; ++end)
    kept |= std::uint64_t{1} << storage::slot_of(*end);
  return kept;
}

Result<std::optional<Page>> SkeletonReader::next() {
  if (done_) return std::optional<Page>();
  if (!ends_known_)
    if (Status found = find_older_ends(); !found.ok()) return found;
  Page page;
  ChunkId from{};
  std::uint64_t done = 0;
  if (position_) {
    // The last chunk that was told is contracted again if it was another reader that told it.
    const ChunkId last = storage::chunk_id(position_->last);
    from = contraction_.last() == position_->last ? next_chunk(last) : last;
    done = position_->frames_done;
  }
  contraction_.begin_chain();
  std::size_t bytes = 0;
  bool full = false;
  const Status visited = visit(from, DigestsOf::kAll, [&](const ChunkDigest& chunk) {
    const std::vector<ChosenClosure> closures = chosen_of(chunk);
    if (position_ && chunk.id == storage::chunk_id(position_->last)) {
      std::vector<Chain> told;
      contraction_.add(chunk, kept_in(chunk, closures), told);
      contraction_.begin_chain();
      return true;
    }
    const std::size_t chains = page.chains.size(), last = chains > 0 ? page.chains.back().points.size() : 0;
    contraction_.add(chunk, kept_in(chunk, closures), page.chains);
    for (std::size_t i = chains > 0 ? chains - 1 : 0; i < page.chains.size(); ++i)
      bytes += kPointBytes * (page.chains[i].points.size() - (i + 1 == chains ? last : 0));
    for (const ChosenClosure& chosen : closures) {
      page.closures.push_back({*chosen.closure, chosen.suspicion, chosen.alike});
      bytes += kClosureBytes;
    }
    done += chunk.frames.size();
    page.end = {frame_in(chunk.id, chunk.frames.back().slot), done};
    full = bytes >= options_.page_bytes;
    return !full;
  });
  if (!visited.ok()) return visited;
  done_ = !full;
  if (!page.end.last.valid()) return std::optional<Page>();
  position_ = page.end;
  return std::optional<Page>(std::move(page));
}

}  // namespace relmap::skeleton
