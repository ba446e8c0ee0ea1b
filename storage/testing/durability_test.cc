// Power failures at random moments: everything for which append() or commit() has returned is there afterwards, once
// and in order.
#include <gtest/gtest.h>

#include <random>

#include "storage/testing/fault_engine.h"
#include "storage/testing/forgetful_files.h"

namespace relmap::storage {
namespace {

Bytes payload(std::uint64_t sequence) {
  ByteWriter w;
  w.put(sequence);
  for (std::uint64_t i = 0; i < sequence % 40; ++i) w.put(sequence * 77 + i);
  return w.take();
}

// Says what is wrong after `crashes` power failures; empty if nothing is.
std::string run(std::uint64_t seed, bool sync, int crashes) {
  std::mt19937_64 rng(seed);
  const auto below = [&](std::uint64_t n) { return std::uniform_int_distribution<std::uint64_t>(0, n - 1)(rng); };
  const auto disk = ForgetfulFiles::create(seed, sync);
  std::uint64_t acknowledged = 0, committed = 0;
  SessionNumber session = 0;
  for (int crash = 0; crash <= crashes; ++crash) {
    const auto opened = open_fault_engine(disk);
    if (!opened.ok()) return "after crash " + std::to_string(crash) + ": " + opened.status().to_string();
    Engine& engine = **opened;

    std::uint64_t next = engine.first_journal_sequence();
    std::string wrong;
    const Status read = engine.read_journal(1, [&](std::uint64_t sequence, ByteSpan record) {
      if (sequence != next++) wrong = "sequence " + std::to_string(sequence) + " out of order";
      if (Bytes(record.begin(), record.end()) != payload(sequence))
        wrong = "record " + std::to_string(sequence) + " is another";
      return wrong.empty();
    });
    if (!read.ok()) return read.to_string();
    if (!wrong.empty()) return wrong;
    if (next - 1 != engine.last_journal_sequence()) return "the journal ends before its last record";
    if (engine.last_journal_sequence() < acknowledged)
      return "acknowledged through " + std::to_string(acknowledged) + ", there through " +
             std::to_string(engine.last_journal_sequence());
    if (engine.applied_sequence() < committed) return "a commit was lost";
    const auto value = engine.snapshot()->get("applied").value();
    if (engine.applied_sequence() > 0 && (!value || *value != payload(engine.applied_sequence())))
      return "a commit is there in part";

    disk->fail_power_after(1 + below(60));
    std::uint64_t last = engine.last_journal_sequence();
    const auto epoch = engine.acquire();
    while (epoch.ok() && disk->has_power()) {
      std::vector<Bytes> records;
      for (std::uint64_t n = 1 + below(4); n > 0; --n) records.push_back(payload(++last));
      if (const auto appended = engine.append(*epoch, records); appended.ok()) {
        if (*appended != last) return "append returned another sequence";
        acknowledged = last;
      } else {
        last -= records.size();
      }
      if (below(5) == 0 && acknowledged > 0) {
        const std::vector<Put> puts{{"applied", payload(acknowledged)}};
        if (engine.commit(*epoch, acknowledged, puts, {}).ok()) {
          committed = acknowledged;
          if (!engine.trim(committed).ok() && disk->has_power()) return "a trim failed";
        }
      }
      if (below(10) == 0) {
        if (const auto number = engine.allocate_session(*epoch); number.ok()) {
          if (*number <= session) return "a session number was given twice";
          session = *number;
        }
      }
    }
    disk->restart();
  }
  return "";
}

TEST(Durability, NothingAcknowledgedIsLostOrDoubledOverTwoHundredCrashes) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) EXPECT_EQ(run(seed, true, 20), "") << "seed " << seed;
}

TEST(Durability, TheCheckCatchesAStoreThatDoesNotSync) {
  int caught = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) caught += run(seed, false, 20).empty() ? 0 : 1;
  EXPECT_EQ(caught, 10);
}

}  // namespace
}  // namespace relmap::storage
