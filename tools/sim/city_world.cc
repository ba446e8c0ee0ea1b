#include "tools/sim/city_world.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace relmap::sim {

namespace {

constexpr double kCameraHeight = 1.6;            // metres above the street
constexpr double kHeight = 0.05, kPitch = 0.01;  // amplitudes of the robot's bobbing, metres and radians
constexpr double kMaxAhead = 45;                 // metres along a street, within which points are seen
constexpr double kMinDepth = 0.8, kMinAhead = 0.5;
constexpr double kStretch = 30;                       // metres of a street that were built together
constexpr double kMeanWindow = 2.5, kMaxWindow = 14;  // metres that a point is in sight for, beyond the first
constexpr double kLarge = 0.25;                       // of the points of houses: seen from far
constexpr double kMinLarge = 5, kMaxLarge = 28;       // metres
constexpr double kMinCorner = 8, kMaxCorner = 34;     // metres from which points of a crossing are seen
constexpr double kSameWay = 0.64;        // cosine of the largest angle between a street and who sees its points
constexpr double kThroughTheDoor = 0.4;  // part of what is outside that is seen from a cabin
constexpr std::uint32_t kPass = 1024;    // frames: after these, a robot sees other points of a street
constexpr std::uint32_t kCabinPoints = 260, kCabinTracked = 140;
constexpr std::uint32_t kCornerPoints = 500, kCornerTracked = 260;  // of each corner and each closed side
constexpr std::uint32_t kKeepCells = 64;                            // frames that an unused cell is kept
constexpr std::size_t kMaxDescriptors = 20'000;
constexpr double kBorder = 4;       // pixels
constexpr double kPointSize = 0.3;  // metres: the described region
constexpr double kNoiseLimit = 4;   // sigmas
constexpr std::int64_t kRideFrameUs = 1'000'000;

// The purposes of the streams of random numbers.
enum Purpose : std::uint64_t {
  kGeometry = 100,
  kLook,
  kCopy,
  kCopied,
  kPassing,
  kInFrame,
  kDoor,
  kPixelNoise,
  kStepNoise,
  kDescriptorNoise,
};

// Cells of streets, and points in them: piece (32 bits), metre (10), number (10). Cabins have the highest bit, and
// crossings the one below.
std::uint64_t cell_id(PieceId piece, std::uint32_t metre) { return (std::uint64_t{piece} << 20) | (metre << 10); }
constexpr std::uint64_t kCabinBit = std::uint64_t{1} << 63;
std::uint64_t cabin_id(std::uint64_t drive_seed, std::uint32_t ride) {
  return kCabinBit | ((Stream(drive_seed, ride).bits() >> 12) << 10);
}
std::uint64_t crossing_id(std::size_t crossing) { return (std::uint64_t{1} << 62) | (std::uint64_t{crossing} << 12); }
std::uint64_t mixed(std::uint64_t id) { return Stream(id).bits(); }

}  // namespace

CityWorld::CityWorld(CityWorldOptions options) : options_(std::move(options)), plan_(options_.plan) {}

std::vector<CityWorld::Point> CityWorld::street_points(const Piece& piece, std::uint32_t metre) const {
  const auto count = static_cast<std::uint32_t>(options_.tracked_per_metre + options_.described_per_metre);
  std::vector<Point> points;
  points.reserve(count);
  for (std::uint32_t number = 0; number < count; ++number) points.push_back(street_point(piece, metre, number));
  return points;
}

CityWorld::Point CityWorld::street_point(const Piece& piece, std::uint32_t metre, std::uint32_t number) const {
  const std::uint64_t seed = options_.plan.seed;
  PieceId like = piece.id;
  std::uint32_t like_metre = metre;
  const auto stretch = static_cast<std::uint32_t>(metre / kStretch);
  Random copy(seed, kCopy, piece.id, stretch);
  if (copy.chance(options_.look_alike_share)) {
    const auto original = static_cast<PieceId>(copy.below(static_cast<int>(4 * plan_.crossings())));
    const std::uint32_t at = metre % static_cast<std::uint32_t>(kStretch);  // of the original's first stretch
    if (Stream(seed, kCopied, cell_id(piece.id, metre), number).uniform() < options_.copied_share)
      like = original, like_metre = at;
  }
  const std::uint64_t look = cell_id(like, like_metre) | number;
  Stream random(seed, kGeometry, look);
  Point point;
  point.id = cell_id(piece.id, metre) | number;
  point.look = look;
  point.style = mixed(cell_id(like, static_cast<std::uint32_t>(like_metre / kStretch)));
  point.tracked = number < options_.tracked_per_metre;
  const double along = metre + random.uniform();
  const double side = random.uniform() < 0.5 ? -1 : 1;
  const bool house = random.uniform() < 0.7;
  const double aside = side * (house ? kHalfStreet + random.uniform(0, 1.5) : random.uniform(8.5, 11));
  const double up = house ? random.uniform(-0.2, 8) : random.uniform(-0.2, 2.5);  // above the street
  const Vector2 plane = piece.at(along, aside);
  point.at = {plane.x(), kCameraHeight - up, plane.y()};
  // It leaves the picture of a robot between the two lanes at this distance.
  const double lateral = std::abs(aside - (kLane[0] + kLane[1]) / 2);
  const double leaves = lateral * options_.camera.f / (0.5 * options_.camera.width - kBorder);
  const bool large = house && random.uniform() < kLarge;
  point.from = leaves + (large ? random.uniform(kMinLarge, kMaxLarge)
                               : std::min(kMaxWindow, 1 - kMeanWindow * std::log(1 - random.uniform())));
  return point;
}

std::vector<CityWorld::Point> CityWorld::crossing_points(std::size_t crossing) const {
  std::vector<Point> points;
  const Vector2 centre = plan_.centre(crossing);
  for (std::uint32_t side = 0; side < 8; ++side) {
    const bool is_corner = side < 4;
    if (!is_corner && plan_.piece(static_cast<PieceId>(4 * crossing) + side - 4)) continue;
    for (std::uint32_t k = 0; k < kCornerPoints; ++k) {
      const std::uint64_t id = crossing_id(crossing) | (side * kCornerPoints + k);
      Stream random(options_.plan.seed, kGeometry, id);
      Point point;
      point.id = point.look = id;
      point.style = mixed(crossing_id(crossing) | side);
      point.tracked = k < kCornerTracked;
      Vector2 plane(random.uniform(8.5, kHalfStreet), random.uniform(8.5, kHalfStreet));
      if (!is_corner) plane = {kHalfStreet + random.uniform(0, 1.5), random.uniform(-kHalfStreet, kHalfStreet)};
      // Turned by quarters: corners to the north-east, south-east, ..., sides to the north, east, ...
      if (!is_corner) plane = {plane.y(), plane.x()};
      for (std::uint32_t quarter = 0; quarter < side % 4; ++quarter) plane = {plane.y(), -plane.x()};
      const double up = random.uniform(-0.2, 6);
      point.at = {centre.x() + plane.x(), kCameraHeight - up, centre.y() + plane.y()};
      point.from = random.uniform(kMinCorner, kMaxCorner);
      point.facing = static_cast<Heading>(random.bits() % 4);
      points.push_back(point);
    }
  }
  return points;
}

std::vector<CityWorld::Point> CityWorld::cabin_points(std::uint64_t drive_seed, std::uint32_t ride) const {
  const std::uint64_t cabin = cabin_id(drive_seed, ride);
  std::vector<Point> points;
  for (std::uint32_t number = 0; number < kCabinPoints; ++number) {
    Stream random(options_.plan.seed, kGeometry, cabin | number);
    Point point;
    point.id = point.look = cabin | number;
    point.style = mixed(cabin);
    point.tracked = number < kCabinTracked;
    const double side = random.uniform() < 0.5 ? -1 : 1;
    const bool wall = random.uniform() < 0.7;
    point.at = wall ? Vector3(side * 1.3, random.uniform(-1, 1.2), random.uniform(1.5, 5))
                    : Vector3(random.uniform(-1.3, 1.3), random.uniform(-1, 1.2), random.uniform(4.5, 5));
    point.from = kMaxAhead;
    points.push_back(point);
  }
  return points;
}

CityRobot::CityRobot(const CityWorld& world, const CityDriveOptions& drive, SessionHeader session, std::uint32_t first)
    : world_(world),
      drive_(world.plan(), drive),
      session_(std::move(session)),
      noise_seed_(mixed(drive.seed) ^ world.options().plan.seed) {
  // Tracks of `first` began after `from`; odometry is compounded from the start.
  const auto longest = static_cast<std::uint32_t>(2 * kMaxAhead / drive.step) + drive.ride_frames;
  const std::uint32_t from = first > longest ? first - longest : 0;
  for (std::uint32_t i = 1; i < from; ++i) T_odom_frame_ = (T_odom_frame_ * step(i)).normalized();
  next_ = from;
  while (next_ < first) (void)advance();
}

SE3 CityRobot::bobbing(std::uint32_t i) const {
  const double s = drive_.metres_driven(i);
  return SE3{so3_exp({kPitch * std::sin(1.3 * s), 0, 0}), {0, -kHeight * std::sin(0.7 * s), 0}};
}

SE3 CityRobot::T_cabin_frame(std::uint32_t i) const {
  return SE3{Matrix3::Identity(), {0, 0, drive_.at(i).in_cabin}} * bobbing(i);
}

SE3 CityRobot::T_world_frame(std::uint32_t i) const {
  const PlanePose pose = drive_.at(i).pose;
  return SE3{so3_exp({0, pose.yaw, 0}), {pose.x, 0, pose.z}} * bobbing(i);
}

Vector6 CityRobot::noise_of_step(std::uint32_t i) const {
  Stream noise(noise_seed_, kStepNoise, i);
  Vector6 xi;
  for (int k = 0; k < 6; ++k)
    xi[k] = noise.normal() * (k < 3 ? world_.options().step_noise_m : world_.options().step_noise_rad);
  return xi;
}

SE3 CityRobot::step(std::uint32_t i) const {
  const bool on_train = drive_.at(i - 1).running || drive_.at(i).running;
  const SE3 motion =
      on_train ? T_cabin_frame(i - 1).inverse() * T_cabin_frame(i) : T_world_frame(i - 1).inverse() * T_world_frame(i);
  return motion * SE3::exp(noise_of_step(i));
}

bool CityRobot::visible(const Vector3& in_frame) const {
  if (in_frame.z() < kMinDepth) return false;
  const StereoCamera& camera = world_.options().camera;
  const StereoPixel z = camera.project(in_frame);
  return z.z() >= kBorder && z.x() <= camera.width - 1 - kBorder && z.y() >= kBorder &&
         z.y() <= camera.height - 1 - kBorder;
}

bool CityRobot::shown(const CityWorld::Point& point, std::uint32_t i, double part) const {
  const std::uint64_t pass = noise_seed_ + i / kPass;
  return Stream(pass, kPassing, point.id).uniform() < world_.options().seen_in_a_pass &&
         (part == 1 || Stream(pass, kDoor, point.id).uniform() < part);
}

const std::vector<CityWorld::Point>& CityRobot::points(const Piece& piece, std::uint32_t metre) {
  const auto [cell, fresh] = cells_.try_emplace(cell_id(piece.id, metre));
  if (fresh) cell->second.points = world_.street_points(piece, metre);
  cell->second.used = next_;
  return cell->second.points;
}

void CityRobot::look_along(const Piece& piece, const SE3& T_frame_world, std::uint32_t i, double part,
                           std::vector<Seen>& seen) {
  const SE3 T_world_frame = T_frame_world.inverse();
  const Vector2 here(T_world_frame.t.x(), T_world_frame.t.z());
  const Vector2 ahead(T_world_frame.R(0, 2), T_world_frame.R(2, 2));
  if (ahead.dot(piece.direction) < kSameWay) return;
  const double along = (here - piece.begin).dot(piece.direction);
  const double begin = std::max(0.0, along + kMinAhead), end = std::min(piece.length, along + kMaxAhead);
  for (auto metre = static_cast<std::uint32_t>(begin); metre < end; ++metre)
    for (const CityWorld::Point& point : points(piece, metre)) {
      const double distance = (Vector2(point.at.x(), point.at.z()) - here).dot(piece.direction);
      if (distance > point.from || distance < kMinAhead) continue;
      const Vector3 in_frame = T_frame_world * point.at;
      if (visible(in_frame) && shown(point, i, part)) seen.push_back({&point, in_frame});
    }
}

void CityRobot::look_at_crossing(std::size_t crossing, const SE3& T_frame_world, std::uint32_t i, double part,
                                 std::vector<Seen>& seen) {
  const auto [cell, fresh] = cells_.try_emplace(crossing_id(crossing));
  if (fresh) cell->second.points = world_.crossing_points(crossing);
  cell->second.used = i;
  const Vector3 ahead = T_frame_world.R.row(2);
  for (const CityWorld::Point& point : cell->second.points) {
    const Vector2 facing = direction_of(point.facing);
    if (ahead.x() * facing.x() + ahead.z() * facing.y() < kSameWay) continue;
    const Vector3 in_frame = T_frame_world * point.at;
    if (in_frame.z() <= point.from && visible(in_frame) && shown(point, i, part)) seen.push_back({&point, in_frame});
  }
}

void CityRobot::look_around_cabin(std::uint32_t ride, std::uint32_t i, std::vector<Seen>& seen) {
  const auto [cell, fresh] = cells_.try_emplace(cabin_id(drive_.options().seed, ride));
  if (fresh) cell->second.points = world_.cabin_points(drive_.options().seed, ride);
  cell->second.used = i;
  const SE3 T_frame_cabin = T_cabin_frame(i).inverse();
  for (const CityWorld::Point& point : cell->second.points)
    if (const Vector3 in_frame = T_frame_cabin * point.at; visible(in_frame)) seen.push_back({&point, in_frame});
}

std::vector<CityRobot::Seen> CityRobot::look(std::uint32_t i) {
  const CityDrive::Standpoint standpoint = drive_.at(i);
  std::vector<Seen> seen;
  if (standpoint.ride != 0) look_around_cabin(standpoint.ride, i, seen);
  if (standpoint.running) return seen;
  const SE3 T_frame_world = T_world_frame(i).inverse();
  const double part = standpoint.ride != 0 ? kThroughTheDoor : 1;
  look_at_crossing(world_.plan().end_of(standpoint.piece), T_frame_world, i, part, seen);
  look_along(*world_.plan().piece(standpoint.piece), T_frame_world, i, part, seen);
  for (const int turn : {-1, 0, 1})
    if (const auto next = world_.plan().next(standpoint.piece, turn)) look_along(*next, T_frame_world, i, part, seen);
  return seen;
}

void CityRobot::forget_old_points() {
  std::erase_if(cells_, [&](const auto& cell) { return cell.second.used + kKeepCells < next_; });
  // A descriptor is of one pass, and is drawn again when it is needed again.
  if (descriptors_.size() > kMaxDescriptors || next_ % kPass == 0) descriptors_.clear();
}

TrackMeasurement CityRobot::measure(const Seen& seen, std::uint32_t i) const {
  const CityWorldOptions& options = world_.options();
  Stream noise(noise_seed_, kPixelNoise, i, seen.point->id);
  StereoPixel z = options.camera.project(seen.in_frame);
  for (int k = 0; k < 3; ++k) z[k] += options.pixel_noise * std::clamp(noise.normal(), -kNoiseLimit, kNoiseLimit);
  TrackMeasurement m;
  m.u_left = static_cast<float>(z.x());
  m.v = static_cast<float>(z.y());
  // Noise may make the disparity of a far point negative; no matcher would report that.
  m.u_right = z.z() > z.x() - 0.05 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(z.z());
  return m;
}

AppearanceFeature CityRobot::describe(const Seen& seen, const TrackMeasurement& measurement, int track,
                                      std::uint32_t i) {
  const CityWorldOptions& options = world_.options();
  const std::uint64_t pass = noise_seed_ + i / kPass;
  Stream of_pass(pass, kDescriptorNoise, seen.point->id), of_frame(noise_seed_, kDescriptorNoise, i, seen.point->id);
  std::uint64_t look = seen.point->look;
  if (of_pass.uniform() < options.changed_in_a_pass) look = mixed(look ^ pass);
  const bool changed = of_frame.uniform() < options.changed_in_a_frame;
  const auto draw = [&](Stream random) {
    return options.draw ? options.draw(seen.point->style, random) : make_descriptor(random);
  };
  AppearanceFeature feature;
  feature.u = measurement.u_left;
  feature.v = measurement.v;
  feature.disparity = measurement.u_left - measurement.u_right;  // NaN stays NaN
  feature.scale = static_cast<float>(std::clamp(options.camera.f * kPointSize / seen.in_frame.z(), 4.0, 64.0));
  feature.angle = static_cast<float>(Stream(seen.point->look).uniform(-3.14, 3.14));
  feature.track = static_cast<std::int16_t>(track);
  if (changed) {
    feature.descriptor = draw(of_frame);
    return feature;
  }
  const auto [known, fresh] = descriptors_.try_emplace(seen.point->id);
  if (fresh) {
    known->second = draw(Stream(options.plan.seed, kLook, look));
    disturb_descriptor(known->second, options.pass_noise, of_pass);
  }
  feature.descriptor = known->second;
  disturb_descriptor(feature.descriptor, options.frame_noise, of_frame);
  return feature;
}

Keyframe CityRobot::next() { return advance(); }

Keyframe CityRobot::advance() {
  const std::uint32_t i = next_;
  const CityWorldOptions& options = world_.options();
  const CityDrive::Standpoint standpoint = drive_.at(i);
  const auto step_us = static_cast<std::int64_t>(std::llround(1e6 * drive_.options().step / options.speed));
  const std::uint32_t on_trains = drive_.frames_on_trains(i);
  Keyframe keyframe;
  keyframe.session = session_;
  keyframe.sequence = i;
  keyframe.time_us = options.start_us + step_us * (i - on_trains) + kRideFrameUs * on_trains;
  if (i > 0) {
    T_odom_frame_ = (T_odom_frame_ * step(i)).normalized();
    keyframe.source = MotionSource::kVision;
    keyframe.step_covariance.diagonal().head<3>().setConstant(std::pow(options.step_noise_m, 2));
    keyframe.step_covariance.diagonal().tail<3>().setConstant(std::pow(options.step_noise_rad, 2));
    (standpoint.running ? keyframe.standing_us : keyframe.driven_us) = standpoint.running ? kRideFrameUs : step_us;
  }
  keyframe.T_odom_frame = T_odom_frame_;

  // Which points are tracked does not depend on those before, so that generation may begin anywhere: a tracker and a
  // detector take the strongest of what is seen, which are mostly the same in each frame.
  std::vector<Seen> begun, continued, described, seen = look(i);
  std::sort(seen.begin(), seen.end(),
            [](const Seen& l, const Seen& r) { return mixed(l.point->id) < mixed(r.point->id); });
  for (const Seen& one : seen) {
    if (!one.point->tracked)
      described.push_back(one);
    else if (begun.size() + continued.size() < options.tracks)
      (tracks_.contains(one.point->id) ? continued : begun).push_back(one);
  }
  std::unordered_map<std::uint64_t, TrackId> tracks;
  std::vector<Seen> tracked = begun;
  tracked.insert(tracked.end(), continued.begin(), continued.end());
  for (std::size_t k = 0; k < tracked.size(); ++k) {
    const std::uint64_t id = tracked[k].point->id;
    keyframe.tracks.push_back(measure(tracked[k], i));
    keyframe.tracks.back().track = k < begun.size() ? TrackId{i, static_cast<std::uint32_t>(k)} : tracks_.at(id);
    tracks.emplace(id, keyframe.tracks.back().track);
  }
  tracks_ = std::move(tracks);

  for (std::size_t k = 0; k < tracked.size() && keyframe.appearance.size() < options.appearance; ++k)
    keyframe.appearance.push_back(describe(tracked[k], keyframe.tracks[k], static_cast<int>(k), i));
  std::erase_if(described, [&](const Seen& one) {
    return Stream(noise_seed_, kInFrame, i, one.point->id).uniform() >= options.described_in_a_frame;
  });
  for (const Seen& one : described) {
    if (keyframe.appearance.size() >= options.appearance) break;
    keyframe.appearance.push_back(describe(one, measure(one, i), -1, i));
  }
  ++next_;
  forget_old_points();
  return keyframe;
}

}  // namespace relmap::sim
