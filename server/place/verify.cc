#include "server/place/verify.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include "frontend/vision/camera_check.h"
#include "frontend/vision/tolerant_motion.h"
#include "frontend/vision/unknown_lens.h"
#include "proto/base/number_text.h"
#include "server/place/binding_proposal.h"
#include "server/place/descriptor_match.h"
#include "server/place/epipolar.h"
#include "server/place/map_points.h"
#include "server/place/place_neighbours.h"

namespace relmap::place {
namespace {

constexpr double kOutOfSight = -1e9;
// kMinToGrow inliers of matching by descriptors alone are enough if kGrown inliers are found when features are matched
// again near where the pose predicts them; otherwise kMinInliers are needed.
constexpr int kMinToGrow = 15;
constexpr std::size_t kGrown = 2 * kMinToGrow;
// Fewer matches with the candidate alone, without the frames around it: it is no place. (At places that geometry
// confirmed there were 9 and more, at four of five others fewer.)
constexpr std::size_t kMinAlike = 8;
// Poses that RANSAC tries: of a candidate that shows the place, about half of the matches with the centre and by words
// agree.
constexpr int kTrials = 1000, kQuickTrials = 200;
// An unknown lens adapts to chance matches: 26 to 37 inliers agreed on poses up to a metre off.
constexpr int kMinOfUnknownLens = 2 * kMinInliers;
constexpr int kMinOfAView = 16;  // inliers in a frame of a mono session; fewer agree by chance

// The share (0..1) of the picture's 16 x 12 cells that hold at least one of the features whose indices are in `chosen`.
double picture_spread(std::span<const AppearanceFeature> features, std::span<const std::uint32_t> chosen,
                      const StereoCamera& camera) {
  constexpr int kColumns = 16, kRows = 12;
  std::bitset<kColumns * kRows> covered;
  for (const std::uint32_t i : chosen) {
    const double u = (double{features[i].u} + 0.5) / camera.width, v = (double{features[i].v} + 0.5) / camera.height;
    const int column = std::clamp(static_cast<int>(u * kColumns), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(v * kRows), 0, kRows - 1);
    covered.set(static_cast<std::size_t>(row * kColumns + column));
  }
  return static_cast<double>(covered.count()) / (kColumns * kRows);
}

Status poor_spread(const VerifiedPlace& place) {
  return {Reason::POOR_SPREAD,
          std::to_string(place.inliers) + " inliers cover " + number_text(100 * place.spread) + " % of the picture"};
}

// POOR_SPREAD if the inliers do not determine the rotation: a few inliers close together agree with very different
// poses, and what agrees with any pose is no recognition. The message has no figure if the uncertainty is above half a
// turn, since the angle is then unknown.
Status check_rotation(const VerifiedPlace& place) {
  const double sigma = std::sqrt(place.covariance.bottomRightCorner<3, 3>().trace());
  if (sigma <= kMaxRotationSigma) return {};
  const std::string known = sigma > std::numbers::pi
                                ? " inliers do not tell the rotation"
                                : " inliers tell the rotation to " + number_text(sigma) + " rad only";
  return {Reason::POOR_SPREAD,
          std::to_string(place.inliers) + known + "; it must be known to " + number_text(kMaxRotationSigma) + " rad"};
}

// The contribution of the frames' transforms to the covariance of the pose. The points of one frame share the error of
// its transform to the centre. A pose that is a mean over frames with weights w has at most the covariance sum w S.
Matrix6 covariance_of_way(const MapPoints& map, const std::vector<std::uint32_t>& placed, const SE3& T_match_query) {
  const double inliers = std::accumulate(placed.begin(), placed.end(), 0.0);
  std::vector<double> weight;
  for (const std::uint32_t count : placed) weight.push_back(count / inliers);
  Matrix6 sum = Matrix6::Zero();
  for (std::size_t i = 0; i < weight.size(); ++i) {
    if (weight[i] == 0) continue;
    // T_match_n Exp(xi) T_n_query = T_match_query Exp(Ad(T_query_n) xi)
    const Matrix6 ad = (T_match_query.inverse() * map.frames[i].T_centre_frame).adjoint();
    sum += weight[i] * ad * map.frames[i].covariance * ad.transpose();
  }
  return sum;
}

// The match of the query with one frame of a mono session.
struct FittingView {
  FrameId frame;
  EpipolarMatch match;
  std::vector<PointMatch> matches = {};  // if they are kept
};

std::vector<PointMatch> matches_of(const std::vector<FeaturePair>& pairs,
                                   const std::vector<AppearanceFeature>& features) {
  std::vector<PointMatch> matches;
  for (const FeaturePair& pair : pairs)
    matches.push_back({pair.query, {features[pair.map].u, features[pair.map].v}, {}, pair.inlier, std::nullopt});
  sort_matches(matches);
  return matches;
}

// `matches`, if given, receives what looks alike, also if it does not fit.
std::optional<FittingView> fitting_view(const storage::Graph& graph, const QueryPicture& query, FrameId frame,
                                        std::vector<PointMatch>* matches) {
  const auto cold = graph.cold(frame);
  if (!cold || storage::within(frame, query.masked)) return std::nullopt;
  std::vector<FeaturePair> pairs;
  auto match = match_views(query.features, cold->appearance, kMinOfAView, matches ? &pairs : nullptr);
  if (matches) *matches = matches_of(pairs, cold->appearance);
  if (!match.ok()) return std::nullopt;
  return FittingView{frame, std::move(match).value()};
}

// Also tries the frames beside the candidate, which show the same place, perhaps from nearer to the query's viewpoint.
PlaceTrial try_epipolar(const storage::Graph& graph, const QueryPicture& query, FrameId candidate) {
  std::vector<FittingView> views;
  std::vector<PointMatch> with_candidate;
  const auto add = [&](std::optional<FrameId> frame) {
    if (!frame || std::any_of(views.begin(), views.end(), [&](const FittingView& v) { return v.frame == *frame; }))
      return;
    std::vector<PointMatch> matches;
    auto view = fitting_view(graph, query, *frame, query.keep_matches ? &matches : nullptr);
    if (*frame == candidate) with_candidate = matches;
    if (!view) return;
    view->matches = std::move(matches);
    views.push_back(std::move(*view));
  };
  const auto best = [&] {
    return std::max_element(views.begin(), views.end(), [](const FittingView& l, const FittingView& r) {
      return l.match.inliers.size() < r.match.inliers.size();
    });
  };
  add(candidate);
  for (FrameId centre = candidate;;) {
    add(previous_of(graph, centre));
    add(next_of(graph, centre));
    if (views.empty() || best()->frame == centre || centre != candidate) break;
    centre = best()->frame;
  }
  if (views.empty())
    return {candidate,
            {},
            Status(Reason::TOO_FEW_INLIERS, "fewer than " + std::to_string(kMinOfAView) +
                                                " matches agree on one geometry with that frame or one beside it"),
            std::move(with_candidate)};
  const auto& [frame, match, matches] = *best();
  VerifiedPlace place;
  place.match = frame;
  place.covariance = Matrix6::Identity() * 1e6;
  place.verification = storage::Verification::kEpipolar;
  place.homography = match.homography;
  for (const FittingView& view : views) {
    std::vector<std::uint32_t> all;
    std::set_union(place.features.begin(), place.features.end(), view.match.inliers.begin(), view.match.inliers.end(),
                   std::back_inserter(all));
    place.features = std::move(all);
  }
  place.inliers = static_cast<std::uint32_t>(place.features.size());
  place.spread = picture_spread(query.features, place.features, query.camera);
  place.focal_length = query.camera.f;
  std::vector<std::uint32_t> features = place.features;
  if (place.inliers < static_cast<std::uint32_t>(kMinEpipolarInliers))
    return {frame, std::move(features),
            Status(Reason::TOO_FEW_INLIERS, std::to_string(place.inliers) +
                                                " features agree with that frame and those beside it; at least " +
                                                std::to_string(kMinEpipolarInliers) + " must"),
            std::move(with_candidate)};
  if (place.spread < kMinSpread) return {frame, std::move(features), poor_spread(place), std::move(with_candidate)};
  return {frame, std::move(features), std::move(place), matches};
}

// How many inliers come from each frame of `map`.
std::vector<std::uint32_t> placed_by_frame(const MapPoints& map, std::span<const DescriptorMatch> inliers) {
  std::vector<std::uint32_t> placed(map.frames.size());
  for (const DescriptorMatch& match : inliers) ++placed[map.points[match.point].placed];
  return placed;
}

std::vector<vision::Correspondence> correspond(const QueryPicture& query, const MapPoints& map,
                                               std::span<const DescriptorMatch> matches) {
  std::vector<vision::Correspondence> correspondences;
  for (const DescriptorMatch& match : matches) {
    const AppearanceFeature& feature = query.features[match.feature];
    const MapPoint& point = map.points[match.point];
    correspondences.push_back({point.point, pixel_of(feature, query.camera), pixel_sigma(level_of_scale(feature.scale)),
                               point.covariance, map.frames[point.placed].T_centre_frame.t});
  }
  return correspondences;
}

// Matches each feature with points that the pose projects near it: in so small a part of the picture few features look
// alike. One of them is always the likest, so what is another point of the candidate's picture is dropped: it would
// confirm the pose whether that is right or not. (A part that is as large as pose and point are uncertain was tried:
// docs/decisions/localisation.md.)
std::vector<DescriptorMatch> match_near(const QueryPicture& query, const MapPoints& map, const SE3& T_match_query) {
  const SE3 T_query_match = T_match_query.inverse();
  ExpectedPoints expected{{}, kNearRadius * query.camera.width};
  for (const MapPoint& point : map.points) {
    const Vector3 p = T_query_match * point.point;
    expected.at.push_back(p.z() > 0 ? query.camera.project(p).head<2>() : Vector2(Vector2::Constant(kOutOfSight)));
  }
  std::vector<DescriptorMatch> matches = match_points(query.features, map.points, &expected);
  drop_outdone(query.features, map.points, points_of_centre(map), matches);
  return matches;
}

// Estimates the pose of the query, and its lens if that is not known.
Result<vision::MotionAndLens> estimate_pose(const std::vector<vision::Correspondence>& correspondences,
                                            const StereoCamera& camera, const vision::MotionOptions& options) {
  if (camera.f == 0) return vision::estimate_motion_and_lens(correspondences, camera, options);
  auto motion = vision::estimate_motion(correspondences, camera, options);
  if (!motion.ok()) return motion.status();
  return vision::MotionAndLens{std::move(*motion), {camera.f, camera.cx, camera.cy}, 0};
}

// Keeps the matches of one verification, if they are wanted.
class Record {
 public:
  explicit Record(const QueryPicture& query) : query_(query) {}

  // What looks alike, before a pose is known.
  void add_alike(const StereoCamera& camera, const MapPoints& map, std::span<const DescriptorMatch> alike) {
    if (!query_.keep_matches) return;
    kept_.clear();
    for (const DescriptorMatch& match : alike) add(camera, map, match, false);
  }
  // What was matched where a pose was found, and which of it (indices, ascending) agrees with the pose; what looked
  // alike before remains as what does not.
  void add_fit(const StereoCamera& camera, const MapPoints& map, std::span<const DescriptorMatch> matches,
               std::span<const std::uint32_t> inliers) {
    if (!query_.keep_matches) return;
    const std::vector<Kept> alike = std::exchange(kept_, {});
    for (std::uint32_t i = 0; i < matches.size(); ++i)
      add(camera, map, matches[i], std::binary_search(inliers.begin(), inliers.end(), i));
    add_new(alike);
  }
  // What does not agree by an earlier verification, whose frame is placed at T_frame_earlier in this one's `frame`.
  void add_outliers(const Record& earlier, const StereoCamera& camera, FrameId frame, const SE3& T_frame_earlier) {
    std::vector<Kept> outliers;
    for (Kept kept : earlier.kept_)
      if (!kept.match.inlier && place_in(camera, frame, T_frame_earlier * *kept.match.point, kept))
        outliers.push_back(std::move(kept));
    add_new(outliers);
  }
  // `found`, if given, is the pose of the query in the frame, with the camera that took it.
  std::vector<PointMatch> take(const SE3* T_frame_query = nullptr, double focal_length = 0) const {
    std::vector<PointMatch> matches;
    for (const Kept& kept : kept_) matches.push_back(kept.match);
    StereoCamera camera = query_.camera;
    if (camera.f == 0) camera.f = focal_length;
    if (T_frame_query && camera.f > 0) set_residuals(query_.features, camera, *T_frame_query, matches);
    sort_matches(matches);
    return matches;
  }

 private:
  struct Kept {
    PointMatch match;
    FrameId measured_in;
    Vector2 measured;  // there, pixels
  };

  // Sets where the point lies in the frame; false if the frame cannot see it.
  static bool place_in(const StereoCamera& camera, FrameId frame, const Vector3& point, Kept& kept) {
    kept.match.point = point;
    kept.match.seen_in = kept.measured_in == frame ? FrameId() : kept.measured_in;
    kept.match.pixel = kept.measured;
    if (kept.measured_in == frame) return true;
    if (!(point.z() > 0)) return false;
    kept.match.pixel = camera.project(point).head<2>();
    return true;
  }
  void add(const StereoCamera& camera, const MapPoints& map, const DescriptorMatch& match, bool inlier) {
    const MapPoint& point = map.points[match.point];
    Kept kept{{match.feature, {}, {}, inlier, {}}, map.frames[point.placed].frame, {point.u, point.v}};
    if (place_in(camera, map.frames.front().frame, point.point, kept)) kept_.push_back(std::move(kept));
  }
  // Adds what is of features that are not kept yet.
  void add_new(const std::vector<Kept>& more) {
    std::vector<bool> known(query_.features.size());
    for (const Kept& kept : kept_) known[kept.match.feature] = true;
    for (const Kept& kept : more)
      if (!known[kept.match.feature]) kept_.push_back(kept);
  }

  const QueryPicture& query_;
  std::vector<Kept> kept_;
};

// A pose of the query among the points around a candidate.
struct Fit {
  vision::MotionAndLens pose;
  std::vector<DescriptorMatch> matches;  // among which the pose was found
  // `matches`, and those by descriptors alone.
  std::vector<vision::Correspondence> matched, alike;
};

// Matches features again near where `T_match_query` predicts them. With the right pose that gains inliers; with a
// chance pose it does not.
Result<Fit> fit_near(const QueryPicture& query, const MapPoints& map, const SE3& T_match_query,
                     vision::MotionOptions options) {
  options.correct_points = true;
  options.enough = 1;  // a large share of inliers is no evidence here, since the pose selected the matches
  Fit found;
  found.matches = match_near(query, map, T_match_query);
  found.matched = correspond(query, map, found.matches);
  auto motion = vision::estimate_motion(found.matched, query.camera, options, &T_match_query);
  if (!motion.ok()) return motion.status();
  found.pose.motion = *std::move(motion);
  found.pose.lens = {query.camera.f, query.camera.cx, query.camera.cy};
  return found;
}

// Estimates the pose from `alike`, matches by descriptors alone. With fewer than `sure_inliers`, kGrown must be found
// when features are matched again near where the pose predicts them.
Result<Fit> fit(const QueryPicture& query, const MapPoints& map, std::vector<DescriptorMatch> alike,
                std::size_t sure_inliers, int max_trials, std::uint64_t seed) {
  std::vector<vision::Correspondence> correspondences = correspond(query, map, alike);
  vision::MotionOptions options;
  options.seed = seed;
  options.max_trials = max_trials;
  options.correct_points = true;
  options.min_inliers = query.camera.f > 0 ? kMinToGrow : kMinOfUnknownLens;
  auto pose = estimate_pose(correspondences, query.camera, options);
  if (!pose.ok()) return pose.status();
  Fit found{*std::move(pose), std::move(alike), correspondences, correspondences};
  if (query.camera.f == 0) return found;
  const std::size_t inliers = found.pose.motion.inliers.size();
  if (auto again = fit_near(query, map, found.pose.motion.T_reference_camera, options);
      again.ok() && again->pose.motion.inliers.size() > inliers) {
    again->alike = std::move(found.alike);
    found = *std::move(again);
  }
  if (inliers < sure_inliers && found.pose.motion.inliers.size() < kGrown)
    return Status(Reason::TOO_FEW_INLIERS,
                  std::to_string(found.pose.motion.inliers.size()) +
                      " matches near the positions that a few inliers predict agree; at least " +
                      std::to_string(kGrown) + " must");
  return found;
}

// Finds the pose among the points around the candidate, and gathers these into `map`. If the words of the features are
// known, most candidates that do not show the place are told by the centre alone, and most that do by the centre and
// the words; only the rest needs all pairs of features and points.
Result<Fit> fit_around(const storage::Graph& graph, const QueryPicture& query, FrameId candidate, std::uint64_t seed,
                       MapPoints& map, Record& record) {
  const StereoCamera camera = graph.session(candidate.session)->header.camera;
  map = gather_centre(graph, candidate, kViewReach);
  std::vector<DescriptorMatch> at_centre;
  if (!query.words.empty()) {
    at_centre = match_points(query.features, map.points);
    record.add_alike(camera, map, at_centre);
    if (at_centre.size() < kMinAlike)
      return Status(Reason::TOO_FEW_INLIERS, std::to_string(at_centre.size()) + " features look like that frame's");
  }
  gather_rest(graph, map);
  if (map.points.size() < static_cast<std::size_t>(kMinInliers))
    return Status(Reason::TOO_FEW_FEATURES, std::to_string(map.points.size()) + " points in the map");
  if (!query.words.empty()) {
    std::vector<DescriptorMatch> alike = match_points_by_word(query.features, query.words, map.points);
    alike.insert(alike.end(), at_centre.begin(), at_centre.end());
    alike = nearest_of_all(std::move(alike), map.points);
    record.add_alike(camera, map, alike);
    auto found = fit(query, map, std::move(alike), kGrown, kQuickTrials, seed);
    if (found.ok() || at_centre.size() < static_cast<std::size_t>(kMinToGrow)) return found;
  }
  std::vector<DescriptorMatch> alike = match_points(query.features, map.points);
  record.add_alike(camera, map, alike);
  return fit(query, map, std::move(alike), kMinInliers, kTrials, seed);
}

struct StereoPlace {
  VerifiedPlace place;
  FrameId main_frame;             // the frame from which most of the inliers come
  SE3 T_main_query;               // as that frame's transform to place.match predicts it
  Matrix6 way = Matrix6::Zero();  // the part of place.covariance that comes from the transforms between the frames
  // Matches by descriptors alone; the matches among which the pose was found; and the inliers.
  std::vector<vision::Correspondence> alike, matched, agree;
};

// What a pose that was found among the points around the candidate tells. POOR_SPREAD.
Result<StereoPlace> judge(const StereoCamera& map_camera, const QueryPicture& query, FrameId candidate,
                          const MapPoints& map, Fit found, Record& record) {
  const vision::Motion& motion = found.pose.motion;
  record.add_fit(map_camera, map, found.matches, motion.inliers);

  VerifiedPlace place;
  place.match = candidate;
  place.focal_length = found.pose.lens.f;
  place.T_match_query = motion.T_reference_camera;
  place.inliers = static_cast<std::uint32_t>(motion.inliers.size());
  std::vector<DescriptorMatch> inliers;
  std::vector<vision::Correspondence> agree;
  std::size_t with_disparity = 0;
  for (const std::uint32_t i : motion.inliers) {
    inliers.push_back(found.matches[i]);
    agree.push_back(found.matched[i]);
    place.features.push_back(found.matches[i].feature);
    with_disparity += !is_mono(found.matched[i].pixel);
  }
  std::sort(place.features.begin(), place.features.end());
  place.spread = picture_spread(query.features, place.features, query.camera);
  if (place.spread < kMinSpread) return poor_spread(place);
  const std::vector<std::uint32_t> placed = placed_by_frame(map, inliers);
  const Matrix6 way = covariance_of_way(map, placed, place.T_match_query);
  place.covariance = motion.covariance + way;
  if (Status status = check_rotation(place); !status.ok()) return status;
  place.verification = with_disparity > 0 ? storage::Verification::kStereo : storage::Verification::kPnP;
  for (const DescriptorMatch& match : inliers)
    if (const LandmarkId landmark = map.points[match.point].landmark; landmark.valid())
      place.bindings.push_back(binding_to(landmark, query.features[match.feature], query.camera));
  const auto main = static_cast<std::size_t>(std::max_element(placed.begin(), placed.end()) - placed.begin());
  const SE3 T_main_query = map.frames[main].T_centre_frame.inverse() * place.T_match_query;
  return StereoPlace{std::move(place),       map.frames[main].frame,   T_main_query,    way,
                     std::move(found.alike), std::move(found.matched), std::move(agree)};
}

Result<StereoPlace> verify_stereo(const storage::Graph& graph, const QueryPicture& query, FrameId candidate,
                                  std::uint64_t seed, Record& record) {
  MapPoints map;
  auto found = fit_around(graph, query, candidate, seed, map, record);
  if (!found.ok()) return found.status();
  return judge(graph.session(candidate.session)->header.camera, query, candidate, map, *std::move(found), record);
}

// The same in the frame that saw most of the inliers. Where the query stands in it is known already, so features are
// matched only near where that predicts them.
Result<StereoPlace> verify_in_main_frame(const storage::Graph& graph, const QueryPicture& query,
                                         const StereoPlace& found, std::uint64_t seed, Record& record) {
  const MapPoints map = gather_points(graph, found.main_frame, kViewReach);
  vision::MotionOptions options;
  options.seed = seed;
  options.max_trials = kQuickTrials;
  options.min_inliers = kMinInliers;  // that it is the place is known
  auto again = fit_near(query, map, found.T_main_query, options);
  if (!again.ok()) return again.status();
  return judge(graph.session(found.main_frame.session)->header.camera, query, found.main_frame, map, *std::move(again),
               record);
}

// NOT_STEREO if the right picture does not show what it should of the points in the left one. In good pairs it showed
// 75 % and more of them, in pictures of different times or with exchanged eyes seldom 50 %.
Status check_pair(std::span<const vision::Correspondence> agree, const StereoCamera& camera, const SE3& T_match_query) {
  constexpr double kMinDisparity = 4;  // pixels; farther points may lack a disparity in good pairs, too
  constexpr std::size_t kMinExpected = 15;
  constexpr double kMinSeen = 0.3;
  const SE3 T_query_match = T_match_query.inverse();
  std::size_t expected = 0, seen = 0;
  for (const vision::Correspondence& c : agree) {
    const StereoPixel pixel = camera.project(T_query_match * c.point);
    if (!(pixel.x() - pixel.z() > kMinDisparity) || !camera.in_picture(pixel.z(), pixel.y())) continue;
    ++expected;
    seen += !is_mono(c.pixel);
  }
  if (expected < kMinExpected || static_cast<double>(seen) >= kMinSeen * static_cast<double>(expected)) return {};
  return {Reason::NOT_STEREO, "of " + std::to_string(expected) +
                                  " points that both eyes should see the right picture shows " + std::to_string(seen) +
                                  ": it is not of this pair, or the eyes are exchanged, or the calibration is of other "
                                  "cameras; ask with the left picture alone"};
}

// Checks whether a picture whose place was found was taken by the query's camera.
Status check_place(const StereoPlace& found, const QueryPicture& query, const StereoCamera& map_camera) {
  if (query.camera.f == 0) return {};
  if (query.pair)
    if (Status status = check_pair(found.agree, query.camera, found.place.T_match_query); !status.ok()) return status;
  const Status status = vision::check_camera(found.alike, query.camera, found.place.T_match_query, map_camera);
  if (status.ok()) return status;
  return {status.reason(), "what is seen at " + found.place.match.to_string() +
                               " contradicts the calibration of the camera, or that of session " +
                               std::to_string(found.place.match.session) + ": it fits " + status.message()};
}

// Whether two lenses are the same apart from the rounding of numbers in a file or of a reduced picture size.
bool is_same_lens(const StereoCamera& a, const StereoCamera& b) {
  constexpr double kSame = 1e-3;
  return std::abs(a.f / a.width - b.f / b.width) < kSame * b.f / b.width &&
         std::abs(a.cx / a.width - b.cx / b.width) < kSame && std::abs(a.cy / a.width - b.cy / b.width) < kSame;
}

// Estimates the pose and its covariance again, allowing for the usual errors of calibrations. The inliers stay those
// of the camera as it was named.
Status allow_for_calibration(const QueryPicture& query, const StereoCamera& map_camera, StereoPlace* found) {
  vision::MotionOptions options;
  options.min_inliers = kMinToGrow;
  // All matches, not the inliers alone, since those were selected with the lens as it was named.
  const auto motion =
      vision::estimate_tolerant_motion(found->matched, query.camera, map_camera, found->place.T_match_query, options);
  if (!motion.ok()) return motion.status();
  found->place.T_match_query = motion->T_reference_camera;
  found->place.covariance = motion->covariance + found->way;
  return check_rotation(found->place);
}

// The picture is turned or not with equal probability, so half of the squared rotation is added to the covariance.
Status allow_for_other_eye(const Vector3& turn, VerifiedPlace& place) {
  place.covariance.bottomRightCorner<3, 3>() += 0.5 * turn * turn.transpose();
  return check_rotation(place);
}

}  // namespace

QueryPicture query_of(const storage::FrameCold& cold, const StereoCamera& camera) {
  QueryPicture query{cold.appearance, camera};
  if (cold.words.size() == cold.appearance.size()) query.words = cold.words;  // else some were lost
  return query;
}

bool may_answer(const storage::Graph& graph, const QueryPicture& query, FrameId frame) {
  if (storage::within(frame, query.masked)) return false;
  const auto hot = graph.hot(frame);
  return hot && storage::taken_in(*hot) <= query.taken_in;
}

bool is_contradicted(const PlaceTrial& trial) {
  const Reason reason = trial.verified.reason();
  return reason == Reason::WRONG_CALIBRATION || reason == Reason::NOT_STEREO;
}

const PlaceTrial* contradiction(std::span<const PlaceTrial> trials) {
  std::size_t max_confirmed = 0;
  const PlaceTrial* contradicted = nullptr;
  for (const PlaceTrial& trial : trials) {
    if (trial.verified.ok()) max_confirmed = std::max(max_confirmed, trial.features.size());
    if (!is_contradicted(trial)) continue;
    if (!contradicted || trial.features.size() > contradicted->features.size()) contradicted = &trial;
  }
  return contradicted && max_confirmed < kSureInliers && contradicted->features.size() > max_confirmed ? contradicted
                                                                                                       : nullptr;
}

PlaceTrial try_place(const storage::Graph& graph, const QueryPicture& query, FrameId candidate, std::uint64_t seed) {
  const auto session = graph.session(candidate.session);
  if (!session || !graph.hot(candidate)) return {candidate, {}, Status(Reason::NO_SUCH_FRAME, candidate.to_string())};
  if (query.features.size() < static_cast<std::size_t>(kMinInliers))
    return {candidate, {}, Status(Reason::TOO_FEW_FEATURES, std::to_string(query.features.size()) + " features")};
  if (!session->header.camera.is_stereo()) return try_epipolar(graph, query, candidate);

  Record record(query);
  auto found = verify_stereo(graph, query, candidate, seed, record);
  if (!found.ok()) return {candidate, {}, found.status(), record.take()};
  const bool is_other = query.known == CameraKnown::kSupposed ||
                        (query.known == CameraKnown::kNamed && !is_same_lens(query.camera, session->header.camera));
  // What tells a lens that is not the one that was named is far from where that lens predicts it, and no lens is known
  // at first of an unknown camera. So only the place of the map's own cameras is verified near the prediction, and they
  // are checked by what was matched before.
  const bool is_own = query.camera.f > 0 && !is_other;
  Status camera = is_own ? check_place(*found, query, session->header.camera) : Status();
  // For what is kept of a refusal.
  struct Pose {
    SE3 T_match_query;
    double focal_length;
  };
  const Pose first{found->place.T_match_query, found->place.focal_length};
  Record record_nearer(query);
  bool is_nearer = false;
  // The pose is expressed in the frame that saw most of the inliers, since the transform between the two frames may be
  // uncertain or wrong.
  if (camera.ok() && found->main_frame != candidate && may_answer(graph, query, found->main_frame))
    if (auto nearer = is_own ? verify_in_main_frame(graph, query, *found, seed, record_nearer)
                             : verify_stereo(graph, query, found->main_frame, seed, record_nearer);
        nearer.ok()) {
      record_nearer.add_outliers(record, session->header.camera, nearer->place.match,
                                 found->T_main_query * first.T_match_query.inverse());
      found = std::move(nearer);
      is_nearer = true;
    }
  const auto refused = [&](Status status) -> PlaceTrial {
    return {found->place.match, std::move(found->place.features), std::move(status),
            record.take(&first.T_match_query, first.focal_length)};
  };
  if (!is_own) camera = check_place(*found, query, session->header.camera);
  if (!camera.ok()) return refused(std::move(camera));
  if (is_other && query.camera.f > 0)
    if (Status status = allow_for_calibration(query, session->header.camera, &*found); !status.ok())
      return refused(std::move(status));
  if (!query.eye_turn.isZero())
    if (Status status = allow_for_other_eye(query.eye_turn, found->place); !status.ok())
      return refused(std::move(status));
  std::vector<PointMatch> matches =
      (is_nearer ? record_nearer : record).take(&found->place.T_match_query, found->place.focal_length);
  return {found->place.match, found->place.features, std::move(found->place), std::move(matches)};
}

Result<VerifiedPlace> verify_place(const storage::Graph& graph, const QueryPicture& query, FrameId candidate,
                                   std::uint64_t seed) {
  return try_place(graph, query, candidate, seed).verified;
}

}  // namespace relmap::place
