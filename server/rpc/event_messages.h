// Converts events of the log to messages of WatchMap. Internal to server/rpc, since it exposes generated code.
#pragma once

#include "relmap/v1/watch.pb.h"
#include "storage/events/event.h"

namespace relmap::rpc {

// What happened, with when, by whom and why; without a token. Frames that were added and moved are not converted: only
// their envelope is.
v1::MapEvent event_message(const storage::Event& event);

v1::AddedFrame added_frame_message(const storage::FrameAddedEvent& frame);

}  // namespace relmap::rpc
