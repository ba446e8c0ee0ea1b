#include "storage/rocksdb/reclaimer.h"

#include "storage/rocksdb/rocksdb_maintenance.h"

namespace relmap::storage {
namespace {

constexpr std::uint64_t kCommitsPerLook = 32;
constexpr std::uint64_t kMinBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kShare = 2;  // collected at half of what is kept: freeing a byte moves two

}  // namespace

Reclaimer::~Reclaimer() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

bool Reclaimer::due() const {
  using Properties = rocksdb::DB::Properties;
  std::uint64_t all = 0, garbage = 0;
  auto* parts = map_.families().front();
  map_.db().GetIntProperty(parts, Properties::kLiveBlobFileSize, &all);
  map_.db().GetIntProperty(parts, Properties::kLiveBlobFileGarbageSize, &garbage);
  return garbage >= kMinBytes && kShare * garbage >= all - garbage;
}

void Reclaimer::look() {
  if (++commits_ % kCommitsPerLook != 0 || working_ || !due()) return;
  if (thread_.joinable()) thread_.join();
  working_ = true;
  thread_ = std::thread([this] {
    // A failure is the disk's, which commits report too; a later look tries again.
    const std::span parts(map_.families().data(), 1);
    (void)compact_families(map_, parts, [this](std::uint64_t, std::uint64_t) {
      return stopping_ ? Status(Reason::SHUTTING_DOWN, "the map is being closed") : Status();
    });
    working_ = false;
  });
}

}  // namespace relmap::storage
