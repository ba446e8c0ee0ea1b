#include "tools/console/layout/tile_maker.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/console/layout/tile_lines.h"

namespace relmap::console {
namespace {

constexpr double kShownPixels = 512,
                 kShortest = 8;  // of a tile; of a closure that is drawn though nothing is wrong with it

class TileMaker {
 public:
  TileMaker(const TileIndex& index, const TileId& id, const TileContent& content)
      : index_(index),
        layout_(index.layout()),
        id_(id),
        content_(content),
        found_in_(id.at(std::min(id.zoom, layout_.zooms))) {}

  Tile make() {
    Tile tile;
    double tolerance = index_.tolerance(id_.zoom);
    std::size_t stride = 1;  // of the keyframes between points
    for (;;) {
      tile = {};
      tile.flags = (content_.old ? Tile::kHasOld : 0) | (content_.sigmas ? Tile::kHasSigmas : 0);
      add_lines(tolerance, stride, tile);
      if (tile.vertices.size() <= kMaxVertices || tolerance > layout_.size) break;
      const bool finest = stride >= kMostStride || !content_.keyframes;
      if (!finest) stride *= 2;
      if (finest) tolerance = std::max(2 * tolerance, index_.tile_size(id_.zoom) / (2 * kShownPixels));
    }
    add_closures(tile);
    return tile;
  }

 private:
  static constexpr std::size_t kMostStride = 1024;

  void add_lines(double tolerance, std::size_t stride, Tile& tile) {
    TileLines lines(index_.box(id_), tile);
    const std::vector<std::uint32_t> ends = index_.segments(found_in_);
    const double found_with = index_.tolerance(found_in_.zoom);
    // Segments that follow each other are one line, which is simplified further if it must.
    std::size_t k = 0;
    while (k < ends.size()) {
      const std::uint32_t run_number = index_.run_of(ends[k]);
      const MapLayout::Run& run = layout_.runs[run_number];
      std::vector<std::uint32_t> line;
      if (ends[k] != run.first) line.push_back(drawn_before(ends[k], run, found_with));
      line.push_back(ends[k]);
      for (++k; k < ends.size() && ends[k] < run.end && drawn_before(ends[k], run, found_with) == line.back(); ++k)
        line.push_back(ends[k]);
      lines.begin(run.session, run.part);
      for (std::size_t i = 0; i < line.size(); ++i) {
        const bool drawn = i == 0 || i + 1 == line.size() || index_.is_drawn(line[i], tolerance);
        if (drawn) add_to(line[i], run, stride, tolerance, lines, i == 0);
      }
      lines.end();
    }
  }

  std::uint32_t drawn_before(std::uint32_t point, const MapLayout::Run& run, double tolerance) const {
    do --point;
    while (point > run.first && !index_.is_drawn(point, tolerance));
    return point;
  }

  // Adds the step to a point, and what is drawn of it.
  void add_to(std::uint32_t point, const MapLayout::Run& run, std::size_t stride, double tolerance, TileLines& lines,
              bool first) {
    if (!first && content_.keyframes && id_.zoom > layout_.zooms && tolerance == 0)
      add_keyframes(point, run, stride, lines);
    const MapLayout::Point& p = layout_.points[point];
    LineVertex vertex;
    vertex.at = p.position.head<2>();
    vertex.index = p.index;
    vertex.time_s = p.time_s;
    vertex.flags = first ? p.flags & kSessionEnd : flags_between(last_, point);
    vertex.old = old_of({run.session, p.index}, vertex.at);
    vertex.sigma = content_.sigmas ? (*content_.sigmas)[point] : 0;
    lines.add(vertex);
    last_ = point;
  }

  // A drawn step is a guess, or carried, if at least half of the way that it stands for is.
  std::uint8_t flags_between(std::uint32_t from, std::uint32_t to) const {
    double all = 0, guessed = 0, carried = 0;
    for (std::uint32_t k = from + 1; k <= to; ++k) {
      const double length = (layout_.points[k].position - layout_.points[k - 1].position).norm() + 1e-9;
      all += length;
      if (layout_.points[k].flags & kUnmeasured) guessed += length;
      if (layout_.points[k].flags & kCarried) carried += length;
    }
    return static_cast<std::uint8_t>((2 * guessed >= all ? kUnmeasured : 0) | (2 * carried >= all ? kCarried : 0) |
                                     (layout_.points[to].flags & kSessionEnd));
  }

  void add_keyframes(std::uint32_t point, const MapLayout::Run& run, std::size_t stride, TileLines& lines) {
    const auto line = content_.keyframes->find(run.session);
    if (line == content_.keyframes->end()) return;
    const auto& keyframes = line->second->keyframes;
    const MapLayout::Point &from = layout_.points[point - 1], &to = layout_.points[point];
    auto at = std::upper_bound(keyframes.begin(), keyframes.end(), from.index,
                               [](std::uint32_t i, const KeyframeLine::Keyframe& k) { return i < k.index; });
    for (std::size_t n = 1; at != keyframes.end() && at->index < to.index; ++at, ++n) {
      if (n % stride != 0) continue;
      LineVertex vertex;
      vertex.at = at->at;
      vertex.index = at->index;
      vertex.time_s = at->time_s;
      vertex.flags = at->flags;
      vertex.old = old_of({run.session, at->index}, vertex.at);
      if (content_.sigmas) {
        const double share = static_cast<double>(at->index - from.index) / static_cast<double>(to.index - from.index);
        const double a = (*content_.sigmas)[point - 1], b = (*content_.sigmas)[point];
        vertex.sigma =
            std::isfinite(a) && std::isfinite(b) ? std::sqrt((1 - share) * a * a + share * b * b) : std::max(a, b);
      }
      lines.add(vertex);
    }
  }

  Vector2 old_of(FrameId frame, const Vector2& now) const {
    if (!content_.old) return now;
    const auto place = content_.old->place(frame);
    return place ? Vector2(place->position.head<2>()) : now;
  }

  void add_closures(Tile& tile) const {
    const LayoutBox box = index_.box(id_);
    const bool last_column = id_.x + 1 == TileIndex::tiles(id_.zoom),
               last_row = id_.y + 1 == TileIndex::tiles(id_.zoom);
    const auto holds = [&](const Vector2& p) {
      return p.x() >= box.low.x() && p.y() >= box.low.y() && (p.x() < box.high.x() || last_column) &&
             (p.y() < box.high.y() || last_row);
    };
    const double shortest = kShortest / kShownPixels * index_.tile_size(id_.zoom);
    std::vector<std::uint32_t> chosen;
    for (const std::uint32_t c : index_.closures(found_in_)) {
      const MapLayout::Closure& closure = layout_.closures[c];
      const Vector2 a = at(closure.at_a), b = at(closure.at_b);
      if (id_.zoom > layout_.zooms && !holds(a) && !holds(b)) continue;
      const bool matters = closure.suspicion >= kSuspicious || closure.torn() || (a - b).norm() > shortest;
      if (matters || id_.zoom >= layout_.zooms) chosen.push_back(c);
    }
    const auto before = [&](std::uint32_t x, std::uint32_t y) {
      const MapLayout::Closure &p = layout_.closures[x], &q = layout_.closures[y];
      if (p.torn() != q.torn()) return p.torn();
      if (p.suspicion != q.suspicion) return p.suspicion > q.suspicion;
      return x < y;
    };
    if (chosen.size() > kMaxClosures) {
      std::nth_element(chosen.begin(), chosen.begin() + kMaxClosures, chosen.end(), before);
      chosen.resize(kMaxClosures);
    }
    std::sort(chosen.begin(), chosen.end(), before);
    for (const std::uint32_t c : chosen) tile.closures.push_back(closure_of(layout_.closures[c], tile));
  }

  Vector2 at(std::uint32_t point) const { return layout_.points[point].position.head<2>(); }

  Tile::Closure closure_of(const MapLayout::Closure& closure, const Tile& tile) const {
    Tile::Closure told;
    const Vector2 origin(tile.origin_x, tile.origin_y);
    const auto put = [&](const Vector2& p, float& x, float& y) {
      x = static_cast<float>(p.x() - origin.x());
      y = static_cast<float>(p.y() - origin.y());
    };
    put(at(closure.at_a), told.a_x, told.a_y);
    put(at(closure.at_b), told.b_x, told.b_y);
    told.id = closure.id;
    told.a = closure.a;
    told.time_s = layout_.points[closure.at_b].time_s;
    told.alike = closure.alike;
    told.suspicion = closure.suspicion;
    told.sigmas = closure.sigmas;
    told.state = static_cast<std::uint8_t>(closure.state);
    told.flags =
        static_cast<std::uint8_t>((closure.carries ? Tile::kIsEdge : 0) | (closure.torn() ? Tile::kIsTorn : 0));
    if (content_.old) {
      put(old_of(closure.a, at(closure.at_a)), told.old_a_x, told.old_a_y);
      put(old_of(closure.id.frame, at(closure.at_b)), told.old_b_x, told.old_b_y);
    }
    return told;
  }

  const TileIndex& index_;
  const MapLayout& layout_;
  const TileId id_;
  const TileContent& content_;
  const TileId found_in_;   // the tile of the index that holds it
  std::uint32_t last_ = 0;  // the point that was drawn last
};

}  // namespace

Tile make_tile(const TileIndex& index, const TileId& id, const TileContent& content) {
  return TileMaker(index, id, content).make();
}

std::vector<SessionNumber> sessions_in(const TileIndex& index, const TileId& id) {
  const MapLayout& layout = index.layout();
  const LayoutBox box = index.box(id);
  std::vector<SessionNumber> sessions;
  for (const std::uint32_t point : index.segments(id.at(std::min(id.zoom, layout.zooms)))) {
    const MapLayout::Run& run = layout.runs[index.run_of(point)];
    if (!sessions.empty() && sessions.back() == run.session) continue;
    double from = 0, to = 1;
    const std::uint32_t before = point == run.first ? point : point - 1;
    // What lies between two points may bend away from their line by about as much as they are apart.
    const Vector2 a = layout.points[before].position.head<2>(), b = layout.points[point].position.head<2>();
    const Vector2 around = Vector2::Constant((b - a).norm() / 2);
    if (clip_segment(a, b, {box.low - around, box.high + around}, from, to)) sessions.push_back(run.session);
  }
  return sessions;
}

}  // namespace relmap::console
