// For tests: a town of streets in a map that grows and changes, and the cells of its routes.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/route/overlay/route_index.h"
#include "server/route/testing/street_grid.h"
#include "storage/engine/memory_engine.h"
#include "storage/map/map.h"
#include "storage/memory/budget.h"

namespace relmap::route {

inline const std::vector<RouteWeights> kTownMetrics{kByDistance, kByTime, {1, 0.5, 0.2, 30}};

// A town in a map. The test does the worker's part.
class LiveTown {
 public:
  explicit LiveTown(std::size_t budget_bytes = std::size_t{256} << 20)
      : town_(options()), budget_(std::make_shared<storage::Budget>(budget_bytes)) {
    auto engine = storage::make_memory_engine();
    const std::uint64_t epoch = engine->acquire().or_throw();
    map_ = storage::Map::open(engine, epoch, budget_).or_throw();
    for (storage::Session session : town_.sessions()) {
      session.frames = session.last = 0;
      map_->add_session(session);
    }
    map_->publish();
  }

  std::unique_ptr<RouteIndex> index(const std::string& folder = "") {
    auto index = std::make_unique<RouteIndex>(
        RouteIndexOptions{folder, room_for_others, kTownMetrics, 1, 20, std::chrono::milliseconds(10)},
        [this] {
          if (views_fail) throw StatusError(Status(Reason::IO_ERROR, "the disk"));
          return map_->view();
        },
        budget_);
    map_->watch_edits([to = index.get()](std::uint64_t version, std::span<const storage::ChunkId> chunks) {
      to->changed(version, chunks);
    });
    return index;
  }

  // Lets every robot drive on.
  void drive(std::uint32_t frames) {
    for (std::uint32_t i = 0; i < frames && frames_ < options().frames_a_robot; ++i, ++frames_)
      for (SessionNumber robot = 1; robot <= options().robots; ++robot) add({robot, frames_});
    map_->publish();
  }
  // Estimates an edge anew, and removes a loop edge or puts it back.
  template <typename Random>
  void change(Random& random) {
    storage::FrameHot& frame = map_->edit_hot(random_frame(random));
    for (storage::Edge& edge : frame.edges) edge.T_ab.t *= 0.5 + 0.01 * static_cast<double>(random() % 100);
    FrameId crossing = random_frame(random);
    crossing.index = crossing.index / options().frames_a_block * options().frames_a_block;
    for (storage::Edge& edge : map_->edit_hot(crossing).edges)
      if (edge.kind == storage::EdgeKind::kLoop)
        edge.state = random() % 2 ? storage::EdgeState::kAccepted : storage::EdgeState::kRemoved;
    map_->publish();
  }

  // Removes the end of a robot's drive from the map.
  void remove_chunk(SessionNumber robot) {
    map_->edit_session(robot).state = storage::SessionState::kDeleting;
    const std::uint32_t last = map_->session(robot)->last;
    for (std::uint32_t index = last / storage::kFramesPerChunk * storage::kFramesPerChunk; index <= last; ++index) {
      const auto hot = map_->hot({robot, index});
      for (const storage::Edge& edge : hot->edges) std::erase(map_->edit_hot(edge.a).incoming, edge.id);
      for (const EdgeId id : hot->incoming)
        std::erase_if(map_->edit_hot(id.frame).edges, [&](const storage::Edge& edge) { return edge.id == id; });
    }
    map_->remove_last_chunk(robot);
    map_->publish();
  }
  template <typename Random>
  FrameId random_frame(Random& random) const {
    return {1 + static_cast<SessionNumber>(random() % options().robots),
            static_cast<std::uint32_t>(random() % frames_)};
  }
  storage::Map& map() { return *map_; }
  storage::Budget& budget() { return *budget_; }

  std::atomic<bool> views_fail = false;
  std::uint64_t room_for_others = 0;

 private:
  static StreetGridOptions options() {
    StreetGridOptions town;
    town.robots = 4;
    town.frames_a_robot = 3000;
    town.crossings = 6;
    town.oneway_share = 0.25;
    return town;
  }
  void add(FrameId id) {
    storage::FrameHot hot = *town_.hot(id);
    hot.incoming.clear();
    std::erase_if(hot.edges, [&](const storage::Edge& edge) { return edge.a.index > id.index; });
    const std::vector<storage::Edge> edges = hot.edges;
    map_->add_frame(id, std::move(hot), {}, {});
    for (const storage::Edge& edge : edges) {
      auto& incoming = map_->edit_hot(edge.a).incoming;
      incoming.insert(std::lower_bound(incoming.begin(), incoming.end(), edge.id), edge.id);
    }
    storage::Session& session = map_->edit_session(id.session);
    session.last = id.index;
    ++session.frames;
  }

  const StreetGrid town_;
  const std::shared_ptr<storage::Budget> budget_;
  std::unique_ptr<storage::Map> map_;
  std::uint32_t frames_ = 0;
};

}  // namespace relmap::route
