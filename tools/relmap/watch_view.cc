#include "tools/relmap/watch_view.h"

#include <algorithm>
#include <ctime>
#include <utility>
#include <variant>

#include "proto/base/clock.h"
#include "proto/base/overloaded.h"
#include "proto/base/visible_text.h"
#include "tools/relmap/edge_words.h"
#include "tools/relmap/robot_trouble.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

namespace {

// Most of what happens, nobody asked for: the daemon did it, or a robot's own stream.
bool nobody_asked(const client::WatchEvent& event) { return event.author.empty() || event.author == "relmapd"; }

// Only people are named.
std::string by_text(const client::WatchEvent& event) {
  return (nobody_asked(event) ? "" : ", by " + event.author) + (event.note.empty() ? "" : ": " + event.note);
}

std::string why_text(Reason reason) {
  const std::string why = explanation(reason);
  return why.empty() ? std::string(reason_name(reason)) : why;
}

std::string sequences_text(std::uint32_t first, std::uint32_t last) {
  return first == last ? std::to_string(first) : std::to_string(first) + ".." + std::to_string(last);
}

std::string closure_text(const client::Edge& edge) {
  return "closure " + edge.id.to_string() + " of frames " + edge.a.to_string() + " and " + edge.b.to_string() + ": " +
         name_of(edge.state) + ", " + why_text(edge.reason);
}

const char* state_text(client::SessionState state) {
  switch (state) {
    case client::SessionState::kOpen:
      return "is open";
    case client::SessionState::kEnded:
      return "has ended";
    case client::SessionState::kFrozen:
      return "is frozen";
    case client::SessionState::kDeleting:
      return "is being deleted";
  }
  return "";
}

// Robots open and end their sessions themselves, and none that is frozen: otherwise it was thawed, and is what it was
// before it was frozen.
bool is_thawed(client::SessionState state, bool frozen_or_by_somebody) {
  return frozen_or_by_somebody && (state == client::SessionState::kOpen || state == client::SessionState::kEnded);
}

const char* thawed_text(client::SessionState state) {
  return state == client::SessionState::kOpen ? "is thawed, and open as it was" : "is thawed, and ended as it was";
}

}  // namespace

std::string local_time_text(std::int64_t time_us) {
  const auto seconds = static_cast<std::time_t>(time_us / 1'000'000);
  std::tm local{};
  char text[32] = "";
  if (localtime_r(&seconds, &local)) std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &local);
  return text;
}

void WatchView::know(const std::vector<client::Session>& sessions) {
  for (const client::Session& session : sessions) names_[session.number] = session.name;
}

std::string WatchView::session_text(SessionNumber session) const {
  const auto known = names_.find(session);
  return "session " + std::to_string(session) + (known == names_.end() ? "" : " '" + known->second + "'");
}

// At first that all is well is none.
bool WatchView::storage_is_news(const Status& state) {
  return std::exchange(storage_, state.reason()) != state.reason();
}

std::vector<std::string> WatchView::lines_of(const client::WatchEvent& event) {
  const std::int64_t time_us = event.time_us != 0 ? event.time_us : now_us();
  const auto line = [&](const std::string& what) {
    return std::vector{visible_text(local_time_text(time_us) + "  " + what + by_text(event))};
  };
  using Lines = std::vector<std::string>;
  return std::visit(
      Overloaded{
          [&](const client::SessionChanged& e) {
            names_[e.session] = e.name;
            const auto before = states_.find(e.session);
            const bool frozen = before != states_.end() && before->second == client::SessionState::kFrozen;
            const bool thawed = is_thawed(e.state, frozen || !nobody_asked(event));
            states_[e.session] = e.state;
            return line(session_text(e.session) + " of " + e.robot + " " +
                        (thawed ? thawed_text(e.state) : state_text(e.state)));
          },
          [&](const client::FramesAdded& e) -> Lines {
            for (const client::AddedFrame& frame : e.frames) {
              Motion& motion = motion_[frame.frame.session];
              if (motion.added == 0) motion.first = frame.frame.index;
              ++motion.added;
              motion.last = frame.frame.index;
              motion.time_us = time_us;
            }
            return {};
          },
          [&](const client::FramesMoved& e) -> Lines {
            for (const client::FrameRange& range : e.ranges) {
              Motion& motion = motion_[range.session];
              motion.moved += std::uint64_t{range.last} - range.first + 1;
              motion.time_us = time_us;
            }
            return {};
          },
          [&](const client::SequencesSkipped& e) {
            return line(session_text(e.session) + ": " + (e.refused ? "refused " : "the robot gave up ") +
                        sequences_text(e.first, e.last) + ", " + refused_text(e.reason));
          },
          [&](const client::FramesRemoved& e) {
            return line(session_text(e.session) + ": frames from " + std::to_string(e.first) + " on are deleted");
          },
          [&](const client::SessionDeleted& e) { return line(session_text(e.session) + " is deleted"); },
          [&](const client::EdgeChanged& e) { return line(closure_text(e.edge)); },
          [&](const client::EdgeRemoved& e) {
            return line("closure " + e.edge.to_string() + " went with its session");
          },
          [&](const client::LabelsChanged& e) {
            std::string labels;
            for (const std::string& label : e.labels) labels += (labels.empty() ? " '" : ", '") + label + "'";
            return line("frame " + e.frame.to_string() +
                        (labels.empty() ? " has no label any more" : " is labelled" + labels));
          },
          [&](const client::RobotChanged& e) {
            const RobotTrouble trouble = trouble_of(e.robot, {});
            return line(robot_words(e.robot) + (!trouble.name.empty() ? ": " + trouble.name + ", " + trouble.what
                                                : e.robot.session == 0
                                                    ? std::string(" is heard, and its session has not begun")
                                                    : " sends keyframes for " + session_text(e.robot.session)));
          },
          [&](const client::StorageChanged& e) -> Lines {
            if (!storage_is_news(e.state)) return {};
            return line(e.state.ok() ? "keyframes are taken in again" : "nothing is taken in: " + e.state.to_string());
          },
          [&](const client::Resynced& e) { return line(std::string(reason_name(e.reason)) + ": " + e.message); },
          [](const client::CaughtUp&) -> Lines { return {}; },
          [](const client::WatchConnected&) -> Lines { return {}; },
          [](const client::WatchDisconnected&) -> Lines { return {}; },
      },
      event.what);
}

std::vector<std::string> WatchView::flush() {
  std::vector<std::string> lines;
  for (const auto& [session, motion] : motion_) {
    std::string text = local_time_text(motion.time_us) + "  " + session_text(session) + ": ";
    if (motion.added > 0)
      text += counted_text(motion.added, "frame") + " added (" + sequences_text(motion.first, motion.last) + ")";
    if (motion.moved > 0) text += (motion.added > 0 ? ", " : "") + counted_text(motion.moved, "frame") + " adjusted";
    lines.push_back(visible_text(text));
  }
  motion_.clear();
  return lines;
}

}  // namespace relmap::cli
