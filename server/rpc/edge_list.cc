#include "server/rpc/edge_list.h"

#include <algorithm>
#include <vector>

namespace relmap {

namespace {

constexpr std::size_t kCheckStride = 256;

// Frames first..last of a session.
struct Span {
  SessionNumber session = 0;
  std::uint32_t first = 0, last = 0;

  FrameId begin() const { return {session, first}; }
};

class Walk {
 public:
  Walk(const Graph& graph, const EdgeFilter& filter, EdgeId after, const Deadline& deadline,
       const std::function<bool(const Edge&)>& visit)
      : graph_(graph), filter_(filter), after_(after), deadline_(deadline), visit_(visit) {}

  Status run() {
    if (filter_.frame) return run_spans(around(*filter_.frame));
    if (filter_.session) return run_session(*filter_.session);
    std::vector<Span> all;
    for (const Session& session : graph_.sessions()) all.push_back({session.number, session.first, session.last});
    return run_spans(all);
  }

 private:
  static Span one(FrameId id) { return {id.session, id.index, id.index}; }

  // The frames that store an edge of this one.
  std::vector<Span> around(FrameId id) const {
    std::set<FrameId> frames{id};
    if (const auto hot = graph_.hot(id))
      for (const EdgeId incoming : hot->incoming) frames.insert(incoming.frame);
    std::vector<Span> spans;
    for (const FrameId frame : frames) spans.push_back(one(frame));
    return spans;
  }

  // The session, and the frames of others that closed a loop with it.
  Status run_session(SessionNumber number) {
    const auto session = graph_.session(number);
    if (!session) return {};
    std::set<FrameId> others;
    for (std::uint64_t i = session->first; i <= session->last && session->frames > 0; ++i) {
      if (Status status = check(); !status.ok()) return status;
      const auto hot = graph_.hot({number, static_cast<std::uint32_t>(i)});
      if (!hot) continue;
      for (const EdgeId incoming : hot->incoming)
        if (incoming.frame.session != number) others.insert(incoming.frame);
    }
    std::vector<Span> spans{{number, session->first, session->last}};
    for (const FrameId frame : others) spans.push_back(one(frame));
    std::sort(spans.begin(), spans.end(), [](const Span& x, const Span& y) { return x.begin() < y.begin(); });
    return run_spans(spans);
  }

  Status run_spans(const std::vector<Span>& spans) {
    for (const Span& span : spans) {
      if (span.session < after_.frame.session) continue;
      std::uint64_t i = span.first;
      if (span.session == after_.frame.session) i = std::max<std::uint64_t>(i, after_.frame.index);
      for (; i <= span.last; ++i) {
        if (Status status = check(); !status.ok()) return status;
        const auto hot = graph_.hot({span.session, static_cast<std::uint32_t>(i)});
        if (!hot) continue;
        for (const Edge& edge : hot->edges)
          if (edge.id > after_ && filter_.matches(edge) && !visit_(edge)) return {};
      }
    }
    return {};
  }

  Status check() { return frames_++ % kCheckStride == 0 ? deadline_.check() : Status(); }

  const Graph& graph_;
  const EdgeFilter& filter_;
  const EdgeId after_;
  const Deadline& deadline_;
  const std::function<bool(const Edge&)>& visit_;
  std::size_t frames_ = 0;
};

}  // namespace

Status for_each_edge(const Graph& graph, const EdgeFilter& filter, EdgeId after, const Deadline& deadline,
                     const std::function<bool(const Edge&)>& visit) {
  return Walk(graph, filter, after, deadline, visit).run();
}

}  // namespace relmap
