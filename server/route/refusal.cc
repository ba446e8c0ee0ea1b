#include "server/route/refusal.h"

#include "proto/base/number_text.h"

namespace relmap::route {
namespace {

std::string name_sessions(const storage::Graph& graph, const std::set<SessionNumber>& numbers) {
  constexpr std::size_t kNamed = 8;
  std::string text;
  std::size_t named = 0;
  for (const SessionNumber number : numbers) {
    if (named == kNamed) return text + " and " + std::to_string(numbers.size() - kNamed) + " more";
    if (named++) text += ", ";
    const auto session = graph.session(number);
    text += std::to_string(number) + (session ? " (" + session->display_name + ")" : "");
  }
  return text;
}

const char* unit_of(const RouteWeights& weights) {
  return weights == kByDistance ? " m" : weights == kByTime || weights == kByTimeStandingToo ? " s" : "";
}

}  // namespace

Status check_weights(const RouteWeights& weights) {
  if (weights.valid()) return {};
  return {Reason::INVALID_ARGUMENT, "each weight must be 0 or between 1e-9 and 1e9, and not all may be 0"};
}

Status check_ends(std::span<const FrameId> from, std::span<const FrameId> to) {
  if (from.empty()) return {Reason::INVALID_ARGUMENT, "no frame at the start of the route"};
  if (to.empty()) return {Reason::INVALID_ARGUMENT, "no frame at the goal of the route"};
  return {};
}

Status no_such_frame(FrameId frame) { return {Reason::NO_SUCH_FRAME, "no frame " + frame.to_string()}; }

Status end_refused(bool start) {
  return {Reason::NOT_CONNECTED,
          std::string("the ") + (start ? "start" : "goal") +
              " is not in the sessions that were asked for, or is among the frames to be avoided"};
}

Status beyond(double max_cost, const RouteWeights& weights) {
  return {Reason::COST_LIMIT, "no route within " + number_text(max_cost) + unit_of(weights)};
}

Status not_connected(const storage::Graph& graph, const std::set<SessionNumber>& reached, std::span<const FrameId> to,
                     bool oneway, bool filter) {
  std::set<SessionNumber> wanted;
  for (const FrameId frame : to) wanted.insert(frame.session);
  std::string text = "from the start, edges lead to session(s) " + name_sessions(graph, reached) +
                     "; the goal is in session(s) " + name_sessions(graph, wanted);
  wanted.insert(reached.begin(), reached.end());
  std::erase_if(wanted, [&](SessionNumber number) {
    const auto session = graph.session(number);
    return !session || session->header.camera.is_stereo();
  });
  if (!wanted.empty()) text += "; frames of one camera have no edges: session(s) " + name_sessions(graph, wanted);
  if (oneway) text += "; edges against the direction of one-way sessions were left out";
  if (filter) text += "; frames and edges that were asked to be avoided were left out";
  return {Reason::NOT_CONNECTED, std::move(text)};
}

}  // namespace relmap::route
