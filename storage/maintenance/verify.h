// Reads all that a map holds on disk and says what is wrong with it: wrong checksums, impossible numbers, references
// that lead nowhere, and everything derived that does not follow from the facts.
//
// Beside a running daemon it sees the last commit and disturbs nobody: its reads bypass the chunk cache, and it holds
// `memory_bytes` at most, whatever the size of the map (apart from about one byte a frame that says which frames
// exist).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "proto/base/status.h"
#include "storage/engine/engine.h"
#include "storage/maintenance/finding.h"
#include "storage/map/map.h"
#include "storage/memory/budget.h"

namespace relmap::storage {

struct Difference;  // recount.h

struct VerifyOptions {
  std::vector<SessionNumber> sessions;               // only their frames; empty: all
  std::size_t memory_bytes = std::size_t{32} << 20;  // for decoded chunks, and for what is counted again
};

// The options for a verification that is charged to `share`: with at most half of the memory that the share allows, so
// that it does not take all from the others that are charged to it.
VerifyOptions beside_others(VerifyOptions options, const Budget& budget, Share share);

struct VerifySummary {
  std::uint64_t sessions = 0;
  std::uint64_t frames = 0;
  std::uint64_t edges = 0;
  std::uint64_t landmarks = 0;
  std::uint64_t observations = 0;
  std::uint64_t features = 0;  // of appearance
  std::uint64_t journal_records = 0;
  std::uint64_t findings = 0;
  std::size_t peak_bytes = 0;  // the most memory that was held at a time, as counted
  bool complete = true;        // false: stopped by on_progress
};

// Verifies the last commit of the view. Damage is a finding, not an error; IO_ERROR only if nothing can be read at all.
Result<VerifySummary> verify(const MapView& view, const VerifyOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress);
// The same for a snapshot: for a map whose sessions or state are too damaged to be opened, and for callers that do not
// want to hold a view (and what is dirty in it) for so long.
Result<VerifySummary> verify(const EngineSnapshot& snapshot, const VerifyOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress);

// The same for what corrects derived items (rebuild.h): also reports what each wrong one should be.
using OnDifference = std::function<void(const Difference&)>;
Result<VerifySummary> verify(const EngineSnapshot& snapshot, const VerifyOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress, const OnDifference& on_difference);

// Verifies every record of the journal from applied_sequence + 1 on: whole, decodable, contiguous.
Result<VerifySummary> verify_journal(const Engine& engine, const OnFinding& on_finding, const OnProgress& on_progress);

}  // namespace relmap::storage
