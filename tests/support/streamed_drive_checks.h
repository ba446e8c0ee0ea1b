// What holds for every streamed drive whose map is as it should be; gtest expectations.
#pragma once

#include <vector>

#include "tests/support/streamed_drive.h"

namespace relmap::testing {

void expect_every_pair_processed(const StreamedDrive& drive, double pairs);
// Of the front-end's odometry and of the map's chain; the daemon has stopped.
void expect_drift_below(const StreamedDrive& drive, double limit, const std::vector<double>& lengths,
                        std::size_t segments);
// Pairs are found where they were taken, within `metres`.
void expect_localised(StreamedDrive& drive, const std::vector<std::size_t>& pairs, double metres);
// Likewise one picture of each, of a camera that nobody names: its focal length is found as well.
void expect_localised_by_a_photograph(StreamedDrive& drive, const std::vector<std::size_t>& pairs, double metres);
// From the place of a picture to a label on frame `to`, by distance and by time: about `metres`.
void expect_routed(StreamedDrive& drive, std::size_t from, FrameId to, double metres);

}  // namespace relmap::testing
