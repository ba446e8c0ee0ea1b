// gtest expectations for the map of a streamed drive.
#pragma once

#include <vector>

#include "tests/support/streamed_drive.h"

namespace relmap::testing {

void expect_every_pair_processed(const StreamedDrive& drive, double pairs);
// As shares of the way.
struct DriftLimits {
  double odometry, map;
};
// Checks the drift of the front-end's odometry and of the map's chain. The daemon must have stopped.
void expect_drift_below(const StreamedDrive& drive, const DriftLimits& limits, const std::vector<double>& lengths,
                        std::size_t segments);
// The pairs are localised within `metres` of the truth.
void expect_localised(StreamedDrive& drive, const std::vector<std::size_t>& pairs, double metres);
// The same for one picture of each pair without a calibration: the focal length is estimated as well.
void expect_localised_by_a_photograph(StreamedDrive& drive, const std::vector<std::size_t>& pairs, double metres);
// The routes from the place of a pair to a label on frame `to`, by distance and by time, are about `metres` long.
void expect_routed(StreamedDrive& drive, std::size_t from, FrameId to, double metres);

}  // namespace relmap::testing
