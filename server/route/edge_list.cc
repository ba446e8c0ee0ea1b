#include "server/route/edge_list.h"

#include <algorithm>
#include <vector>

namespace relmap::route {

namespace {

// Frames first..last of a session, both of which exist.
struct Span {
  SessionNumber session = 0;
  std::uint32_t first = 0, last = 0;

  FrameId begin() const { return {session, first}; }
};

class Walk {
 public:
  Walk(const storage::Graph& graph, const EdgeFilter& filter, EdgeId after, const WorkLimit& work,
       const std::function<bool(const storage::Edge&)>& visit)
      : graph_(graph), filter_(filter), after_(after), work_(work), visit_(visit) {}

  Status run() {
    if (filter_.frame) return run_spans(around(*filter_.frame));
    if (filter_.session) return run_session(*filter_.session);
    std::vector<Span> all;
    graph_.visit_sessions(0, [&](const storage::Session& session) {
      if (has_edges(session)) all.push_back({session.number, session.first, session.last});
      return true;
    });
    return run_spans(all);
  }

 private:
  static constexpr std::size_t kBytesPerOther = 64;

  // Frames of mono sessions have no edges.
  static bool has_edges(const storage::Session& session) {
    return session.frames > 0 && session.header.camera.is_stereo();
  }

  static Span one(FrameId id) { return {id.session, id.index, id.index}; }

  // The frames that store the edges of this frame.
  std::vector<Span> around(FrameId id) const {
    std::set<FrameId> frames{id};
    if (const auto hot = graph_.hot(id))
      for (const EdgeId incoming : hot->incoming) frames.insert(incoming.frame);
    std::vector<Span> spans;
    for (const FrameId frame : frames) spans.push_back(one(frame));
    return spans;
  }

  // Lists the edges of a session, including those that frames of other sessions store.
  Status run_session(SessionNumber number) {
    const auto session = graph_.session(number);
    if (!session || !has_edges(*session)) return {};
    const Span own{number, session->first, session->last};
    std::set<FrameId> others;
    bool going_on = true;
    const Status walked = each_frame(own, own.begin(), going_on, [&](const storage::FrameHot& hot) {
      for (const EdgeId incoming : hot.incoming)
        if (incoming.frame.session != number && incoming.frame >= after_.frame) others.insert(incoming.frame);
      held_ = others.size() * kBytesPerOther;
    });
    if (!walked.ok()) return walked;
    std::vector<Span> spans{own};
    for (const FrameId frame : others) spans.push_back(one(frame));
    std::sort(spans.begin(), spans.end(), [](const Span& x, const Span& y) { return x.begin() < y.begin(); });
    return run_spans(spans);
  }

  Status run_spans(const std::vector<Span>& spans) {
    bool going_on = true;
    for (const Span& span : spans) {
      if (span.session < after_.frame.session || FrameId{span.session, span.last} < after_.frame) continue;
      const FrameId start = std::max(span.begin(), after_.frame);
      const Status walked = each_frame(span, start, going_on, [&](const storage::FrameHot& hot) {
        for (const storage::Edge& edge : hot.edges)
          if (going_on && edge.id > after_ && filter_.matches(edge)) going_on = visit_(edge);
      });
      if (!walked.ok() || !going_on) return walked;
    }
    return {};
  }

  // Visits the frames from `start`, which must exist, to the end of the span.
  template <typename Visit>
  Status each_frame(const Span& span, FrameId start, const bool& going_on, Visit visit) {
    for (FrameId id = start; going_on;) {
      if (Status status = check(); !status.ok()) return status;
      const auto hot = graph_.hot(id);
      if (!hot) return {Reason::DATA_LOSS, "frame " + id.to_string() + " is missing"};
      visit(*hot);
      if (id.index >= span.last) break;
      const auto next = storage::next_in_session(id, *hot);
      if (!next) return {Reason::DATA_LOSS, "no edge leads on from frame " + id.to_string()};
      id = *next;
    }
    return {};
  }

  Status check() { return frames_++ % kWorkStride == 0 && work_.proceed ? work_.proceed(held_) : Status(); }

  const storage::Graph& graph_;
  const EdgeFilter& filter_;
  const EdgeId after_;
  const WorkLimit& work_;
  const std::function<bool(const storage::Edge&)>& visit_;
  std::size_t frames_ = 0, held_ = 0;
};

}  // namespace

Status for_each_edge(const storage::Graph& graph, const EdgeFilter& filter, EdgeId after, const WorkLimit& work,
                     const std::function<bool(const storage::Edge&)>& visit) {
  return Walk(graph, filter, after, work, visit).run();
}

}  // namespace relmap::route
