#include "server/ingest/mapper_sink.h"

#include <algorithm>

namespace relmap::ingest {

std::size_t MapperSink::free_bytes() const {
  const storage::Budget& budget = mapper_.budget();
  const std::size_t allowed = budget.allowance(storage::Share::kQueues);
  return allowed - std::min(allowed, budget.used(storage::Share::kQueues));
}

std::optional<ClosureNews> closure_news(const storage::Graph& map, const storage::Edge& closure) {
  const auto session = map.session(closure.b.session);
  if (!session || !storage::is_metric(closure.verification)) return std::nullopt;
  ClosureNews told{{}, session->header.robot};
  PoseNews& news = told.news;
  news.session = session->header.uuid;
  news.kind = closure.state == storage::EdgeState::kAccepted    ? PoseNews::Kind::kClosure
              : closure.state == storage::EdgeState::kCandidate ? PoseNews::Kind::kLocalised
                                                                : PoseNews::Kind::kClosureOut;
  news.keyframe = closure.b;
  news.frame = closure.a;
  news.T_frame_keyframe = closure.T_ab;
  news.covariance = closure.covariance;
  return told;
}

}  // namespace relmap::ingest
