#include "server/place/epipolar.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "server/place/descriptor_match.h"

namespace relmap {
namespace {

constexpr double kGatePixels = 2;
constexpr double kConfidence = 0.999;

std::vector<std::uint32_t> chosen_by(const cv::Mat& mask, const std::vector<DescriptorMatch>& matches) {
  std::vector<std::uint32_t> features;
  for (int i = 0; i < static_cast<int>(mask.total()); ++i)
    if (mask.at<std::uint8_t>(i)) features.push_back(matches[static_cast<std::size_t>(i)].feature);
  return features;
}

}  // namespace

Result<EpipolarMatch> match_views(std::span<const AppearanceFeature> query, std::span<const AppearanceFeature> map) {
  std::vector<const Descriptor*> descriptors;
  for (const AppearanceFeature& feature : map) descriptors.push_back(&feature.descriptor);
  const auto matches = match_descriptors(query, descriptors, [](std::uint32_t, std::uint32_t) { return false; });
  const auto too_few = [](std::size_t count) {
    return Status(Reason::TOO_FEW_INLIERS, std::to_string(count) + " matches agree on one geometry");
  };
  if (matches.size() < static_cast<std::size_t>(kMinEpipolarInliers)) return too_few(0);

  std::vector<cv::Point2f> from, to;
  for (const DescriptorMatch& match : matches) {
    from.emplace_back(map[match.point].u, map[match.point].v);
    to.emplace_back(query[match.feature].u, query[match.feature].v);
  }
  EpipolarMatch best;
  try {
    cv::Mat mask;
    cv::findFundamentalMat(from, to, cv::FM_RANSAC, kGatePixels, kConfidence, 1000, mask);
    best.inliers = chosen_by(mask, matches);
    cv::findHomography(from, to, cv::RANSAC, kGatePixels, mask, 1000, kConfidence);
    if (auto plane = chosen_by(mask, matches); plane.size() > best.inliers.size()) best.inliers = std::move(plane);
  } catch (const cv::Exception&) {
    return too_few(best.inliers.size());  // a degenerate configuration
  }
  if (best.inliers.size() < static_cast<std::size_t>(kMinEpipolarInliers)) return too_few(best.inliers.size());
  return best;
}

}  // namespace relmap
