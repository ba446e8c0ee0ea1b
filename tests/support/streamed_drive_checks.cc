#include "tests/support/streamed_drive_checks.h"

#include <gtest/gtest.h>

#include <cstdio>

namespace relmap::testing {

void expect_every_pair_processed(const StreamedDrive& drive, double pairs) {
  EXPECT_EQ(drive.summary("pairs"), pairs);
  EXPECT_EQ(drive.summary("tracked"), pairs);
  EXPECT_EQ(drive.summary("unsettled"), 0);
  EXPECT_EQ(drive.summary("gaps"), 0);
  EXPECT_EQ(drive.summary("keyframes"), drive.session().frames);
  EXPECT_EQ(drive.session().last + 1, drive.session().frames);
  EXPECT_EQ(drive.session().refused, 0u);
}

void expect_drift_below(const StreamedDrive& drive, const DriftLimits& limits, const std::vector<double>& lengths,
                        std::size_t segments) {
  for (const double length : lengths) {
    const tracking::Drift odometry = tracking::measure_drift(drive.odometry_chain(), length);
    const tracking::Drift map = tracking::measure_drift(drive.map_chain(), length);
    EXPECT_GE(map.segments, segments);
    EXPECT_LE(odometry.translation, limits.odometry) << "odometry over " << length << " m";
    EXPECT_LE(map.translation, limits.map) << "map over " << length << " m";
    std::printf("drift over %.0f m: odometry %.2f %%, map %.2f %% (%zu segments)\n", length, 100 * odometry.translation,
                100 * map.translation, map.segments);
  }
}

void expect_localised(StreamedDrive& drive, const std::vector<std::size_t>& pairs, double metres) {
  for (const std::size_t pair : pairs) {
    const auto answer = drive.client().localise(drive.view(pair));
    ASSERT_TRUE(answer.ok()) << "pair " << pair << ": " << answer.status().to_string();
    const SE3 truth = drive.true_T_frame_pair(answer->frame, pair);
    EXPECT_LT((answer->T_frame_view.t - truth.t).norm(), metres) << "pair " << pair;
    EXPECT_LT(rotation_angle(truth.R.transpose() * answer->T_frame_view.R), 0.03) << "pair " << pair;
    EXPECT_GE(answer->inliers, 20u);
    std::printf("pair %zu: %s, off by %.3f m\n", pair, answer->frame.to_string().c_str(),
                (answer->T_frame_view.t - truth.t).norm());
  }
}

void expect_localised_by_a_photograph(StreamedDrive& drive, const std::vector<std::size_t>& pairs, double metres) {
  for (const std::size_t pair : pairs) {
    client::View view = drive.view(pair);
    view.right.clear();
    view.camera = {};
    for (const std::optional<FrameId> prior : {std::optional<FrameId>(), std::optional(drive.frame_near(pair))}) {
      const auto answer = drive.client().localise(view, prior);
      ASSERT_TRUE(answer.ok()) << "pair " << pair << ": " << answer.status().to_string();
      EXPECT_EQ(answer->near_prior, prior.has_value());
      EXPECT_EQ(answer->verification, client::Verification::kPnP);
      const double off = (answer->T_frame_view.t - drive.true_T_frame_pair(answer->frame, pair).t).norm();
      EXPECT_LT(off, metres) << "pair " << pair;
      ASSERT_TRUE(answer->estimated_focal_length.has_value());
      EXPECT_NEAR(*answer->estimated_focal_length / drive.session().camera.f, 1, 0.1) << "pair " << pair;
      std::printf("pair %zu: %s, off by %.3f m, focal length %.1f px (%.1f)\n", pair, answer->frame.to_string().c_str(),
                  off, *answer->estimated_focal_length, drive.session().camera.f);
    }
  }
}

void expect_routed(StreamedDrive& drive, std::size_t from, FrameId to, double metres) {
  client::Client& client = drive.client();
  ASSERT_TRUE(client.set_label(to, "end of the road").ok());
  for (const client::RouteBy by : {client::RouteBy::kDistance, client::RouteBy::kTime}) {
    client::RouteRequest request;
    request.from = drive.view(from);
    request.to = std::string("end of the road");
    request.by = by;
    const auto route = client.find_route(request);
    ASSERT_TRUE(route.ok()) << route.status().to_string();
    EXPECT_EQ(route->to, to);
    EXPECT_NEAR(route->distance_m, metres, 0.05 * metres + 1.5);
    EXPECT_GT(route->time_s, 0);
    std::printf("route of %.1f m and %.1f s; %.1f m were driven\n", route->distance_m, route->time_s, metres);
  }
}

}  // namespace relmap::testing
