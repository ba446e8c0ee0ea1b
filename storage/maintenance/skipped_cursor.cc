#include "storage/maintenance/skipped_cursor.h"

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kPage = 1024;

}  // namespace

SkippedCursor::SkippedCursor(const EngineSnapshot& snapshot, SessionNumber session, Damaged damaged)
    : snapshot_(snapshot), session_(session), damaged_(std::move(damaged)), from_(keys::skipped_in(session)) {
  read();
}

void SkippedCursor::next() {
  page_.pop_front();
  if (page_.empty()) read();
}

void SkippedCursor::read() {
  if (from_.empty()) return;
  const std::string name = "skipped sequences of session " + std::to_string(session_) + ": ";
  const std::string from = std::move(from_);
  from_.clear();
  const Status scanned =
      snapshot_.scan_from(keys::skipped_in(session_), from, [&](std::string_view key, ByteSpan value) {
        if (page_.size() == kPage) {
          from_ = key;
          return false;
        }
        const auto skipped = decode_skipped(value);
        if (skipped.ok() && keys::skipped(session_, skipped->to) == key)
          page_.push_back(*skipped);
        else
          damaged_(std::string(key), name + (skipped.ok() ? "a record of another" : skipped.status().to_string()));
        return true;
      });
  if (!scanned.ok()) damaged_("", name + scanned.to_string());
}

}  // namespace relmap::storage
