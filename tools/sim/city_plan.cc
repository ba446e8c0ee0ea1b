#include "tools/sim/city_plan.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace relmap::sim {

namespace {

constexpr double kIntoCabin = 2.5;    // metres that a robot drives into the cabin, and out of it
constexpr double kToOtherLane = 0.3;  // probability, at each crossing
constexpr double kStraightOn = 0.5;
constexpr int kCurvePieces = 32;  // of a curve whose length is summed up

Heading heading_of(PieceId piece) { return static_cast<Heading>(piece % 4); }
Heading turned(Heading heading, int quarters) {
  return static_cast<Heading>((static_cast<int>(heading) + 4 + quarters) % 4);
}

std::vector<double> spaced(Random& random, int count, const CityOptions& options) {
  std::vector<double> places{0};
  while (static_cast<int>(places.size()) < count)
    places.push_back(places.back() + random.uniform(options.min_block, options.max_block));
  return places;
}

// A cubic Bezier curve with the given ends and directions there: a quarter of a circle, nearly, if they fit one.
struct Curve {
  std::array<Vector2, 4> control;

  Curve(const Vector2& from, const Vector2& from_direction, const Vector2& to, const Vector2& to_direction) {
    // 0.39 of the chord is 0.5523 of the radius of a quarter of a circle.
    const double reach = 0.39 * (to - from).norm();
    control = {from, from + reach * from_direction, to - reach * to_direction, to};
  }
  Vector2 at(double t) const {
    const double s = 1 - t;
    return s * s * s * control[0] + 3 * s * s * t * control[1] + 3 * s * t * t * control[2] + t * t * t * control[3];
  }
  Vector2 tangent(double t) const {
    const double s = 1 - t;
    return s * s * (control[1] - control[0]) + 2 * s * t * (control[2] - control[1]) +
           t * t * (control[3] - control[2]);
  }
  // The parameter at which `metres` are behind, and how many there are in all.
  struct Measured {
    double t, length;
  };
  Measured measure(double metres) const {
    Measured measured{1, 0};
    Vector2 before = at(0);
    bool found = false;
    for (int i = 1; i <= kCurvePieces; ++i) {
      const double t = static_cast<double>(i) / kCurvePieces;
      const Vector2 here = at(t);
      const double piece = (here - before).norm();
      if (!found && measured.length + piece >= metres) {
        measured.t = t - (1 - (metres - measured.length) / piece) / kCurvePieces;
        found = true;
      }
      measured.length += piece;
      before = here;
    }
    return measured;
  }
};

PlanePose pose_of(const Vector2& place, const Vector2& direction) {
  return {place.x(), place.y(), std::atan2(direction.x(), direction.y())};
}

}  // namespace

Vector2 direction_of(Heading heading) {
  switch (heading) {
    case Heading::kNorth:
      return {0, 1};
    case Heading::kEast:
      return {1, 0};
    case Heading::kSouth:
      return {0, -1};
    case Heading::kWest:
      return {-1, 0};
  }
  return {0, 1};
}

CityPlan::CityPlan(const CityOptions& options) {
  assert(options.columns >= 2 && options.rows >= 2 && options.min_block > 2 * kHalfStreet);
  Random random(options.seed);
  x_ = spaced(random, options.columns, options);
  z_ = spaced(random, options.rows, options);
}

double CityPlan::street_metres() const {
  return static_cast<double>(x_.size()) * z_.back() + static_cast<double>(z_.size()) * x_.back();
}

std::optional<std::size_t> CityPlan::neighbour(std::size_t crossing, Heading heading) const {
  const Vector2 direction = direction_of(heading);
  const auto column = static_cast<std::ptrdiff_t>(crossing % x_.size()) + std::lround(direction.x());
  const auto row = static_cast<std::ptrdiff_t>(crossing / x_.size()) + std::lround(direction.y());
  if (column < 0 || row < 0 || column >= std::ssize(x_) || row >= std::ssize(z_)) return std::nullopt;
  return static_cast<std::size_t>(row) * x_.size() + static_cast<std::size_t>(column);
}

std::optional<Piece> CityPlan::piece(PieceId id) const {
  const std::size_t from = id / 4;
  const auto to = from < crossings() ? neighbour(from, heading_of(id)) : std::nullopt;
  if (!to) return std::nullopt;
  const Vector2 direction = direction_of(heading_of(id));
  return Piece{id, centre(from) + kHalfStreet * direction, direction,
               (centre(*to) - centre(from)).norm() - 2 * kHalfStreet};
}

std::optional<Piece> CityPlan::next(PieceId id, int turn) const {
  const auto crossing = neighbour(id / 4, heading_of(id));
  if (!crossing) return std::nullopt;
  return piece(static_cast<PieceId>(4 * *crossing) + static_cast<PieceId>(turned(heading_of(id), turn)));
}

CityDrive::CityDrive(const CityPlan& plan, const CityDriveOptions& options) : plan_(plan), options_(options) {
  Random random(options.seed, 1);
  const double all = options.step * options.frames;
  while (stages_.empty() || stages_.back().first_frame + stages_.back().frames < options.frames) {
    PieceId start = 0;
    do start = static_cast<PieceId>(random.below(static_cast<int>(4 * plan.crossings())));
    while (!plan.piece(start));
    // Trains leave every few kilometres, so that rides of several robots do not come at the same time.
    add_stage(random, start, options.ride_every > 0 ? options.ride_every * random.uniform(0.7, 1.3) : all);
  }
}

void CityDrive::add_stage(Random& random, PieceId start, double metres) {
  Stage stage;
  if (!stages_.empty()) stage.first_frame = stages_.back().first_frame + stages_.back().frames + options_.ride_frames;
  double length = 0;
  const auto add = [&](Segment segment) {
    segment.begin = length;
    length += segment.length;
    stage.segments.push_back(segment);
  };
  Piece piece = *plan_.piece(start);
  double lane = kLane[random.below(2)];
  while (length < metres) {
    add({0, piece.length, piece.id, piece.at(0, lane), piece.direction, piece.at(piece.length, lane), piece.direction,
         false});
    std::optional<Piece> next;
    while (!next) next = plan_.next(piece.id, random.chance(kStraightOn) ? 0 : random.chance(0.5) ? 1 : -1);
    const double next_lane = random.chance(kToOtherLane) ? kLane[0] + kLane[1] - lane : lane;
    const Vector2 from = piece.at(piece.length, lane), to = next->at(0, next_lane);
    add({0, Curve(from, piece.direction, to, next->direction).measure(0).length, piece.id, from, piece.direction, to,
         next->direction, true});
    piece = *next;
    lane = next_lane;
  }
  // A robot enters a cabin straight ahead.
  add({0, 2 * kIntoCabin, piece.id, piece.at(0, lane), piece.direction, piece.at(2 * kIntoCabin, lane), piece.direction,
       false});
  stage.frames = static_cast<std::uint32_t>(length / options_.step);
  stages_.push_back(std::move(stage));
}

PlanePose CityDrive::on(const Segment& segment, double along) const {
  if (!segment.curved) return pose_of(segment.from + along * segment.from_direction, segment.from_direction);
  const Curve curve(segment.from, segment.from_direction, segment.to, segment.to_direction);
  const double t = curve.measure(along).t;
  return pose_of(curve.at(t), curve.tangent(t));
}

PlanePose CityDrive::on(const Stage& stage, double along, PieceId& piece) const {
  const auto after = std::upper_bound(stage.segments.begin(), stage.segments.end(), along,
                                      [](double s, const Segment& segment) { return s < segment.begin; });
  const Segment& segment = *std::prev(after);
  piece = segment.piece;
  return on(segment, along - segment.begin);
}

const CityDrive::Stage& CityDrive::stage_of(std::uint32_t frame) const {
  return *std::prev(std::upper_bound(stages_.begin(), stages_.end(), frame,
                                     [](std::uint32_t f, const Stage& stage) { return f < stage.first_frame; }));
}

CityDrive::Standpoint CityDrive::at(std::uint32_t frame) const {
  const Stage& stage = stage_of(frame);
  const auto number = static_cast<std::uint32_t>(&stage - stages_.data());
  const std::uint32_t in_stage = frame - stage.first_frame;
  Standpoint standpoint;
  const double last = options_.step * (stage.frames - 1);
  const double driven = std::min(options_.step * in_stage, last);
  standpoint.pose = on(stage, driven, standpoint.piece);
  const bool rides_then = options_.ride_every > 0;
  if (rides_then && driven > last - kIntoCabin) {
    standpoint.ride = number + 1;
    standpoint.in_cabin = driven - last;
  } else if (number > 0 && driven < kIntoCabin) {
    standpoint.ride = number;
    standpoint.in_cabin = driven;
  }
  if (in_stage >= stage.frames && number + 1 < stages_.size()) {
    standpoint.running = true;
    PieceId there = 0;
    const PlanePose end = on(stages_[number + 1], 0, there);
    const double share = static_cast<double>(in_stage - stage.frames + 1) / (options_.ride_frames + 1);
    standpoint.pose.x += share * (end.x - standpoint.pose.x);
    standpoint.pose.z += share * (end.z - standpoint.pose.z);
    standpoint.pose.yaw += share * (end.yaw - standpoint.pose.yaw);
  }
  return standpoint;
}

double CityDrive::metres_driven(std::uint32_t frame) const {
  double metres = 0;
  for (const Stage& stage : stages_) {
    if (stage.first_frame > frame) break;
    metres += options_.step * std::min(frame - stage.first_frame, stage.frames - 1);
  }
  return metres;
}

std::uint32_t CityDrive::frames_on_trains(std::uint32_t frame) const {
  const Stage& stage = stage_of(frame);
  const auto rides = static_cast<std::uint32_t>(&stage - stages_.data());
  const std::uint32_t in_stage = frame - stage.first_frame;
  return rides * options_.ride_frames + (in_stage >= stage.frames ? in_stage - stage.frames + 1 : 0);
}

}  // namespace relmap::sim
