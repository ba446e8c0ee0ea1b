// For tests and benchmarks of routes: a fleet that drives around in a town of square blocks. Robots turn at random at
// crossings and recognise each crossing that any of them has passed. The town is made from a seed, takes a few bytes of
// memory a frame, and implements the graph that a map would have.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <unordered_map>
#include <vector>

#include "storage/testing/partial_graph.h"

namespace relmap::route {

struct StreetGridOptions {
  std::uint64_t seed = 1;
  std::uint32_t robots = 10;
  std::uint32_t frames_a_robot = 10'000;
  std::uint32_t crossings = 20;       // on a side of the town
  std::uint32_t frames_a_block = 50;  // from one crossing to the next
  double metres_a_frame = 2;
  double oneway_share = 0;  // of the robots
};

class StreetGrid final : public storage::PartialGraph {
 public:
  explicit StreetGrid(const StreetGridOptions& options)
      : options_(options), lasts_(std::size_t{options.crossings} * options.crossings) {
    std::mt19937_64 random(options.seed);
    for (std::uint32_t robot = 0; robot < options.robots; ++robot) drive(robot, random);
  }

  std::uint32_t frames() const { return options_.robots * options_.frames_a_robot; }
  std::uint64_t edges() const { return frames() - options_.robots + loops_; }
  template <typename Random>
  FrameId random_frame(Random& random) const {
    return {1 + static_cast<std::uint32_t>(random() % options_.robots),
            static_cast<std::uint32_t>(random() % options_.frames_a_robot)};
  }
  // Scales the length of the step to this frame, or of the loop edge stored there, relative to its first value.
  void set_length(FrameId frame, bool loop, double factor) { changed_[{frame, loop}].factor = factor; }
  // Sets the state of the loop edge stored with this frame.
  void set_state(FrameId frame, storage::EdgeState state) { changed_[{frame, true}].state = state; }
  std::optional<FrameId> recognised_at(FrameId frame) const {
    const auto loop = loop_to_.find(frame);
    return loop == loop_to_.end() ? std::nullopt : std::optional(loop->second);
  }

  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    if (id.session == 0 || id.session > options_.robots || id.index >= options_.frames_a_robot) return nullptr;
    auto frame = std::make_shared<storage::FrameHot>();
    frame->present = true;
    frame->time_us = 1'600'000'000'000'000 + std::int64_t{id.index} * 200'000;
    if (id.index > 0) frame->edges.push_back(step(id));
    if (const auto loop = loop_to_.find(id); loop != loop_to_.end()) frame->edges.push_back(closure(id, loop->second));
    if (id.index + 1 < options_.frames_a_robot) frame->incoming.push_back({{id.session, id.index + 1}, 0});
    if (const auto found = recognised_.find(id); found != recognised_.end())
      for (const FrameId later : found->second) frame->incoming.push_back({later, 1});
    std::sort(frame->incoming.begin(), frame->incoming.end());
    return frame;
  }
  std::vector<storage::Session> all_sessions() const override {
    std::vector<storage::Session> all;
    for (std::uint32_t number = 1; number <= options_.robots; ++number) all.push_back(*session(number));
    return all;
  }
  std::optional<storage::Session> session(SessionNumber number) const override {
    if (number == 0 || number > options_.robots) return std::nullopt;
    storage::Session session;
    session.number = number;
    session.header.oneway = is_oneway(number);
    session.display_name = "robot " + std::to_string(number);
    session.frames = options_.frames_a_robot;
    session.last = options_.frames_a_robot - 1;
    return session;
  }

 private:
  struct EdgeKey {
    FrameId frame;
    bool loop;
    bool operator==(const EdgeKey&) const = default;
  };
  struct EdgeKeyHash {
    std::size_t operator()(const EdgeKey& key) const { return detail::mix(key.frame.packed() * 2 + key.loop); }
  };
  struct Change {
    double factor = 1;
    storage::EdgeState state = storage::EdgeState::kAccepted;
  };

  bool is_oneway(SessionNumber number) const { return number <= options_.oneway_share * options_.robots; }

  void drive(std::uint32_t robot, std::mt19937_64& random) {
    const auto side = static_cast<int>(options_.crossings);
    int x = static_cast<int>(random() % options_.crossings), y = static_cast<int>(random() % options_.crossings);
    int dx = 1, dy = 0;
    for (std::uint32_t index = 0; index < options_.frames_a_robot; index += options_.frames_a_block) {
      const FrameId frame{robot + 1, index};
      auto& last = lasts_[static_cast<std::size_t>(y * side + x)];
      if (last.valid()) {
        loop_to_[frame] = last;
        recognised_[last].push_back(frame);
        ++loops_;
      }
      if (!last.valid() || random() % 2) last = frame;  // the earlier pass that is recognised
      do {                                              // straight on, left or right; back only at the edge of the town
        if (random() % 2) {
          const int before = dx;
          const bool left = random() % 2;
          dx = left ? dy : -dy;
          dy = left ? -before : before;
        }
        if (x + dx < 0 || x + dx >= side || y + dy < 0 || y + dy >= side) {
          dx = -dx;
          dy = -dy;
          if (random() % 2) std::swap(dx, dy);
        }
      } while (x + dx < 0 || x + dx >= side || y + dy < 0 || y + dy >= side);
      x += dx;
      y += dy;
    }
  }

  // A pseudo-random number between 0 and 1 that depends on a frame and a purpose.
  double chance(FrameId frame, std::uint64_t purpose) const {
    return static_cast<double>(detail::mix(frame.packed() * 8 + purpose + options_.seed * 0x9e3779b97f4a7c15u) >> 11) *
           0x1p-53;
  }
  Change change(FrameId frame, bool loop) const {
    const auto found = changed_.find({frame, loop});
    return found == changed_.end() ? Change() : found->second;
  }
  storage::Edge step(FrameId id) const {
    storage::Edge edge;
    edge.id = {id, 0};
    edge.a = {id.session, id.index - 1};
    edge.b = id;
    edge.T_ab.t = {0, 0, options_.metres_a_frame * (0.9 + 0.2 * chance(id, 0)) * change(id, false).factor};
    edge.covariance = (1e-4 + 1e-3 * chance(id, 1)) * Matrix6::Identity();
    edge.driven_s = static_cast<float>(0.1 + 0.3 * chance(id, 2));
    edge.standing_s = chance(id, 3) < 0.02 ? 20.0f : 0.0f;
    edge.support = 20 + static_cast<std::uint32_t>(100 * chance(id, 4));
    return edge;
  }
  storage::Edge closure(FrameId id, FrameId to) const {
    storage::Edge edge;
    edge.id = {id, 1};
    edge.a = to;
    edge.b = id;
    edge.kind = storage::EdgeKind::kLoop;
    edge.state = change(id, true).state;
    edge.reason = Reason::CONSISTENT;
    edge.T_ab.t = {0, 0, 4 * chance(id, 5) * change(id, true).factor};
    edge.covariance = 1e-3 * Matrix6::Identity();
    edge.driven_s = static_cast<float>(chance(id, 6));
    edge.support = 20 + static_cast<std::uint32_t>(100 * chance(id, 7));
    return edge;
  }

  const StreetGridOptions options_;
  std::vector<FrameId> lasts_;
  std::unordered_map<FrameId, FrameId> loop_to_;
  std::unordered_map<FrameId, std::vector<FrameId>> recognised_;
  std::unordered_map<EdgeKey, Change, EdgeKeyHash> changed_;
  std::uint64_t loops_ = 0;
};

}  // namespace relmap::route
