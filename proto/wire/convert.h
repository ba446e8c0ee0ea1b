// FOR ADAPTERS ONLY: the one header of relmap that shows generated code of protobuf. Include it from .cc files
// (server/ingest, server/rpc, frontend/publishing, client), never from a public header.
//
// Converts the types of proto/ to and from protobuf. Only the form of what comes from outside is checked here
// (sizes, finite numbers, unit quaternions); its users check what it means.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "proto/calibration/calibration.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/canonical_rotation.h"
#include "proto/geometry/covariance.h"
#include "proto/geometry/geometry.h"
#include "proto/keyframe/keyframe.h"
#include "relmap/v1/common.pb.h"
#include "relmap/v1/reason.pb.h"

namespace relmap {

// ---- Reasons. The numbers are equal, which a test checks. An unknown number becomes INTERNAL.
v1::Reason to_wire(Reason reason);
Reason reason_from_wire(int number);

// ---- Identifiers. INVALID_ARGUMENT for a frame of session 0.
v1::FrameId to_wire(FrameId id);
v1::EdgeId to_wire(EdgeId id);
v1::LandmarkId to_wire(LandmarkId id);
Result<FrameId> from_wire(const v1::FrameId& id);
Result<EdgeId> from_wire(const v1::EdgeId& id);

// The 16 bytes of a UUID. INVALID_ARGUMENT if there are not 16, or all are 0.
std::string uuid_to_wire(const SessionUuid& uuid);
Result<SessionUuid> uuid_from_wire(std::string_view bytes);

// ---- Geometry. Rotations are sent as canonical quaternions. NOT_FINITE, BAD_ROTATION; for covariances BAD_SIZE,
// BAD_COVARIANCE.
v1::Vector3 to_wire(const Vector3& v);
v1::Transform to_wire(const SE3& T);
v1::Covariance to_wire(const Matrix6& covariance);
Result<SE3> from_wire(const v1::Transform& T);
Result<SE3> transform_of(const QuaternionWxyz& q, const Vector3& t);
Result<Matrix6> from_wire(const v1::Covariance& covariance);

// ---- Cameras. IMPLAUSIBLE_CALIBRATION.
v1::Camera to_wire(const StereoCamera& camera);
Result<StereoCamera> from_wire(const v1::Camera& camera);
v1::RawStereo to_wire(const StereoCalibration& calibration);
Result<StereoCalibration> from_wire(const v1::RawStereo& raw);

// ---- Appearance. BAD_SIZE, NOT_FINITE.
v1::FeatureSet to_wire(std::span<const AppearanceFeature> features);
Result<std::vector<AppearanceFeature>> from_wire(const v1::FeatureSet& features);

}  // namespace relmap
