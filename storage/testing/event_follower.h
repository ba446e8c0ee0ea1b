// Follows the log of events and keeps what it tells: the sessions, frames, closures and labels of the map. For tests
// that the log tells all that the map is.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "storage/events/event_log.h"
#include "storage/graph/graph.h"

namespace relmap::storage {

// What events tell of a map, in words where a test compares it.
struct ToldMap {
  std::map<SessionNumber, std::string> sessions;
  std::map<FrameId, std::int64_t> frames;  // when they were taken
  std::map<EdgeId, std::string> closures;
  std::map<FrameId, std::vector<std::string>> labels;
  std::map<std::pair<SessionNumber, std::uint32_t>, bool> skipped;  // by the last sequence of a range: refused

  bool operator==(const ToldMap&) const = default;

  static std::string words(const SessionUuid& uuid, const std::string& robot, const std::string& name,
                           SessionState state) {
    return uuid.to_string() + " " + robot + "/" + name + " " + std::to_string(static_cast<int>(state));
  }
  static std::string words(FrameId a, EdgeState state, Reason reason, bool carries, Verification verification,
                           std::uint16_t inliers) {
    return a.to_string() + " " + std::to_string(static_cast<int>(state)) + " " + std::string(reason_name(reason)) +
           (carries ? " carries " : " binds ") + std::to_string(static_cast<int>(verification)) + " " +
           std::to_string(inliers);
  }

  // What the map itself says. A deleted session, of which only the uuid is kept, is not there.
  static ToldMap of(const Graph& graph) {
    ToldMap told;
    graph.visit_sessions(0, [&](const Session& session) {
      if (is_deleted(session)) return true;
      told.sessions[session.number] =
          words(session.header.uuid, session.header.robot, session.display_name, session.state);
      graph.visit_skipped(session.number, 0, [&](const Skipped& item) {
        told.skipped[{session.number, item.to}] = item.refused;
        return true;
      });
      for (std::uint64_t index = session.first; session.frames > 0 && index <= session.last; ++index) {
        const FrameId id{session.number, static_cast<std::uint32_t>(index)};
        const auto hot = graph.hot(id);
        if (!hot) continue;
        told.frames[id] = hot->time_us;
        if (!hot->labels.empty()) told.labels[id] = hot->labels;
        for (const Edge& edge : hot->edges)
          if (edge.kind == EdgeKind::kLoop)
            told.closures[edge.id] =
                words(edge.a, edge.state, edge.reason, edge.carries, edge.verification, edge.inliers);
      }
      return true;
    });
    return told;
  }
};

class EventFollower {
 public:
  // Reads on to the end of the log, `bytes` at a time. No gap is expected.
  void follow(const EngineSnapshot& snapshot, std::size_t bytes = 4096) {
    for (;;) {
      const EventsRead read = read_events(snapshot, through_, bytes).or_throw();
      EXPECT_FALSE(read.gap) << "after " << through_.sequence << ":" << through_.ordinal;
      for (const Event& event : read.events) {
        EXPECT_GT(event.at, through_);
        through_ = event.at;
        events_.push_back(event);
        std::visit([this](const auto& content) { apply(content); }, event.content);
      }
      EXPECT_EQ(through_, read.through);
      if (!read.more) break;
    }
    EXPECT_EQ(through_, newest_event(snapshot).or_throw());
  }

  const ToldMap& map() const { return map_; }
  const std::vector<Event>& events() const { return events_; }  // all that were read

 private:
  void apply(const SessionEvent& e) {
    map_.sessions[e.session] = ToldMap::words(e.uuid, e.robot, e.display_name, e.state);
  }
  void apply(const FrameAddedEvent& e) { map_.frames[e.frame] = e.time_us; }
  void apply(const SkippedEvent& e) { map_.skipped[{e.session, e.skipped.to}] = e.skipped.refused; }
  void apply(const FramesRemovedEvent& e) {
    const auto remove = [&](auto& of) {
      of.erase(of.lower_bound({e.session, e.first}), of.lower_bound({e.session + 1, 0}));
    };
    remove(map_.frames);
    remove(map_.labels);
  }
  void apply(const SessionDeletedEvent& e) {
    map_.sessions.erase(e.session);
    std::erase_if(map_.skipped, [&](const auto& item) { return item.first.first == e.session; });
  }
  void apply(const ClosureEvent& e) {
    map_.closures[e.id] = ToldMap::words(e.a, e.state, e.reason, e.carries, e.verification, e.inliers);
  }
  void apply(const ClosureRemovedEvent& e) { EXPECT_EQ(map_.closures.erase(e.id), 1u) << e.id.to_string(); }
  void apply(const LabelsEvent& e) {
    if (e.labels.empty())
      map_.labels.erase(e.frame);
    else
      map_.labels[e.frame] = e.labels;
  }
  void apply(const FramesMovedEvent& e) {
    for (const FrameRange& range : e.ranges)
      for (std::uint64_t index = range.first; index <= range.last; ++index) {
        const FrameId frame{range.session, static_cast<std::uint32_t>(index)};
        EXPECT_TRUE(map_.frames.contains(frame)) << frame.to_string();
      }
  }

  EventPosition through_;
  ToldMap map_;
  std::vector<Event> events_;
};

}  // namespace relmap::storage
