#include "server/place/epipolar.h"

#include <Eigen/QR>
#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <utility>

#include "proto/geometry/geometry.h"
#include "server/place/descriptor_match.h"

namespace relmap::place {
namespace {

constexpr double kGatePixels = 2;
constexpr double kConfidence = 0.999;
constexpr double kOnePlane = 0.9;       // share of a fundamental matrix's inliers from which a homography is preferred
constexpr std::size_t kToBegin = 12;    // minimum number of inliers with which features are matched again near by
constexpr double kSearchRadius = 0.04;  // a share of the width over which the query's features lie
constexpr std::size_t kAround = 3;      // nearest inliers that predict the position of a feature
constexpr double kTogether = 5;         // pixels: inliers closer than this have about the same weight

struct Geometry {
  std::vector<DescriptorMatch> inliers;
  bool homography = false;
};

// The matches that `estimate` sets in its mask; none if the configuration is degenerate.
template <typename Estimate>
std::vector<DescriptorMatch> agreeing(const std::vector<DescriptorMatch>& matches, Estimate estimate) {
  std::vector<DescriptorMatch> agree;
  try {
    cv::Mat mask;
    estimate(mask);
    for (int i = 0; i < static_cast<int>(mask.total()); ++i)
      if (mask.at<std::uint8_t>(i)) agree.push_back(matches[static_cast<std::size_t>(i)]);
  } catch (const cv::Exception&) {
    agree.clear();
  }
  return agree;
}

// A pair of views.
class Views {
 public:
  Views(std::span<const AppearanceFeature> query, std::span<const AppearanceFeature> map) : query_(query), map_(map) {
    for (const AppearanceFeature& feature : map) descriptors_.push_back(&feature.descriptor);
  }

  std::vector<DescriptorMatch> match(const ExpectedPoints* expected = nullptr) const {
    return match_descriptors(
        query_, descriptors_, [](std::uint32_t, std::uint32_t) { return false; }, expected);
  }

  Geometry geometry_of(const std::vector<DescriptorMatch>& matches) const {
    std::vector<cv::Point2f> from, to;
    for (const DescriptorMatch& match : matches) {
      from.emplace_back(map_[match.point].u, map_[match.point].v);
      to.emplace_back(query_[match.feature].u, query_[match.feature].v);
    }
    Geometry best{agreeing(matches, [&](cv::Mat& mask) {
      cv::findFundamentalMat(from, to, cv::FM_RANSAC, kGatePixels, kConfidence, 1000, mask);
    })};
    auto plane = agreeing(matches, [&](cv::Mat& mask) {
      cv::findHomography(from, to, cv::RANSAC, kGatePixels, mask, 1000, kConfidence);
    });
    const bool enough = plane.size() >= std::min<std::size_t>(best.inliers.size(), kMinEpipolarInliers);
    if (enough && static_cast<double>(plane.size()) >= kOnePlane * static_cast<double>(best.inliers.size()))
      best = {std::move(plane), true};
    return best;
  }

  // Matches within kSearchRadius of the position that the nearest inliers predict for a feature of the map.
  std::vector<DescriptorMatch> match_near(const std::vector<DescriptorMatch>& inliers) const {
    const auto [left_most, right_most] =
        std::minmax_element(query_.begin(), query_.end(), [](const auto& l, const auto& r) { return l.u < r.u; });
    const auto from = [&](const DescriptorMatch& match) { return at(map_[match.point]); };
    Eigen::MatrixXd A(inliers.size(), 3), B(inliers.size(), 2);  // a rough affine map, and below its residuals
    for (std::size_t i = 0; i < inliers.size(); ++i) {
      A.row(static_cast<Eigen::Index>(i)) = from(inliers[i]).homogeneous().transpose();
      B.row(static_cast<Eigen::Index>(i)) = at(query_[inliers[i].feature]).transpose();
    }
    const Eigen::MatrixXd affine = A.colPivHouseholderQr().solve(B), left = B - A * affine;
    ExpectedPoints expected{{}, kSearchRadius * (right_most->u - left_most->u)};
    std::vector<std::pair<double, Eigen::Index>> nearest(inliers.size());
    const std::size_t around = std::min<std::size_t>(kAround, inliers.size());
    for (const AppearanceFeature& feature : map_) {
      for (std::size_t i = 0; i < inliers.size(); ++i)
        nearest[i] = {(from(inliers[i]) - at(feature)).squaredNorm(), static_cast<Eigen::Index>(i)};
      std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(around), nearest.end());
      Vector2 mean = Vector2::Zero();
      double weights = 0;
      for (std::size_t i = 0; i < around; ++i) {
        const double weight = 1 / (nearest[i].first + kTogether * kTogether);
        mean += weight * left.row(nearest[i].second).transpose();
        weights += weight;
      }
      expected.at.push_back((at(feature).homogeneous().transpose() * affine).transpose() + mean / weights);
    }
    return match(&expected);
  }

 private:
  static Vector2 at(const AppearanceFeature& feature) { return {feature.u, feature.v}; }

  std::span<const AppearanceFeature> query_, map_;
  std::vector<const Descriptor*> descriptors_;
};

// What looks alike by descriptors alone, and what agrees with the geometry.
std::vector<FeaturePair> all_pairs(const std::vector<DescriptorMatch>& alike,
                                   const std::vector<DescriptorMatch>& inliers) {
  std::vector<FeaturePair> pairs;
  for (const DescriptorMatch& match : inliers) pairs.push_back({match.feature, match.point, true});
  for (const DescriptorMatch& match : alike)
    if (std::none_of(inliers.begin(), inliers.end(), [&](const auto& in) { return in.feature == match.feature; }))
      pairs.push_back({match.feature, match.point, false});
  return pairs;
}

}  // namespace

Result<EpipolarMatch> match_views(std::span<const AppearanceFeature> query, std::span<const AppearanceFeature> map,
                                  int min_inliers, std::vector<FeaturePair>* pairs) {
  const Views views(query, map);
  const auto matches = views.match();
  if (pairs) *pairs = all_pairs(matches, {});
  if (matches.size() < kToBegin)
    return Status(Reason::TOO_FEW_INLIERS, std::to_string(matches.size()) + " matches, of which at least " +
                                               std::to_string(min_inliers) + " must agree on one geometry");
  Geometry best = views.geometry_of(matches);
  if (best.inliers.size() >= kToBegin)
    if (auto near = views.geometry_of(views.match_near(best.inliers)); near.inliers.size() > best.inliers.size())
      best = std::move(near);
  if (pairs) *pairs = all_pairs(matches, best.inliers);
  if (best.inliers.size() < static_cast<std::size_t>(min_inliers))
    return Status(Reason::TOO_FEW_INLIERS,
                  std::to_string(best.inliers.size()) + " of " + std::to_string(matches.size()) +
                      " matches agree on one geometry; at least " + std::to_string(min_inliers) + " must");
  EpipolarMatch result{{}, best.homography};
  for (const DescriptorMatch& match : best.inliers) result.inliers.push_back(match.feature);
  return result;
}

}  // namespace relmap::place
