#include "server/rpc/watch_feed.h"

#include <algorithm>

#include "proto/base/clock.h"
#include "relmap/v1/status.pb.h"
#include "server/map/mapper.h"
#include "server/rpc/handlers.h"

namespace relmap::rpc {

namespace {

constexpr std::chrono::seconds kLookAtRobots{1};

// Of a robot, what those who watch are told at once.
std::string state_of(const v1::Robot& robot) {
  v1::Robot state;
  state.set_session(robot.session());
  state.set_robot(robot.robot());
  state.set_name(robot.name());
  state.set_silent(robot.silent());
  state.set_blocked(robot.blocked());
  *state.mutable_same_name() = robot.same_name();
  return state.SerializeAsString();
}

}  // namespace

WatchFeed::Sources WatchFeed::sources_of(map::Mapper& mapper, const Intake& intake) {
  return {[&mapper] { return mapper.engine().applied_sequence(); }, [&mapper] { return mapper.progress().storage; },
          [&mapper, &intake]() -> std::optional<std::vector<v1::Robot>> {
            const auto reply = list_robots({}, {}, mapper, intake);
            if (!reply.ok()) return {};
            return std::vector<v1::Robot>(reply->robots().begin(), reply->robots().end());
          },
          [&mapper](std::function<void()> committed) { mapper.watch_commits(std::move(committed)); }};
}

WatchFeed::WatchFeed(Sources sources) : sources_(std::move(sources)), committed_{0, sources_.committed(), now_us()} {
  if (sources_.on_commit) sources_.on_commit([this] { committed(); });
}

WatchFeed::~WatchFeed() {
  if (sources_.on_commit) sources_.on_commit({});
  {
    const MutexLock lock(commit_mutex_);
    stopping_ = true;
    kick_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void WatchFeed::committed() {
  const std::uint64_t sequence = sources_.committed();
  const MutexLock lock(commit_mutex_);
  committed_ = {committed_.number + 1, sequence, now_us()};
  kicked_ = true;
  kick_.notify_all();
}

Committed WatchFeed::last_commit() const {
  const MutexLock lock(commit_mutex_);
  return committed_;
}

void WatchFeed::kick() {
  const MutexLock lock(commit_mutex_);
  kicked_ = true;
  kick_.notify_all();
}

std::unique_ptr<WatchFeed::Subscription> WatchFeed::subscribe(Wake wake) {
  auto subscription = std::make_unique<Subscription>(*this, std::move(wake));
  const MutexLock lock(mutex_);
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  subscriptions_.insert(subscription.get());
  if (!known_) kick();
  return subscription;
}

WatchFeed::Subscription::~Subscription() { feed_.leave(this); }

// The sources may go when the last watcher has gone.
void WatchFeed::leave(Subscription* subscription) {
  const MutexLock lock(mutex_);
  subscriptions_.erase(subscription);
  if (!subscriptions_.empty()) return;
  while (looking_) looked_at_.wait(mutex_);
  if (!subscriptions_.empty()) return;
  known_ = false;
  robots_.clear();
}

std::optional<WatchFeed::Changes> WatchFeed::Subscription::changes() {
  const MutexLock lock(feed_.mutex_);
  if (!feed_.known_) return {};
  Changes changes{feed_.last_commit(), {}, {}};
  if (!begun_ || feed_.storage_changed_ > seen_) changes.storage = feed_.storage_;
  if (begun_)
    for (const auto& [uuid, known] : feed_.robots_)
      if (known.changed > seen_) changes.robots.push_back(known.robot);
  begun_ = true;
  seen_ = feed_.change_;
  return changes;
}

WatchFeed::Counts WatchFeed::counts() const {
  const MutexLock lock(mutex_);
  const std::uint64_t committed = last_commit().sequence;
  Counts counts{told_, resyncs_, 0};
  for (const Subscription* subscription : subscriptions_)
    if (const std::uint64_t told = subscription->told_; told < committed)
      counts.lag = std::max(counts.lag, committed - told);
  return counts;
}

void WatchFeed::run() {
  for (;;) {
    bool wake = false;
    {
      const MutexLock lock(commit_mutex_);
      kick_.wait_for(commit_mutex_, kLookAtRobots,
                     [this]() RELMAP_REQUIRES(commit_mutex_) { return stopping_ || kicked_; });
      if (stopping_) return;
      wake = std::exchange(kicked_, false);
    }
    const MutexLock lock(mutex_);
    if (subscriptions_.empty()) continue;
    if (look()) wake = true;
    if (!wake) continue;
    for (const Subscription* subscription : subscriptions_) subscription->wake_();
  }
}

// Looks at the sources once a second, without the mutex. Whether something changed.
bool WatchFeed::look() {
  const auto now = std::chrono::steady_clock::now();
  if (known_ && now - looked_ < kLookAtRobots) return false;
  looking_ = true;
  Status storage;
  std::optional<std::vector<v1::Robot>> robots;
  bool committed = false;
  {
    const MutexUnlock unlocked(mutex_);
    storage = sources_.storage();
    robots = sources_.robots();
    const std::uint64_t sequence = sources_.committed();
    const MutexLock lock(commit_mutex_);
    committed = sequence > committed_.sequence;
    if (committed) committed_ = {committed_.number + 1, sequence, now_us()};
  }
  looking_ = false;
  looked_at_.notify_all();
  looked_ = now;
  const bool first = !known_;
  known_ = true;
  return compare(storage, std::move(robots)) || committed || first;
}

bool WatchFeed::compare(const Status& storage, std::optional<std::vector<v1::Robot>> robots) {
  const std::uint64_t before = change_;
  if (storage.reason() != storage_.reason() || storage.message() != storage_.message()) {
    storage_ = storage;
    storage_changed_ = ++change_;
  }
  if (!robots) return change_ != before;
  std::map<std::string, KnownRobot> now;
  for (v1::Robot& robot : *robots) {
    std::string state = state_of(robot);
    const std::string uuid = robot.uuid();
    const auto known = robots_.find(uuid);
    if (known != robots_.end() && known->second.state == state)
      now.emplace(uuid, std::move(known->second));
    else
      now.emplace(uuid, KnownRobot{std::move(state), std::make_shared<const v1::Robot>(std::move(robot)), ++change_});
  }
  robots_ = std::move(now);
  return change_ != before;
}

}  // namespace relmap::rpc
