// Checks of one record by itself: impossible numbers, ids that are not its own, wrong order. References to other frames
// are checked by storage/maintenance/references.h.
#pragma once

#include <functional>
#include <string>

#include "storage/graph/frame.h"
#include "storage/map/map.h"

namespace relmap::storage {

using Complain = std::function<void(const std::string& what)>;

void check_hot(FrameId id, const FrameHot& frame, const Complain& complain);
void check_warm(FrameId id, const FrameWarm& frame, const Complain& complain);
void check_cold(FrameId id, const FrameCold& frame, const Complain& complain);
void check_session(const Session& session, const Complain& complain);
// `next` is the sequence behind the skipped range before.
void check_skipped(const Session& session, const Skipped& skipped, std::uint64_t next, const Complain& complain);

inline constexpr double kMinInverseDepth = 1e-5;  // of a landmark, per metre

bool is_finite(const SE3& T);
bool is_finite(const Observation& z);  // u_right may be NaN: mono
bool is_transform(const SE3& T);       // finite, and its rotation is one
bool is_covariance(const Matrix6& m);  // finite, symmetric, positive semidefinite, whatever the units
SE3 near_rotation(const SE3& T);       // T with the nearest rotation; the identity if T is not finite

}  // namespace relmap::storage
