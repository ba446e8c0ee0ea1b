#include "frontend/publishing/served_maps.h"

namespace relmap::publishing {

namespace {

using std::chrono::milliseconds;
// A daemon introduces itself every second. After these times, one that has not done so never will, and one that has
// been heard alone is the only one.
constexpr milliseconds kUnnamed{3000}, kOtherAlone{2000};
constexpr std::size_t kMaxDaemons = 64;  // whose maps are remembered

}  // namespace

MapIdentity ServedMaps::of(const BootId& boot) const {
  const auto daemon = daemons_.find(boot);
  return daemon == daemons_.end() ? MapIdentity{} : daemon->second;
}

// Whether the map has what the session has published, as far as is known.
bool ServedMaps::belongs_to(const MapIdentity& map) const {
  if (!options_.only.is_nil() && map.uuid != options_.only) return false;
  if (!map_.known() || !map.known()) return true;
  return map.uuid == map_.uuid && (!options_.repeated || map.epoch == map_.epoch);
}

void ServedMaps::hear_other(const MapIdentity& map, Time now) {
  if (!other_speaks(now)) other_since_ = now;
  other_ = map;
  other_heard_ = now;
}

// If several daemons may be heard, one that is silent has gone.
bool ServedMaps::other_speaks(Time now) const { return other_ && (options_.lossless || now - other_heard_ < kUnnamed); }

void ServedMaps::introduce(const DaemonIdentity& daemon, const std::optional<BootId>& acknowledging, Time now) {
  if (daemons_.size() >= kMaxDaemons) daemons_.clear();  // they will introduce themselves again
  daemons_[daemon.boot] = daemon.map;
  unnamed_.erase(daemon.boot);
  if (!belongs_to(daemon.map)) return hear_other(daemon.map, now);
  introduced_ = true;
  other_.reset();
  if (acknowledging == daemon.boot) acknowledged_by(daemon.boot);
}

bool ServedMaps::believes(const BootId& boot, Time now) {
  if (unnamed_.size() >= kMaxDaemons) unnamed_.clear();
  if (!daemons_.contains(boot) && (map_.known() || !options_.only.is_nil()) &&
      now - unnamed_.emplace(boot, now).first->second < kUnnamed)
    return false;
  if (const MapIdentity map = of(boot); !belongs_to(map)) {
    hear_other(map, now);
    return false;
  }
  other_.reset();
  return true;
}

bool ServedMaps::restored(const BootId& boot) const {
  const MapIdentity map = of(boot);
  return map_.known() && map.known() && map.epoch != map_.epoch;
}

void ServedMaps::acknowledged_by(const BootId& boot) {
  if (const MapIdentity map = of(boot); map.known()) map_ = map;
}

void ServedMaps::wait_since(Time now) {
  if (!waiting_since_) waiting_since_ = now;
}

void ServedMaps::broken() {
  if (options_.lossless) introduced_ = false;
}

bool ServedMaps::may_send(Time now) const {
  if (other_speaks(now)) return false;
  if (introduced_ || (!map_.known() && options_.only.is_nil())) return true;
  return !options_.lossless && options_.only.is_nil() && waiting_since_ && now - *waiting_since_ >= kUnnamed;
}

bool ServedMaps::is_other(const BootId& boot) const { return !belongs_to(of(boot)); }

Status ServedMaps::status(const SessionUuid& session, Time now) const {
  if (!other_speaks(now) || (!options_.lossless && now - other_since_ < kOtherAlone)) return {};
  const std::string served = ", and the daemon serves map " + other_->uuid.to_string();
  if (!options_.only.is_nil() && other_->uuid != options_.only)
    return {Reason::WRONG_MAP, "session " + session.to_string() + " is for map " + options_.only.to_string() + served};
  if (other_->uuid == map_.uuid)
    return {Reason::MAP_RESTORED, "the map was restored from a backup since the recording was sent to it"};
  return {Reason::WRONG_MAP, "session " + session.to_string() + " was begun in map " + map_.uuid.to_string() + served};
}

}  // namespace relmap::publishing
