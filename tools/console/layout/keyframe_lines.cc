#include "tools/console/layout/keyframe_lines.h"

#include <algorithm>
#include <span>

namespace relmap::console {
namespace {

constexpr std::uint64_t kReadAtOnce = 100'000;  // keyframes, about 20 MB
constexpr std::chrono::seconds kAnswerWithin{10};

using Point = client::Skeleton::Point;

// The keyframes between two neighbouring points of the layout: `steps` lead from the first one to the second, the last
// of them to the second itself.
void bend(const MapLayout& layout, std::uint32_t from, std::span<const Point> steps, KeyframeLine& line) {
  SE3 pose{layout.rotation_of(from), layout.points[from].position};
  const std::size_t first = line.keyframes.size();
  for (const Point& step : steps) {
    pose = pose * step.T_before_this;
    const std::int64_t seconds = step.time_us / 1'000'000;
    line.keyframes.push_back(
        {pose.t.head<2>(), step.frame.index, static_cast<std::uint32_t>(std::max<std::int64_t>(seconds, 0)),
         static_cast<std::uint8_t>((step.unmeasured ? kUnmeasured : 0) | (step.carried ? kCarried : 0))});
  }
  const Vector2 missed = layout.points[from + 1].position.head<2>() - pose.t.head<2>();
  line.keyframes.pop_back();
  for (std::size_t k = first; k < line.keyframes.size(); ++k)
    line.keyframes[k].at += static_cast<double>(k - first + 1) / static_cast<double>(steps.size()) * missed;
}

}  // namespace

KeyframeLine bend_onto(const MapLayout& layout, SessionNumber session, const client::Skeleton& skeleton) {
  KeyframeLine line;
  for (const client::Skeleton::Chain& chain : skeleton.chains) {
    if (chain.session != session) continue;
    const auto position = [&](std::uint32_t index) {  // in the chain; its end if it does not have the frame
      const auto at = std::lower_bound(chain.points.begin(), chain.points.end(), index,
                                       [](const Point& point, std::uint32_t i) { return point.frame.index < i; });
      return at != chain.points.end() && at->frame.index == index ? at : chain.points.end();
    };
    for (const MapLayout::Run& run : layout.runs) {
      if (run.session != session) continue;
      for (std::uint32_t k = run.first; k + 1 < run.end; ++k) {
        const auto from = position(layout.points[k].index), to = position(layout.points[k + 1].index);
        if (from == chain.points.end() || to == chain.points.end() || to - from < 2) continue;
        bend(layout, k, {&*from + 1, static_cast<std::size_t>(to - from)}, line);
      }
    }
  }
  std::sort(line.keyframes.begin(), line.keyframes.end(),
            [](const auto& x, const auto& y) { return x.index < y.index; });
  line.keyframes.shrink_to_fit();
  return line;
}

KeyframeLines::Lines KeyframeLines::kept(const MapLayout& layout, const std::vector<SessionNumber>& sessions) {
  Lines lines;
  for (const SessionNumber session : sessions)
    if (auto kept = kept_.find({layout.version, session})) lines[session] = std::move(kept);
  return lines;
}

Result<KeyframeLines::Lines> KeyframeLines::of(const MapLayout& layout, const std::vector<SessionNumber>& sessions,
                                               const ClientOf& client) {
  if (Lines lines = kept(layout, sessions); lines.size() == sessions.size()) return lines;
  const MutexLock lock(reading_);
  Lines lines = kept(layout, sessions);  // another thread may have read them meanwhile
  std::vector<SessionNumber> missing;
  for (const SessionNumber session : sessions)
    if (!lines.contains(session)) missing.push_back(session);
  if (missing.empty()) return lines;
  if (Clock::now() < asked_again_) return failure_;
  const auto connected = client();
  Status status = connected.status();
  if (status.ok()) {
    const auto hasty = (*connected)->with_deadline(kAnswerWithin);
    status = read(layout, missing, *hasty, lines);
  }
  if (status.ok()) return lines;
  if (status.reason() == Reason::UNREACHABLE || status.reason() == Reason::DEADLINE) {
    failure_ = status;
    asked_again_ = Clock::now() + away_;
  }
  return status;
}

Status KeyframeLines::read(const MapLayout& layout, const std::vector<SessionNumber>& missing, client::Client& client,
                           Lines& lines) {
  std::map<SessionNumber, std::uint64_t> keyframes;
  for (const MapLayout::Run& run : layout.runs)
    keyframes[run.session] += layout.points[run.end - 1].index - layout.points[run.first].index + 1;
  for (std::size_t next = 0; next < missing.size();) {
    client::SkeletonOptions options{.level = 3};
    for (std::uint64_t read = 0; next < missing.size() && (options.sessions.empty() || read < kReadAtOnce); ++next) {
      options.sessions.push_back(missing[next]);
      read += keyframes[missing[next]];
    }
    const auto skeleton = client.skeleton(options);
    if (!skeleton.ok()) return skeleton.status();
    for (const SessionNumber session : options.sessions) {
      auto line = std::make_shared<const KeyframeLine>(bend_onto(layout, session, *skeleton));
      kept_.keep({layout.version, session}, line, line->bytes());
      lines[session] = std::move(line);
    }
  }
  return {};
}

}  // namespace relmap::console
