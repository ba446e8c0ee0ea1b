#include "storage/maintenance/repair.h"

#include "storage/maintenance/digest_check.h"
#include "storage/maintenance/mend.h"
#include "storage/maintenance/quarantine.h"
#include "storage/maintenance/rebuild.h"
#include "storage/maintenance/rewrite.h"
#include "storage/maintenance/verify.h"
#include "storage/map/map.h"

namespace relmap::storage {
namespace {

class Repair {
 public:
  Repair(const std::shared_ptr<Engine>& engine, const std::string& quarantine, const RepairOptions& options,
         const OnFinding& on_finding, const OnProgress& on_progress)
      : engine_(engine),
        quarantine_(quarantine),
        options_(options),
        verify_options_{{}, options.memory_bytes / 2},
        on_finding_(on_finding),
        on_progress_(on_progress) {}

  RepairSummary run() {
    if (verified({}) == 0) return summary_;
    epoch_ = engine_->acquire().or_throw();
    find_wrong_digests();
    throw_if(rewrite_broken_parts(*engine_, epoch_, quarantine_, summary_, on_finding_, on_progress_));
    {
      const auto map = open();
      mend_references(*map, options_.memory_bytes / 8, summary_, on_finding_, on_progress_);
      throw_if(map->commit());
    }
    {
      const auto map = open();
      std::uint64_t rebuilt = 0;
      const auto count = [&](const Finding& finding) {
        ++rebuilt;
        if (on_finding_) on_finding_(finding);
      };
      const auto done = rebuild_derived(*map, *engine_, options_.memory_bytes, count, on_progress_);
      if (!done.ok() && done.reason() != Reason::INTERNAL)
        throw StatusError(done.status());  // INTERNAL shows in `remaining`
      summary_.changed = summary_.changed || rebuilt > 0;
      summary_.rebuilt += rebuilt;
    }
    rebuild_digests();
    summary_.remaining = verified(on_finding_);
    if (quarantine_.used()) summary_.quarantine = quarantine_.directory();
    return summary_;
  }

 private:
  // Before anything is rewritten: then the digests are those of an earlier commit.
  void find_wrong_digests() {
    const auto tell = [&](Finding finding) {
      finding.repaired = true;
      if (on_finding_) on_finding_(finding);
    };
    wrong_digests_ = check_digests(*engine_->snapshot(), tell, on_progress_);
    summary_.changed = summary_.changed || wrong_digests_ > 0;
    summary_.rebuilt += wrong_digests_;
  }
  void rebuild_digests() {
    const auto map = open();
    if (map->digests_hold() && wrong_digests_ == 0) return;
    throw_if(map->rebuild_digests([&](std::uint64_t done, std::uint64_t total) {
      return !on_progress_ || on_progress_({"making digests", done, total, "frames"});
    }));
  }
  std::uint64_t verified(const OnFinding& on_finding) {
    const auto summary = verify(*engine_->snapshot(), verify_options_, on_finding, on_progress_).or_throw();
    if (!summary.complete)
      throw StatusError(Status(Reason::SHUTTING_DOWN, "the repair was stopped; it can be run again"));
    return summary.findings;
  }
  std::unique_ptr<Map> open() {
    return Map::open(engine_, epoch_, std::make_shared<Budget>(options_.memory_bytes)).or_throw();
  }

  const std::shared_ptr<Engine>& engine_;
  Quarantine quarantine_;
  const RepairOptions& options_;
  const VerifyOptions verify_options_;
  const OnFinding& on_finding_;
  const OnProgress& on_progress_;
  std::uint64_t epoch_ = 0, wrong_digests_ = 0;
  RepairSummary summary_;
};

}  // namespace

Result<RepairSummary> repair(const std::shared_ptr<Engine>& engine, const std::string& quarantine,
                             const RepairOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress) try {
  return Repair(engine, quarantine, options, on_finding, on_progress).run();
} catch (const StatusError& error) {
  return error.status();
}

}  // namespace relmap::storage
