// Maps for tests, drawn in ASCII. A letter or digit is a frame; its column and row are its position in metres (x right,
// z up the page); all frames look the same way. Lines between frames are only for the reader; edges are added by calls:
//
//   DrawnMap map(R"(
//     A---B---C
//             |
//     E-------D
//   )");
//   map.drive("ABCDE");   // a session: its frames in order, joined by odometry
//   map.close("AE");      // an accepted loop edge
#pragma once

#include <algorithm>
#include <cctype>
#include <map>
#include <string>
#include <string_view>

#include "storage/testing/partial_graph.h"

namespace relmap::route {

class DrawnMap final : public storage::PartialGraph {
 public:
  explicit DrawnMap(std::string_view drawing, double metres_per_cell = 1) {
    double x = 0, z = 0;
    for (const char c : drawing) {
      if (c == '\n') {
        x = 0;
        z -= metres_per_cell;
        continue;
      }
      if (std::isalnum(static_cast<unsigned char>(c))) place(c, {x, 0, z});
      x += metres_per_cell;
    }
  }

  // Adds a frame that is not drawn.
  void place(char name, const Vector3& position) { positions_[name] = position; }

  struct Drive {
    double metres_per_second = 1;
    double standing_s = 0;  // before each frame but the first
    bool oneway = false;
  };
  // Adds the next session; returns its number.
  SessionNumber drive(std::string_view names) { return drive(names, Drive()); }
  SessionNumber drive(std::string_view names, Drive how) {
    storage::Session session;
    session.number = static_cast<SessionNumber>(sessions_.size() + 1);
    session.display_name = "drive" + std::to_string(session.number);
    session.header.oneway = how.oneway;
    session.frames = static_cast<std::uint32_t>(names.size());
    session.last = session.frames - 1;
    sessions_[session.number] = session;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const FrameId id{session.number, static_cast<std::uint32_t>(i)};
      ids_[names[i]] = id;
      names_[id] = names[i];
      auto hot = std::make_shared<storage::FrameHot>();
      hot->present = true;
      frames_[id] = hot;
      if (i == 0) continue;
      storage::Edge edge = make_edge(names[i - 1], names[i], 0, storage::EdgeKind::kOdometry);
      edge.driven_s = static_cast<float>(edge.T_ab.t.norm() / how.metres_per_second);
      edge.standing_s = static_cast<float>(how.standing_s);
      add(edge);
    }
    return session.number;
  }

  // Renumbers `to`, the last frame of a drive, to `late`, which leaves a gap after `from`. `to` must have no loop
  // edges.
  void leave_a_gap(char from, char to, FrameId late) {
    auto hot = frames_.extract(id(to));
    hot.key() = late;
    for (storage::Edge& edge : hot.mapped()->edges) {
      edge.id.frame = late;
      edge.b = late;
      editable(id(from)).incoming = {edge.id};
    }
    frames_.insert(std::move(hot));
    ids_[to] = late;
    names_[late] = to;
    sessions_.at(late.session).last = late.index;
  }

  // Adds an accepted loop edge between the two named frames; returns its id.
  EdgeId close(std::string_view ends, double seconds = 1) {
    const bool swap = id(ends[0]) > id(ends[1]);
    const char a = swap ? ends[1] : ends[0], b = swap ? ends[0] : ends[1];
    storage::Edge edge = make_edge(a, b, editable(id(b)).next_loop_ordinal++, storage::EdgeKind::kLoop);
    edge.driven_s = static_cast<float>(seconds);
    add(edge);
    return edge.id;
  }
  void set_state(EdgeId id, storage::EdgeState state) { editable(id.frame).edge(id)->state = state; }
  void label(char name, const std::string& label) { editable(id(name)).labels.push_back(label); }

  FrameId id(char name) const { return ids_.at(name); }
  char name(FrameId id) const { return names_.at(id); }
  const Vector3& position(char name) const { return positions_.at(name); }
  storage::FrameHot& editable(FrameId id) { return *frames_.at(id); }
  storage::Session& edit_session(SessionNumber number) { return sessions_.at(number); }

  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    const auto it = frames_.find(id);
    return it == frames_.end() ? nullptr : it->second;
  }
  std::shared_ptr<const storage::FrameWarm> warm(FrameId id) const override {
    return frames_.contains(id) ? std::make_shared<const storage::FrameWarm>() : nullptr;
  }
  std::shared_ptr<const storage::FrameCold> cold(FrameId id) const override {
    return frames_.contains(id) ? std::make_shared<const storage::FrameCold>() : nullptr;
  }
  std::vector<storage::Session> all_sessions() const override {
    std::vector<storage::Session> all;
    for (const auto& [number, session] : sessions_) all.push_back(session);
    return all;
  }
  std::optional<storage::Session> session(SessionNumber number) const override {
    const auto it = sessions_.find(number);
    return it == sessions_.end() ? std::nullopt : std::optional(it->second);
  }
  std::vector<FrameId> labelled(const std::string& label) const override {
    std::vector<FrameId> found;
    for (const auto& [id, hot] : frames_)
      if (std::find(hot->labels.begin(), hot->labels.end(), label) != hot->labels.end()) found.push_back(id);
    return found;
  }

 private:
  storage::Edge make_edge(char a, char b, std::uint32_t ordinal, storage::EdgeKind kind) const {
    storage::Edge edge;
    edge.a = id(a);
    edge.b = id(b);
    edge.id = {edge.b, ordinal};
    edge.kind = kind;
    edge.T_ab.t = position(b) - position(a);
    edge.covariance = 1e-4 * Matrix6::Identity();
    return edge;
  }
  void add(const storage::Edge& edge) {
    editable(edge.b).edges.push_back(edge);
    auto& incoming = editable(edge.a).incoming;
    incoming.insert(std::upper_bound(incoming.begin(), incoming.end(), edge.id), edge.id);
  }

  std::map<char, Vector3> positions_;
  std::map<char, FrameId> ids_;
  std::map<FrameId, char> names_;
  std::map<FrameId, std::shared_ptr<storage::FrameHot>> frames_;
  std::map<SessionNumber, storage::Session> sessions_;
};

}  // namespace relmap::route
