#include "server/map/journal_writer.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/mutex.h"

namespace relmap::map {

namespace {

constexpr std::chrono::milliseconds kAskAgain{200};  // between two attempts after a failure

std::size_t queue_bytes(const storage::JournalRecord& record) {
  std::size_t bytes = sizeof(storage::JournalRecord);
  if (const auto* keyframe = std::get_if<storage::KeyframeRecord>(&record)) bytes += keyframe->payload.capacity();
  if (const auto* closure = std::get_if<storage::ClosureProposalRecord>(&record))
    bytes += closure->bindings.capacity() * sizeof(storage::ProposedBinding);
  if (const auto* binding = std::get_if<storage::BindingRecord>(&record))
    bytes += binding->bindings.capacity() * sizeof(storage::ProposedBinding);
  return bytes;
}

}  // namespace

void stamp(storage::JournalRecord& record) {
  if (storage::Submission* submitted = storage::submission(record); submitted && submitted->time_us == 0)
    submitted->time_us = now_us();
}

JournalWriter::JournalWriter(std::shared_ptr<storage::Engine> engine, std::uint64_t epoch,
                             std::shared_ptr<storage::Budget> budget, bool one_at_a_time, OnDurable on_durable,
                             OnIdle on_idle)
    : engine_(std::move(engine)),
      epoch_(epoch),
      budget_(std::move(budget)),
      one_at_a_time_(one_at_a_time),
      on_durable_(std::move(on_durable)),
      on_idle_(std::move(on_idle)),
      durable_(engine_->last_journal_sequence()),
      thread_([this] { run(); }) {}

JournalWriter::~JournalWriter() { stop(); }

Status JournalWriter::submit(storage::JournalRecord record, Done done) {
  stamp(record);
  const std::size_t bytes = queue_bytes(record);
  const MutexLock lock(mutex_);
  if (stopping_) return {Reason::SHUTTING_DOWN, "the map takes no more records"};
  if (!health_.ok()) return health_;
  if (!budget_->try_charge(storage::Share::kQueues, bytes))
    return {Reason::BUDGET_EXCEEDED, "the queue of keyframes waiting to be applied is full"};
  queue_.push_back({std::move(record), std::move(done), bytes, std::chrono::steady_clock::now()});
  wake_.notify_all();
  return {};
}

void JournalWriter::run() {
  MutexLock lock(mutex_);
  for (;;) {
    wake_.wait(mutex_, [&]() RELMAP_REQUIRES(mutex_) {
      const bool turn = !one_at_a_time_ || finished_ >= durable_;
      return (turn && !queue_.empty()) || stopping_ || !health_.ok();
    });
    if (!health_.ok()) {
      std::vector<Queued> refused = std::exchange(queue_, {});
      const Status why = health_;
      lock.unlock();
      refuse(std::move(refused), why);
      on_idle_();
      lock.lock();
      if (wake_.wait_for(mutex_, kAskAgain, [this]() RELMAP_REQUIRES(mutex_) { return stopping_; })) return;
      lock.unlock();
      const Status now = append({}).status();
      lock.lock();
      set_health(now);
      continue;
    }
    // Written now, the queue would precede what still follows from the record that is being applied.
    if (stopping_ && one_at_a_time_) {
      std::vector<Queued> left = std::exchange(queue_, {});
      lock.unlock();
      return refuse(std::move(left), {Reason::SHUTTING_DOWN, "the map takes no more records"});
    }
    if (queue_.empty()) return;
    std::vector<Queued> group;
    if (one_at_a_time_) {
      group.push_back(std::move(queue_.front()));
      queue_.erase(queue_.begin());
    } else {
      group.swap(queue_);
    }
    writing_ = true;
    in_group_ = group.size();
    lock.unlock();
    write(std::move(group));
    lock.lock();
    writing_ = false;
    in_group_ = 0;
    lock.unlock();
    on_idle_();
    lock.lock();
  }
}

void JournalWriter::write(std::vector<Queued> group) {
  const Result<std::uint64_t> last = append(group);
  {
    const MutexLock lock(mutex_);
    set_health(last.status());
    if (last.ok()) durable_ = *last;
  }
  if (!last.ok()) return refuse(std::move(group), last.status());
  const auto now = std::chrono::steady_clock::now();
  for (const Queued& queued : group)
    if (std::holds_alternative<storage::KeyframeRecord>(queued.record)) acknowledgements_.add(now - queued.submitted);
  const std::uint64_t first = *last - group.size() + 1;
  std::vector<DurableRecord> durable;
  durable.reserve(group.size());
  for (std::size_t i = 0; i < group.size(); ++i)
    durable.push_back({first + i, std::move(group[i].record), group[i].bytes});
  on_durable_(std::move(durable));
  {
    const MutexLock lock(mutex_);
    in_group_ = 0;
  }
  for (std::size_t i = 0; i < group.size(); ++i) group[i].done(first + i);
}

Result<std::uint64_t> JournalWriter::append(std::span<const Queued> group) try {
  std::vector<Bytes> records;
  records.reserve(group.size());
  const std::uint64_t acknowledged = durable_through();
  for (const Queued& queued : group) records.push_back(storage::encode_record(queued.record, acknowledged));
  return append_to_engine(records);
} catch (const std::exception&) {
  return caught_status();
}

Result<std::uint64_t> JournalWriter::append_to_engine(std::span<const Bytes> records) {
  const BusySince::Work work(busy_);
  const auto begun = std::chrono::steady_clock::now();
  auto appended = engine_->append(epoch_, records);
  if (!records.empty()) appends_.add(std::chrono::steady_clock::now() - begun);
  return appended;
}

void JournalWriter::refuse(std::vector<Queued> group, const Status& why) {
  for (Queued& queued : group) {
    budget_->release(storage::Share::kQueues, queued.bytes);
    queued.done(why);
  }
}

// Call with mutex_ held.
void JournalWriter::set_health(const Status& status) {
  if (status.ok() != health_.ok()) {
    if (status.ok())
      spdlog::info("the journal takes records again");
    else
      spdlog::error("the journal takes no records: {}", status.to_string());
  }
  health_ = status;
  wake_.notify_all();
}

Result<std::uint64_t> JournalWriter::append_follow_up(const storage::JournalRecord& record) {
  const Bytes bytes = storage::encode_record(record, durable_through());
  auto sequence = append_to_engine(std::span(&bytes, 1));
  const MutexLock lock(mutex_);
  set_health(sequence.status());
  if (sequence.ok()) durable_ = *sequence;
  return sequence;
}

void JournalWriter::finished(std::uint64_t sequence) {
  const MutexLock lock(mutex_);
  finished_ = std::max(finished_, sequence);
  wake_.notify_all();
}

std::uint64_t JournalWriter::durable_through() const {
  const MutexLock lock(mutex_);
  return durable_;
}

bool JournalWriter::idle() const {
  const MutexLock lock(mutex_);
  return queue_.empty() && !writing_;
}

std::size_t JournalWriter::waiting() const {
  const MutexLock lock(mutex_);
  return queue_.size() + in_group_;
}

Status JournalWriter::health() const {
  const MutexLock lock(mutex_);
  return health_;
}

void JournalWriter::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

}  // namespace relmap::map
