// Events of the map as JSON. Internal to client/.
#pragma once

#include <string>

namespace relmap::v1 {
class MapEvent;
}

namespace relmap::client {

// Canonical proto3 JSON with the members that are 0 or empty, too, but of a session and of a closure only with those
// that an event carries (watch.proto): a 0 means that it is 0. Empty: it is no message that JSON can hold.
std::string event_json(const v1::MapEvent& event);

}  // namespace relmap::client
