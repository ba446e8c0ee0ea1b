#include "server/place/epipolar.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <utility>

#include "server/place/descriptor_match.h"

namespace relmap {
namespace {

constexpr double kGatePixels = 2;
constexpr double kConfidence = 0.999;
constexpr double kOnePlane = 0.9;  // share of a fundamental matrix' inliers that a homography explains as well

// The features of the matches that `estimate` sets in its mask; none where the configuration is degenerate.
template <typename Estimate>
std::vector<std::uint32_t> agreeing(const std::vector<DescriptorMatch>& matches, Estimate estimate) {
  std::vector<std::uint32_t> features;
  try {
    cv::Mat mask;
    estimate(mask);
    for (int i = 0; i < static_cast<int>(mask.total()); ++i)
      if (mask.at<std::uint8_t>(i)) features.push_back(matches[static_cast<std::size_t>(i)].feature);
  } catch (const cv::Exception&) {
    features.clear();
  }
  return features;
}

}  // namespace

Result<EpipolarMatch> match_views(std::span<const AppearanceFeature> query, std::span<const AppearanceFeature> map) {
  std::vector<const Descriptor*> descriptors;
  for (const AppearanceFeature& feature : map) descriptors.push_back(&feature.descriptor);
  const auto matches = match_descriptors(query, descriptors, [](std::uint32_t, std::uint32_t) { return false; });
  const auto too_few = [&](std::size_t agree) {
    return Status(Reason::TOO_FEW_INLIERS, std::to_string(agree) + " of " + std::to_string(matches.size()) +
                                               " matches agree on one geometry; at least " +
                                               std::to_string(kMinEpipolarInliers) + " must");
  };
  if (matches.size() < static_cast<std::size_t>(kMinEpipolarInliers))
    return Status(Reason::TOO_FEW_INLIERS, std::to_string(matches.size()) + " matches, of which at least " +
                                               std::to_string(kMinEpipolarInliers) + " must agree on one geometry");

  std::vector<cv::Point2f> from, to;
  for (const DescriptorMatch& match : matches) {
    from.emplace_back(map[match.point].u, map[match.point].v);
    to.emplace_back(query[match.feature].u, query[match.feature].v);
  }
  EpipolarMatch best{agreeing(matches, [&](cv::Mat& mask) {
    cv::findFundamentalMat(from, to, cv::FM_RANSAC, kGatePixels, kConfidence, 1000, mask);
  })};
  auto plane = agreeing(
      matches, [&](cv::Mat& mask) { cv::findHomography(from, to, cv::RANSAC, kGatePixels, mask, 1000, kConfidence); });
  const bool enough = plane.size() >= std::min<std::size_t>(best.inliers.size(), kMinEpipolarInliers);
  if (enough && static_cast<double>(plane.size()) >= kOnePlane * static_cast<double>(best.inliers.size()))
    best = {std::move(plane), true};
  if (best.inliers.size() < static_cast<std::size_t>(kMinEpipolarInliers)) return too_few(best.inliers.size());
  return best;
}

}  // namespace relmap
