#include "server/ingest/sealed_robots.h"

#include <algorithm>
#include <utility>

#include "proto/wire/channels.h"

namespace relmap::ingest {

namespace {

constexpr std::chrono::milliseconds kWelcomeSpacing{5};
constexpr std::int64_t kComplainAgain_s = 600;

Status refused(const std::string& why) { return {Reason::UNAUTHENTICATED, why}; }

}  // namespace

void SealedRobots::use(const access::AccessList& list) {
  std::map<access::SealKeyId, Robot> robots;
  former_.clear();
  complained_.clear();
  for (const access::Grant& grant : list.grants()) {
    if (grant.kind != access::Grant::Kind::kKey || grant.principal.role != access::Role::kRobot) continue;
    const access::RobotKey key = access::robot_key(secret_, access::key_of_hex(grant.hash).value());
    if (grant.revoked) {
      former_.emplace(key.id, Former{access::Sealer(key.key), grant.principal.name});
      continue;
    }
    Robot robot(access::Sealer(key.key), grant.principal.name);
    robot.expires_s = grant.expires_s;
    if (const auto known = robots_.find(key.id); known != robots_.end()) {
      robot.runs = std::move(known->second.runs);
      robot.sessions = std::move(known->second.sessions);
      robot.welcomed = std::move(known->second.welcomed);
    }
    robots.emplace(key.id, std::move(robot));
  }
  robots_ = std::move(robots);
  std::erase_if(recipients_, [&](const auto& entry) { return !robots_.contains(entry.first.second); });
}

Status SealedRobots::complain(const access::SealKeyId& key, const std::string& why, std::int64_t utc_s) {
  const auto [before, first] = complained_.try_emplace(key, utc_s);
  if (first || utc_s < before->second || utc_s - before->second >= kComplainAgain_s) {
    before->second = utc_s;
    complaint_ = why;
  }
  return refused(why);
}

Result<SealedRobots::Robot*> SealedRobots::verified(std::string_view channel, const access::SealBoot& boot,
                                                    const access::SealedMessage& sealed, std::int64_t utc_s) {
  const auto found = robots_.find(sealed.seal.key);
  if (found == robots_.end()) {
    const auto former = former_.find(sealed.seal.key);
    if (former == former_.end() || !former->second.sealer.verify(access::SealedBy::kRobot, channel, boot, sealed))
      return refused("no seal, or one of an unknown key");
    return complain(former->first, "the key of " + former->second.name + " was revoked", utc_s);
  }
  Robot& robot = found->second;
  if (!robot.sealer.verify(access::SealedBy::kRobot, channel, boot, sealed))
    return refused("not sealed by " + robot.name + ", or for another daemon");
  if (robot.expires_s <= utc_s)
    return complain(found->first, "the key of " + robot.name + " expired at " + access::time_text(robot.expires_s),
                    utc_s);
  return &robot;
}

Result<SealedRobots::Opened> SealedRobots::open(std::string_view channel, ByteSpan datagram, Time now,
                                                std::int64_t utc_s) {
  const auto sealed = access::split_sealed(datagram);
  if (!sealed) return refused("no seal");
  const auto robot = verified(channel, boot_, *sealed, utc_s);
  if (!robot.ok()) return robot.status();
  const access::Seal& seal = sealed->seal;
  constexpr std::uint64_t fresh_us = std::chrono::microseconds(kFresh).count();
  if (seal.time_us > time_us(now) || seal.time_us + fresh_us < time_us(now))
    return Status(Reason::REPLAYED, "a message of " + (*robot)->name + " is too old");
  auto& runs = (*robot)->runs;
  if (!runs.contains(seal.run) && runs.size() >= kMaxRuns) {
    // What it sent is too old by now.
    std::erase_if(runs, [&](const auto& entry) { return entry.second.heard + 2 * kFresh < now; });
    if (runs.size() >= kMaxRuns) return Status(Reason::RATE_LIMITED, (*robot)->name + " sends from too many processes");
  }
  Run& run = runs[seal.run];
  if (!run.counts.pass(seal.count)) return Status(Reason::REPLAYED, "a message of " + (*robot)->name + " came before");
  run.heard = now;
  return Opened{sealed->message, (*robot)->name, seal.key, seal.run};
}

Result<SealedRobots::Opened> SealedRobots::open_hello(ByteSpan datagram, std::int64_t utc_s) {
  const auto sealed = access::split_sealed(datagram);
  if (!sealed) return refused("no seal");
  const auto robot = verified(kHelloChannel, {}, *sealed, utc_s);
  if (!robot.ok()) return robot.status();
  return Opened{sealed->message, (*robot)->name, sealed->seal.key, sealed->seal.run};
}

void SealedRobots::sends(const Opened& from, const SessionUuid& session) {
  const auto [it, fresh] = recipients_.insert_or_assign({session, from.key}, from.run);
  if (!fresh) return;
  std::vector<SessionUuid>& sessions = robots_.at(from.key).sessions;
  sessions.push_back(session);
  if (sessions.size() <= kMaxSessions) return;
  recipients_.erase({sessions.front(), from.key});
  sessions.erase(sessions.begin());
}

std::uint64_t SealedRobots::time_us(Time now) const {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(now - start_).count());
}

void SealedRobots::seal(Robot& robot, const access::SealKeyId& key, std::uint64_t run, std::string_view channel,
                        Time now, Bytes& message) {
  robot.sealer.seal(access::SealedBy::kDaemon, channel, {}, {key, run, time_us(now), ++sent_}, message);
}

std::vector<Bytes> SealedRobots::seal(const SessionUuid& session, const std::string& robot, std::string_view channel,
                                      const Bytes& message, Time now) {
  std::vector<Bytes> sealed;
  for (auto to = recipients_.lower_bound({session, {}}); to != recipients_.end() && to->first.first == session; ++to) {
    const auto& [key, run] = std::pair(to->first.second, to->second);
    Robot& recipient = robots_.at(key);
    if (recipient.name == robot) seal(recipient, key, run, channel, now, sealed.emplace_back(message));
  }
  return sealed;
}

Bytes SealedRobots::welcome(const Opened& from, const Bytes& message, Time now) {
  Robot& robot = robots_.at(from.key);
  std::erase_if(robot.welcomed, [&](const auto& entry) { return now - entry.second >= kWelcomeSpacing; });
  if (robot.welcomed.size() >= kMaxRuns || !robot.welcomed.emplace(from.run, now).second) return {};
  Bytes sealed = message;
  seal(robot, from.key, from.run, kMapChannel, now, sealed);
  return sealed;
}

}  // namespace relmap::ingest
