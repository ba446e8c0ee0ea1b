// A fake journal and map for tests of ingest. Records become durable when the test says so; a crash loses the others.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/intake/keyframe_sink.h"
#include "storage/map/dirty_table.h"
#include "storage/testing/partial_graph.h"

namespace relmap::intake {

// The part of a map that ingest reads, made of the durable records. Immutable once published.
class FakeGraph final : public storage::PartialGraph {
 public:
  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    before_reading(id.session, false);
    const auto it = frames.find(id);
    return it == frames.end() ? nullptr : it->second;
  }
  std::vector<storage::Session> all_sessions() const override {
    std::vector<storage::Session> all;
    for (const auto& [number, session] : by_number) all.push_back(session);
    return all;
  }
  std::optional<storage::Session> session(SessionNumber number) const override {
    before_reading(number, true);
    const auto it = by_number.find(number);
    return it == by_number.end() ? std::nullopt : std::optional(it->second);
  }
  void visit_skipped(SessionNumber number, std::uint32_t sequence, const SkippedVisit& visit) const override {
    for (auto it = settled.lower_bound({number, sequence}); it != settled.end() && it->first.first == number; ++it)
      if (!visit(*it->second)) return;
  }

  std::function<void(SessionNumber, bool record)> before_reading = [](SessionNumber, bool) {};
  std::map<FrameId, std::shared_ptr<const storage::FrameHot>> frames;
  std::map<SessionNumber, storage::Session> by_number;
  storage::SkippedTable settled;
};

// Thread-safe except for the public members.
class FakeSink final : public KeyframeSink {
 public:
  std::size_t capacity = 1000;      // maximum number of queued records
  bool sync_at_once = false;        // records become durable within submit()
  Status refuse_submit;             // not ok: submit() returns this
  Status refuse_begin;              // not ok: begin_session() returns this for new sessions
  std::vector<std::string> faults;  // contract violations by the intake

  bool begin_slowly = false;  // begin_session() answers only when let_begin() is called

  void begin_session(const SessionHeader& header, Begun begun) override {
    if (!begin_slowly) return begun(begin_now(header));
    const std::lock_guard lock(mutex_);
    beginning_.emplace_back(header, std::move(begun));
  }
  std::optional<SessionNumber> find_session(const SessionUuid& uuid) const override {
    const std::lock_guard lock(mutex_);
    return number_of(uuid);
  }
  // Answers all sessions that are beginning.
  void let_begin() {
    std::vector<std::pair<SessionHeader, Begun>> beginning;
    {
      const std::lock_guard lock(mutex_);
      beginning.swap(beginning_);
    }
    for (const auto& [header, begun] : beginning) begun(begin_now(header));
  }

  Status submit(storage::JournalRecord record, Done done) override {
    {
      const std::lock_guard lock(mutex_);
      if (!refuse_submit.ok()) return refuse_submit;
      if (queue_.size() >= capacity) return {Reason::BUDGET_EXCEEDED, "the queue is full"};
      queue_.emplace_back(std::move(record), std::move(done));
    }
    if (sync_at_once) sync();
    return {};
  }

  std::shared_ptr<const void> hold_session(SessionNumber session) override {
    const std::lock_guard lock(mutex_);
    held_.insert(session);
    return {nullptr, [this, session](const void*) {
              const std::lock_guard let_go(mutex_);
              held_.erase(held_.find(session));
              if (!held_.contains(session)) in_memory_.erase(session);
            }};
  }
  std::shared_ptr<const storage::Graph> view() const override {
    const std::lock_guard lock(mutex_);
    if (lagging_) return lagging_;
    auto graph = std::make_shared<FakeGraph>(graph_);
    graph->before_reading = [this](SessionNumber session, bool record) {
      std::unique_lock reading(mutex_);
      if (record && in_memory_.contains(session)) return;
      if (session == hanging_) ++reading_;
      readable_.wait(reading, [&] { return session != hanging_; });
      if (record && held_.contains(session)) in_memory_.insert(session);
    };
    return graph;
  }
  std::size_t free_bytes() const override {
    const std::lock_guard lock(mutex_);
    return (capacity - std::min(capacity, queue_.size())) << 18;
  }

  // Makes the first `count` records durable.
  void sync(std::size_t count = SIZE_MAX) { finish(count, {}); }
  // Refuses all queued records, as a disk that takes nothing more.
  void fail(const Status& why) { finish(SIZE_MAX, why); }
  // Loses the queued records without calling `done`.
  void crash() {
    const std::lock_guard lock(mutex_);
    queue_.clear();
    lagging_.reset();
  }
  // Reading what the map has of this session hangs until the next call; 0: of none.
  void let_hang(SessionNumber session) {
    const std::lock_guard lock(mutex_);
    hanging_ = session;
    reading_ = 0;
    readable_.notify_all();
  }
  // How many readers hang.
  int reading() const {
    const std::lock_guard lock(mutex_);
    return reading_;
  }
  // The view shows nothing newer until thaw_view().
  void freeze_view() {
    const std::lock_guard lock(mutex_);
    lagging_ = std::make_shared<FakeGraph>(graph_);
  }
  void thaw_view() {
    const std::lock_guard lock(mutex_);
    lagging_.reset();
  }

  // Changes the state as an operator's edit does.
  void set_state(SessionNumber number, storage::SessionState state) {
    const std::lock_guard lock(mutex_);
    apply(storage::SetSessionStateRecord{number, state});
  }

  void remove_frame(FrameId frame) {
    const std::lock_guard lock(mutex_);
    graph_.frames.erase(frame);
  }

  std::size_t queued() const {
    const std::lock_guard lock(mutex_);
    return queue_.size();
  }
  std::vector<storage::JournalRecord> journal() const {
    const std::lock_guard lock(mutex_);
    return journal_;
  }
  // Loses the last `records` durable records, as a disk that lied about a sync.
  void forget_durable(std::size_t records) {
    const std::lock_guard lock(mutex_);
    std::vector<storage::JournalRecord> kept(journal_.begin(), journal_.end() - static_cast<std::ptrdiff_t>(records));
    journal_.clear();
    queue_.clear();
    graph_.frames.clear();
    graph_.settled.clear();
    for (auto& [number, session] : graph_.by_number) {
      session.next_sequence = 0;
      session.frames = 0;
    }
    for (const storage::JournalRecord& record : kept) apply(record);
  }

 private:
  std::optional<SessionNumber> number_of(const SessionUuid& uuid) const {
    for (const auto& [number, session] : graph_.by_number)
      if (session.header.uuid == uuid) return number;
    return std::nullopt;
  }
  Result<SessionNumber> begin_now(const SessionHeader& header) {
    const std::lock_guard lock(mutex_);
    if (const auto number = number_of(header.uuid)) return *number;
    if (!refuse_begin.ok()) return refuse_begin;
    storage::Session session;
    session.number = static_cast<SessionNumber>(graph_.by_number.size() + 1);
    session.header = header;
    graph_.by_number[session.number] = session;
    return session.number;
  }

  void finish(std::size_t count, const Status& outcome) {
    std::vector<std::pair<Done, Result<std::uint64_t>>> said;
    {
      const std::lock_guard lock(mutex_);
      while (count-- > 0 && !queue_.empty()) {
        auto [record, done] = std::move(queue_.front());
        queue_.pop_front();
        if (outcome.ok()) {
          apply(record);
          said.emplace_back(std::move(done), std::uint64_t{journal_.size()});
        } else {
          said.emplace_back(std::move(done), outcome);
        }
      }
    }
    for (const auto& [done, result] : said) done(result);
  }

  void apply(const storage::JournalRecord& record) {
    journal_.push_back(record);
    if (const auto* keyframe = std::get_if<storage::KeyframeRecord>(&record)) {
      const Result<Keyframe> decoded = decode_keyframe(keyframe->payload);
      if (!decoded.ok()) return fault("an undecodable keyframe in the journal");
      storage::Session& session = graph_.by_number.at(keyframe->session);
      auto hot = std::make_shared<storage::FrameHot>();
      hot->present = true;
      hot->payload_crc = keyframe->crc;
      graph_.frames[{keyframe->session, decoded->sequence}] = hot;
      ++session.frames;
      if (session.state == storage::SessionState::kEnded) session.state = storage::SessionState::kOpen;
      session.last_time_us = decoded->time_us;
      settle(session, decoded->sequence, decoded->sequence);
    } else if (const auto* gap = std::get_if<storage::GapRecord>(&record)) {
      storage::Session& session = graph_.by_number.at(gap->session);
      graph_.settled[{gap->session, gap->to}] = storage::Skipped{gap->from, gap->to, 0, false, gap->reason};
      settle(session, gap->from, gap->to);
    } else if (const auto* refusal = std::get_if<storage::RefusalRecord>(&record)) {
      storage::Session& session = graph_.by_number.at(refusal->session);
      graph_.settled[{refusal->session, refusal->sequence}] =
          storage::Skipped{refusal->sequence, refusal->sequence, refusal->crc, true, refusal->reason};
      settle(session, refusal->sequence, refusal->sequence);
    } else if (const auto* state = std::get_if<storage::SetSessionStateRecord>(&record)) {
      graph_.by_number.at(state->session).state = state->state;
    }
  }

  void settle(storage::Session& session, std::uint32_t from, std::uint32_t to) {
    if (from != session.next_sequence)
      fault("sequence " + std::to_string(from) + " settled when " + std::to_string(session.next_sequence) +
            " was next");
    session.next_sequence = to + 1;
  }
  void fault(std::string what) { faults.push_back(std::move(what)); }

  mutable std::mutex mutex_;
  mutable std::condition_variable readable_;
  SessionNumber hanging_ = 0;
  mutable int reading_ = 0;
  std::multiset<SessionNumber> held_;
  mutable std::set<SessionNumber> in_memory_;  // of these, those whose records were read
  FakeGraph graph_;
  std::shared_ptr<const FakeGraph> lagging_;
  std::deque<std::pair<storage::JournalRecord, Done>> queue_;
  std::vector<storage::JournalRecord> journal_;
  std::vector<std::pair<SessionHeader, Begun>> beginning_;
};

}  // namespace relmap::intake
