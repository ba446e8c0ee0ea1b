#include "storage/maintenance/restored.h"

#include <algorithm>
#include <span>

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {

Result<MapIdentity> mark_restored(Engine& engine, std::uint64_t now_us) {
  const auto stored = engine.snapshot()->get(keys::map_state());
  if (!stored.ok()) return stored.status();
  if (!stored->has_value()) return MapIdentity{};
  auto state = decode_state(**stored);
  if (!state.ok()) return {Reason::DATA_LOSS, "the map's state: " + state.status().message()};
  if (!state->identity.known()) return MapIdentity{};
  state->identity.epoch = std::max(now_us, state->identity.epoch + 1);
  const auto owner = engine.acquire();
  if (!owner.ok()) return owner.status();
  const Put put{keys::map_state(), encode_state(*state)};
  const Status done = engine.commit(*owner, engine.applied_sequence(), std::span(&put, 1), {});
  if (!done.ok()) return done;
  return state->identity;
}

}  // namespace relmap::storage
