#include "storage/maintenance/settled_cursor.h"

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kPage = 1024;

}  // namespace

SettledCursor::SettledCursor(const EngineSnapshot& snapshot, SessionNumber session, Damaged damaged)
    : snapshot_(snapshot), session_(session), damaged_(std::move(damaged)), from_(keys::settled_in(session)) {
  read();
}

void SettledCursor::next() {
  page_.pop_front();
  if (page_.empty()) read();
}

void SettledCursor::read() {
  if (from_.empty()) return;
  const std::string name = "what session " + std::to_string(session_) + " settled without a frame: ";
  const std::string from = std::move(from_);
  from_.clear();
  const Status scanned =
      snapshot_.scan_from(keys::settled_in(session_), from, [&](std::string_view key, ByteSpan value) {
        if (page_.size() == kPage) {
          from_ = key;
          return false;
        }
        const auto settled = decode_settled(value);
        if (settled.ok() && keys::settled(session_, settled->to) == key)
          page_.push_back(*settled);
        else
          damaged_(std::string(key), name + (settled.ok() ? "a record of another" : settled.status().to_string()));
        return true;
      });
  if (!scanned.ok()) damaged_("", name + scanned.to_string());
}

}  // namespace relmap::storage
