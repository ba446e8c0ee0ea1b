// Reads all that a map holds on disk and says what is wrong with it: every checksum, every number that cannot be, every
// reference that leads nowhere, and everything derived that does not follow from the facts.
//
// Beside a running daemon it sees the last commit and disturbs nobody: its reads go past the chunk cache, and hold
// `memory_bytes` at most, whatever the size of the map (about one byte a frame aside, for which frames there are).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/base/status.h"
#include "storage/engine/engine.h"
#include "storage/maintenance/finding.h"
#include "storage/map/map.h"

namespace relmap::storage {

struct VerifyOptions {
  std::vector<SessionNumber> sessions;               // only their frames; empty: all
  std::size_t memory_bytes = std::size_t{32} << 20;  // for decoded chunks, and for what is counted again
};

struct VerifySummary {
  std::uint64_t sessions = 0;
  std::uint64_t frames = 0;
  std::uint64_t edges = 0;
  std::uint64_t landmarks = 0;
  std::uint64_t observations = 0;
  std::uint64_t features = 0;  // of appearance
  std::uint64_t journal_records = 0;
  std::uint64_t findings = 0;
  std::size_t peak_bytes = 0;  // of memory held at a time, as counted
  bool complete = true;        // false: stopped by on_progress
};

// What the view's last commit holds. Damage is a finding, not an error; IO_ERROR only if nothing can be read at all.
Result<VerifySummary> verify(const MapView& view, const VerifyOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress);
// The same of a snapshot: for a map whose sessions or state are too damaged to open, and for whoever does not want to
// hold a view (and what is dirty in it) for so long.
Result<VerifySummary> verify(const EngineSnapshot& snapshot, const VerifyOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress);

// Every record of the journal from applied_sequence + 1 on: whole, decodable, contiguous.
Result<VerifySummary> verify_journal(const Engine& engine, const OnFinding& on_finding, const OnProgress& on_progress);

}  // namespace relmap::storage
