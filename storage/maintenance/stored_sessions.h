// Sessions and the map's state as they stand in a snapshot, read past whatever is damaged.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/graph/frame.h"
#include "storage/map/map.h"

namespace relmap::storage {

struct SessionDamage {
  std::string key;
  SessionNumber number = 0;
  std::string what;
};

struct PendingDamage {
  std::string key;  // empty: stands for all that could not be read
  std::string what;
};

struct StoredSessions {
  std::vector<Session> sessions;  // ascending by number
  std::vector<SessionDamage> damage;
  std::vector<SessionNumber> unknown;  // sessions that have frames and no record at all
  FrameSet pending;                    // as MapState has it
  std::vector<PendingDamage> pending_damage;
  std::optional<MapState> state;  // nullopt: damaged, or never written; without `pending`
  std::string state_damage;       // how it is damaged; empty if it is not
};
StoredSessions load_sessions(const EngineSnapshot& snapshot);

}  // namespace relmap::storage
