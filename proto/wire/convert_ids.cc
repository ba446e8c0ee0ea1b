#include <string>

#include "proto/wire/convert.h"

namespace relmap {

v1::Reason to_wire(Reason reason) { return static_cast<v1::Reason>(reason); }

Reason reason_from_wire(int number) {
  if (number < 0 || number > 0xffff || !is_reason(static_cast<std::uint16_t>(number))) return Reason::INTERNAL;
  return static_cast<Reason>(number);
}

v1::FrameId to_wire(FrameId id) {
  v1::FrameId wire;
  wire.set_session(id.session);
  wire.set_index(id.index);
  return wire;
}

v1::EdgeId to_wire(EdgeId id) {
  v1::EdgeId wire;
  *wire.mutable_frame() = to_wire(id.frame);
  wire.set_ordinal(id.ordinal);
  return wire;
}

v1::LandmarkId to_wire(LandmarkId id) {
  v1::LandmarkId wire;
  *wire.mutable_base() = to_wire(id.base);
  wire.set_slot(id.slot);
  return wire;
}

Result<FrameId> from_wire(const v1::FrameId& id) {
  const FrameId frame{id.session(), id.index()};
  if (!frame.valid()) return {Reason::INVALID_ARGUMENT, "frame " + frame.to_string() + ": sessions count from 1"};
  return frame;
}

Result<EdgeId> from_wire(const v1::EdgeId& id) {
  const auto frame = from_wire(id.frame());
  if (!frame.ok()) return frame.status();
  return EdgeId{*frame, id.ordinal()};
}

std::string uuid_to_wire(const SessionUuid& uuid) { return {uuid.bytes.begin(), uuid.bytes.end()}; }

Result<SessionUuid> uuid_from_wire(std::string_view bytes) {
  SessionUuid uuid;
  if (bytes.size() != uuid.bytes.size())
    return {Reason::INVALID_ARGUMENT, "session uuid of " + std::to_string(bytes.size()) + " bytes; must be 16"};
  std::copy(bytes.begin(), bytes.end(), uuid.bytes.begin());
  if (uuid.is_nil()) return {Reason::INVALID_ARGUMENT, "session uuid is nil"};
  return uuid;
}

}  // namespace relmap
