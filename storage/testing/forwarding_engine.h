// Forwards every call to another engine: the base of engines that tests put before another one to alter some calls.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "storage/engine/engine.h"

namespace relmap::storage {

class ForwardingEngine : public Engine {
 public:
  Result<std::uint64_t> acquire() override { return engine_->acquire(); }
  Result<std::uint64_t> append(std::uint64_t epoch, std::span<const Bytes> records) override {
    return engine_->append(epoch, records);
  }
  Status read_journal(std::uint64_t from,
                      const std::function<bool(std::uint64_t sequence, ByteSpan record)>& visit) const override {
    return engine_->read_journal(from, visit);
  }
  std::uint64_t first_journal_sequence() const override { return engine_->first_journal_sequence(); }
  std::uint64_t last_journal_sequence() const override { return engine_->last_journal_sequence(); }
  Status trim(std::uint64_t through) override { return engine_->trim(through); }
  Status commit(std::uint64_t epoch, std::uint64_t applied_sequence, std::span<const Put> puts,
                std::span<const std::string> deletes) override {
    return engine_->commit(epoch, applied_sequence, puts, deletes);
  }
  std::uint64_t applied_sequence() const override { return engine_->applied_sequence(); }
  std::shared_ptr<const EngineSnapshot> snapshot() const override { return engine_->snapshot(); }
  Result<SessionNumber> allocate_session(std::uint64_t epoch, SessionNumber skipped) override {
    return engine_->allocate_session(epoch, skipped);
  }
  Status checkpoint(const NewFolder& to, const EngineProgress& progress) override {
    return engine_->checkpoint(to, progress);
  }
  Status compact(const EngineProgress& progress) override { return engine_->compact(progress); }
  Result<EngineStats> stats() const override { return engine_->stats(); }
  std::size_t memory_bytes() const override { return engine_->memory_bytes(); }

 protected:
  explicit ForwardingEngine(std::shared_ptr<Engine> to) : engine_(std::move(to)) {}
  Engine& engine() const { return *engine_; }

 private:
  const std::shared_ptr<Engine> engine_;
};

}  // namespace relmap::storage
