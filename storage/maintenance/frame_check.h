// What can be said of one record by itself: numbers that cannot be, ids that are not its own, order that is not kept.
// References to other frames are storage/maintenance/references.h.
#pragma once

#include <functional>
#include <string>

#include "storage/frame.h"
#include "storage/map.h"

namespace relmap {

using Complain = std::function<void(const std::string& what)>;

void check_hot(FrameId id, const FrameHot& frame, const Complain& complain);
void check_warm(FrameId id, const FrameWarm& frame, const Complain& complain);
void check_cold(FrameId id, const FrameCold& frame, const Complain& complain);
void check_session(const Session& session, const Complain& complain);

}  // namespace relmap
