// The session of a robot on a rendered street.
#pragma once

#include "proto/keyframe/keyframe.h"

namespace relmap::tracking::testing_session {

inline SessionHeader session_of(const StereoCamera& camera) {
  SessionHeader session;
  session.uuid.bytes[0] = 1;
  session.robot = "robot";
  session.name = "street";
  session.camera = camera;
  return session;
}

}  // namespace relmap::tracking::testing_session
