#include "frontend/publishing/lcm/sealed_daemon.h"

#include <algorithm>

#include "proto/wire/channels.h"

namespace relmap::publishing {

namespace {

using std::chrono::milliseconds;
constexpr milliseconds kSilence{1000};
constexpr milliseconds kReady{4000};     // well below the ten seconds for which a daemon takes what is sealed
constexpr std::size_t kMaxDaemons = 64;  // whose counts are remembered: only holders of the key get in here

}  // namespace

SealedDaemon::SealedDaemon(const access::RobotKey& key, std::uint64_t run) : key_(key), run_(run), sealer_(key.key) {}

void SealedDaemon::pin(const Uuid& map) { map_ = map; }

const SealedDaemon::Daemon* SealedDaemon::addressed() const { return addressed_ ? &daemons_.at(*addressed_) : nullptr; }

void SealedDaemon::seal_hello(Bytes& hello) {
  sealer_.seal(access::SealedBy::kRobot, kHelloChannel, {}, {key_.id, run_, 0, ++sent_}, hello);
}

bool SealedDaemon::wants_hello(Time now) const { return !addressed() || now - addressed()->heard >= kSilence; }

bool SealedDaemon::ready(Time now) const { return addressed() && now - addressed()->heard < kReady; }

void SealedDaemon::seal(std::string_view channel, Bytes& message) {
  sealer_.seal(access::SealedBy::kRobot, channel, *addressed_, {key_.id, run_, addressed()->time_us, ++sent_}, message);
}

std::optional<access::SealedMessage> SealedDaemon::open(std::string_view channel, ByteSpan datagram) {
  const auto sealed = access::split_sealed(datagram);
  if (!sealed || sealed->seal.key != key_.id || sealed->seal.run != run_) return std::nullopt;
  if (!sealer_.verify(access::SealedBy::kDaemon, channel, {}, *sealed)) return std::nullopt;
  return sealed;
}

bool SealedDaemon::heard(const BootId& boot, const access::Seal& seal, Time now) {
  const auto known = daemons_.find(boot);
  if (known == daemons_.end() && daemons_.size() >= kMaxDaemons) {
    const auto oldest = std::min_element(daemons_.begin(), daemons_.end(), [this](const auto& a, const auto& b) {
      return std::pair(a.first == addressed_, a.second.heard) < std::pair(b.first == addressed_, b.second.heard);
    });
    daemons_.erase(oldest);
  }
  Daemon& daemon = daemons_[boot];
  if (seal.count <= daemon.count) return false;
  daemon = {seal.count, seal.time_us, now};
  return true;
}

bool SealedDaemon::welcome(const DaemonIdentity& daemon, Time now) {
  if (map_ && *map_ != daemon.map.uuid) return false;
  const bool free = !addressed() || now - addressed()->heard >= kSilence;
  if (free) addressed_ = daemon.boot;
  if (addressed_ == daemon.boot && daemon.map.known()) map_ = daemon.map.uuid;
  return addressed_ == daemon.boot;
}

}  // namespace relmap::publishing
