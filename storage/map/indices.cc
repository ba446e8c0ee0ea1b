#include "storage/map/indices.h"

#include <set>

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {
namespace {

using Entries = std::set<std::pair<std::string, FrameId>>;

Entries committed(const EngineSnapshot& snapshot, const std::string& prefix) {
  Entries entries;
  const Status status = snapshot.scan(prefix, [&](std::string_view key, ByteSpan) {
    if (auto entry = keys::label_of(key)) entries.emplace(std::move(entry->label), entry->frame);
    return true;
  });
  throw_if(status);
  return entries;
}

}  // namespace

std::vector<FrameId> frames_labelled(const EngineSnapshot& snapshot, const LabelChanges& changes,
                                     const std::string& label) {
  Entries entries = committed(snapshot, keys::labelled(label));
  for (auto it = changes.lower_bound({label, {}}); it != changes.end() && it->first.first == label; ++it) {
    if (it->second)
      entries.insert(it->first);
    else
      entries.erase(it->first);
  }
  std::vector<FrameId> frames;
  for (const auto& entry : entries) frames.push_back(entry.second);
  return frames;
}

std::vector<std::string> labels_beginning(const EngineSnapshot& snapshot, const LabelChanges& changes,
                                          const std::string& prefix) {
  Entries entries = committed(snapshot, keys::labels_beginning(prefix));
  for (auto it = changes.lower_bound({prefix, {}}); it != changes.end() && it->first.first.starts_with(prefix); ++it) {
    if (it->second)
      entries.insert(it->first);
    else
      entries.erase(it->first);
  }
  std::vector<std::string> labels;
  for (const auto& entry : entries)
    if (labels.empty() || labels.back() != entry.first) labels.push_back(entry.first);
  return labels;
}

void visit_skipped(const EngineSnapshot& snapshot, const SkippedTable& since, SessionNumber session,
                   std::uint32_t sequence, const Graph::SkippedVisit& visit) {
  bool going = true;
  const Status scanned = snapshot.scan_from(
      keys::skipped_in(session), keys::skipped(session, sequence), [&](std::string_view key, ByteSpan value) {
        const auto skipped = decode_skipped(value);
        if (!skipped.ok() || keys::skipped(session, skipped->to) != key)
          throw StatusError(Status(Reason::DATA_LOSS, "skipped sequences of session " + std::to_string(session) + ": " +
                                                          skipped.status().to_string()));
        if (const auto changed = since.find({session, skipped->to}); changed != since.end() && !changed->second)
          return true;  // removed
        return going = visit(*skipped);
      });
  throw_if(scanned);
  for (auto it = since.lower_bound({session, sequence}); going && it != since.end() && it->first.first == session; ++it)
    if (it->second) going = visit(*it->second);
}

}  // namespace relmap::storage
