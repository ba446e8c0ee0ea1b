#include "tools/console/layout/make_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <unordered_map>

#include "tools/console/layout/layout_placement.h"
#include "tools/console/layout/line_importance.h"

namespace relmap::console {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// From the axes of a part's root, a camera (x right, y down, z forward), to the plane seen from above.
Matrix3 plane_from_camera() {
  Matrix3 R;
  R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return R;
}
Matrix3 turn_about_z(const PlaneMotion& motion) {
  Matrix3 R = Matrix3::Identity();
  R.topLeftCorner<2, 2>() << motion.cosine, -motion.sine, motion.sine, motion.cosine;
  return R;
}
Vector2 on_plane(const Vector3& position) { return position.head<2>(); }
double heading_of(const Matrix3& rotation) { return std::atan2(rotation(1, 2), rotation(0, 2)); }

std::uint32_t seconds_of(std::int64_t time_us) {
  const std::int64_t seconds = time_us / 1'000'000;
  return seconds > 0 && seconds <= std::numeric_limits<std::uint32_t>::max() ? static_cast<std::uint32_t>(seconds) : 0;
}

class Maker {
 public:
  Maker(const client::Skeleton& skeleton, const client::RelaxedSkeleton& relaxed, const MapLayout* before)
      : skeleton_(skeleton), relaxed_(relaxed), before_(before) {}

  MapLayout make() {
    out_.map_version = skeleton_.map_version;
    out_.commit_number = skeleton_.commit_number;
    out_.frames = skeleton_.frames;
    out_.converged = relaxed_.converged;
    take_runs();
    take_poses();
    place_all();
    weigh_lines();
    take_closures();
    find_torn();
    choose_zooms(out_);
    return std::move(out_);
  }

 private:
  void take_runs() {
    std::vector<const client::Skeleton::Chain*> chains;
    std::size_t points = 0;
    for (const auto& chain : skeleton_.chains) {
      if (chain.points.empty()) continue;
      chains.push_back(&chain);
      points += chain.points.size();
    }
    std::sort(chains.begin(), chains.end(),
              [](const auto* x, const auto* y) { return x->points.front().frame < y->points.front().frame; });
    out_.points.reserve(points);
    out_.runs.reserve(chains.size());
    for (const auto* chain : chains) {
      MapLayout::Run& run = out_.runs.emplace_back();
      run.session = chain->session;
      run.first = static_cast<std::uint32_t>(out_.points.size());
      for (const auto& point : chain->points) {
        MapLayout::Point& kept = out_.points.emplace_back();
        kept.index = point.frame.index;
        kept.time_s = seconds_of(point.time_us);
        kept.frames = point.frames;
        kept.translation_variance = static_cast<float>(point.translation_variance);
        kept.rotation_variance = static_cast<float>(point.rotation_variance);
        kept.flags = static_cast<std::uint8_t>((point.unmeasured ? kUnmeasured : 0) | (point.carried ? kCarried : 0));
        if (point.time_us == 0) continue;
        const std::int64_t ms = point.time_us / 1000;
        out_.first_ms = out_.first_ms == 0 ? ms : std::min(out_.first_ms, ms);
        out_.last_ms = std::max(out_.last_ms, ms);
      }
      run.end = static_cast<std::uint32_t>(out_.points.size());
    }
    for (std::size_t r = 0; r < out_.runs.size(); ++r) {
      const bool first = r == 0 || out_.runs[r - 1].session != out_.runs[r].session;
      const bool last = r + 1 == out_.runs.size() || out_.runs[r + 1].session != out_.runs[r].session;
      if (first) out_.points[out_.runs[r].first].flags |= kSessionEnd;
      if (last) out_.points[out_.runs[r].end - 1].flags |= kSessionEnd;
    }
    for (const client::Spring& spring : relaxed_.springs)
      if (spring.doubtful && !spring.pulls)
        if (const std::uint32_t point = number_of(spring.relaxed.b); point != kNone)
          out_.points[point].flags |= kNotPulling;
  }

  std::uint32_t number_of(FrameId frame) const {
    const MapLayout::Run* const run = out_.run_of(frame);
    if (!run) return kNone;
    const auto end = out_.points.begin() + run->end;
    const auto at =
        std::lower_bound(out_.points.begin() + run->first, end, frame.index,
                         [](const MapLayout::Point& point, std::uint32_t index) { return point.index < index; });
    return at != end && at->index == frame.index ? static_cast<std::uint32_t>(at - out_.points.begin()) : kNone;
  }

  // Poses in the plane of each part, and the part of each run.
  void take_poses() {
    poses_.resize(out_.points.size());
    std::vector<std::uint32_t> part_of(out_.points.size(), 0);
    const SE3 T_plane_root{plane_from_camera(), Vector3::Zero()};
    out_.parts.resize(relaxed_.parts.size());
    for (std::size_t p = 0; p < relaxed_.parts.size(); ++p) {
      out_.parts[p].root = relaxed_.parts[p].root;
      for (const auto& place : relaxed_.parts[p].places) {
        const std::uint32_t point = number_of(place.frame);
        if (point == kNone) continue;
        poses_[point] = T_plane_root * place.T_root_frame;
        part_of[point] = static_cast<std::uint32_t>(p);
      }
    }
    for (MapLayout::Run& run : out_.runs) {
      run.part = part_of[run.first];
      MapLayout::Part& part = out_.parts[run.part];
      for (std::uint32_t k = run.first; k < run.end; ++k) part.frames += k == run.first ? 1 : out_.points[k].frames;
      if (part.sessions.empty() || part.sessions.back() != run.session) part.sessions.push_back(run.session);
    }
  }

  // How each part lay in the layout before: by the part of that layout with which it shares most points.
  std::vector<std::optional<PlaneMotion>> motions_before() const {
    std::vector<std::optional<PlaneMotion>> motions(out_.parts.size());
    if (!before_) return motions;
    std::vector<std::map<std::uint32_t, PlaneFit>> fits(out_.parts.size());
    for (const MapLayout::Run& run : out_.runs)
      for (std::uint32_t k = run.first; k < run.end; ++k)
        if (const auto place = before_->place(out_.frame_of(run, k)))
          fits[run.part][before_->runs[place->run].part].add(on_plane(poses_[k].t), on_plane(place->position),
                                                             heading_of(poses_[k].R), place->heading());
    for (std::size_t p = 0; p < fits.size(); ++p) {
      std::size_t most = 0;
      for (const auto& [part, fit] : fits[p])
        if (fit.pairs() > most) {
          most = fit.pairs();
          motions[p] = fit.motion();
        }
    }
    return motions;
  }

  void place_all() {
    const auto before = motions_before();
    std::vector<std::vector<std::uint32_t>> points_of(out_.parts.size());
    for (const MapLayout::Run& run : out_.runs)
      for (std::uint32_t k = run.first; k < run.end; ++k) points_of[run.part].push_back(k);
    std::vector<PlaneMotion> motions(out_.parts.size());
    std::vector<PlacedPart> placed(out_.parts.size());
    for (std::size_t p = 0; p < motions.size(); ++p) {
      if (before[p]) {
        motions[p] = *before[p];
        placed[p].kept = true;
      } else {
        std::vector<Vector2> flat;
        flat.reserve(points_of[p].size());
        for (const std::uint32_t k : points_of[p]) flat.push_back(on_plane(poses_[k].t));
        motions[p] = lowest_turn(flat);
      }
      constexpr double kFar = std::numeric_limits<double>::infinity();
      LayoutBox box{Vector2::Constant(kFar), Vector2::Constant(-kFar)};
      for (const std::uint32_t k : points_of[p]) {
        const Vector2 at = motions[p](on_plane(poses_[k].t));
        box = {box.low.cwiseMin(at), box.high.cwiseMax(at)};
      }
      if (points_of[p].empty()) box = {};
      placed[p].box = box;
    }
    std::vector<LayoutBox> wanted;
    for (const PlacedPart& part : placed) wanted.push_back(part.box);
    place_parts(placed);
    LayoutBox all = placed.empty() ? LayoutBox() : placed[0].box;
    for (std::size_t p = 0; p < motions.size(); ++p) {
      motions[p].shift += placed[p].box.low - wanted[p].low;
      out_.parts[p].box = placed[p].box;
      all = {all.low.cwiseMin(placed[p].box.low), all.high.cwiseMax(placed[p].box.high)};
      const SE3 T_world_plane{turn_about_z(motions[p]), {motions[p].shift.x(), motions[p].shift.y(), 0}};
      for (const std::uint32_t k : points_of[p]) {
        const SE3 pose = T_world_plane * poses_[k];
        const Vector3 rotation = so3_log(pose.R);
        out_.points[k].position = pose.t;
        for (int i = 0; i < 3; ++i)
          out_.points[k].rotation[static_cast<std::size_t>(i)] = static_cast<float>(rotation[i]);
      }
    }
    std::optional<WorldSquare> square;
    if (before_) square = WorldSquare{before_->corner, before_->size};
    const WorldSquare world = world_around(all, square);
    out_.corner = world.corner;
    out_.size = world.size;
  }

  void weigh_lines() {
    std::vector<Vector2> line;
    for (const MapLayout::Run& run : out_.runs) {
      line.clear();
      for (std::uint32_t k = run.first; k < run.end; ++k) line.push_back(on_plane(out_.points[k].position));
      const std::vector<float> importance = line_importance(line);
      for (std::size_t i = 0; i < importance.size(); ++i) out_.points[run.first + i].importance = importance[i];
    }
  }

  void take_closures() {
    out_.closures.reserve(skeleton_.closures.size());
    std::vector<std::uint32_t> part_of(out_.points.size());
    for (const MapLayout::Run& run : out_.runs)
      std::fill(part_of.begin() + run.first, part_of.begin() + run.end, run.part);
    for (const client::Skeleton::Closure& told : skeleton_.closures) {
      MapLayout::Closure closure;
      closure.at_a = number_of(told.a);
      closure.at_b = number_of(told.id.frame);
      if (closure.at_a == kNone || closure.at_b == kNone) continue;
      closure.id = told.id;
      closure.a = told.a;
      closure.state = told.state;
      closure.carries = told.carries;
      closure.alike = told.alike;
      closure.suspicion = static_cast<float>(told.suspicion);
      closure.translation_variance = static_cast<float>(told.translation_variance);
      closure.rotation_variance = static_cast<float>(told.rotation_variance);
      if (part_of[closure.at_a] == part_of[closure.at_b])
        closure.sigmas = static_cast<float>(
            client::strain_of(client::spring_of(told), poses_[closure.at_a], poses_[closure.at_b]).sigmas);
      out_.closures.push_back(closure);
    }
    std::sort(out_.closures.begin(), out_.closures.end(),
              [](const MapLayout::Closure& x, const MapLayout::Closure& y) { return x.id < y.id; });
  }

  void find_torn() {
    for (const client::Spring& spring : relaxed_.springs) {
      if (spring.doubtful) continue;
      const std::uint32_t a = number_of(spring.relaxed.a), b = number_of(spring.relaxed.b);
      if (a == kNone || b == kNone) continue;
      const client::Tear tear = client::strain_of(spring, poses_[a], poses_[b]);
      if (tear.sigmas > client::kTearSigmas) out_.torn.push_back(tear);
    }
    out_.torn_in_all = out_.torn.size();
    client::sort_worst_first(out_.torn);
    if (out_.torn.size() > MapLayout::kMaxTorn) out_.torn.resize(MapLayout::kMaxTorn);
    out_.torn.shrink_to_fit();
  }

  const client::Skeleton& skeleton_;
  const client::RelaxedSkeleton& relaxed_;
  const MapLayout* const before_;
  MapLayout out_;
  std::vector<SE3> poses_;  // in the plane of the part, by point
};

// The bits of x and y by turns, so that all of a tile at any zoom stand together when sorted.
std::uint64_t interleaved(std::uint32_t x, std::uint32_t y) {
  const auto spread = [](std::uint64_t v) {
    v = (v | (v << 16)) & 0x0000ffff0000ffffULL;
    v = (v | (v << 8)) & 0x00ff00ff00ff00ffULL;
    v = (v | (v << 4)) & 0x0f0f0f0f0f0f0f0fULL;
    v = (v | (v << 2)) & 0x3333333333333333ULL;
    return (v | (v << 1)) & 0x5555555555555555ULL;
  };
  return spread(x) | (spread(y) << 1);
}

}  // namespace

MapLayout make_layout(const client::Skeleton& skeleton, const client::RelaxedSkeleton& relaxed,
                      const MapLayout* before) {
  return Maker(skeleton, relaxed, before).make();
}

void choose_zooms(MapLayout& layout) {
  constexpr std::uint32_t kFinest = kMaxZooms + 1;
  struct Counted {
    std::uint64_t key = 0;
    std::uint32_t keyframes = 0;
  };
  std::vector<Counted> counted;
  counted.reserve(layout.points.size());
  const double tiles = std::ldexp(1.0, kFinest);
  const auto cell = [&](double offset) {
    return static_cast<std::uint32_t>(std::clamp(offset / layout.size * tiles, 0.0, tiles - 1));
  };
  for (const MapLayout::Run& run : layout.runs)
    for (std::uint32_t k = run.first; k < run.end; ++k) {
      const Vector2 at = layout.points[k].position.head<2>() - layout.corner;
      counted.push_back({interleaved(cell(at.x()), cell(at.y())), k == run.first ? 1 : layout.points[k].frames});
    }
  std::sort(counted.begin(), counted.end(), [](const Counted& x, const Counted& y) { return x.key < y.key; });
  struct Most {
    std::uint64_t points = 0, keyframes = 0;
  };
  const auto most_at = [&](std::uint32_t zoom) {
    Most most, tile;
    std::uint64_t key = 0;
    for (const Counted& c : counted) {
      if (const std::uint64_t of = c.key >> (2 * (kFinest - zoom)); of != key) {
        key = of;
        tile = {};
      }
      most.points = std::max(most.points, ++tile.points);
      most.keyframes = std::max(most.keyframes, tile.keyframes += c.keyframes);
    }
    return most;
  };
  layout.zooms = 0;
  while (layout.zooms < kMaxZooms && layout.size / std::ldexp(1.0, static_cast<int>(layout.zooms)) > kLeastTile &&
         (most_at(layout.zooms).points > kMaxPointsOfTile || most_at(layout.zooms + 1).keyframes > kMaxPointsOfTile))
    ++layout.zooms;
}

}  // namespace relmap::console
