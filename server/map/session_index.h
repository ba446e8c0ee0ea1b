// All sessions that the map has or had, as far as new ones must know of them: a few bytes each, so that a map of
// millions of sessions is served from little memory. Everything else about a session is read from the map.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/ids.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::map {

// Not thread-safe.
class SessionIndex {
 public:
  void add(const SessionHeader& header, SessionNumber number) {
    entries_.insert(place_of(header.uuid), {header.uuid, number, name_of(header)});
  }
  // For many at once: any order, and sort() at the end.
  void append(const SessionHeader& header, SessionNumber number) {
    entries_.push_back({header.uuid, number, name_of(header)});
  }
  void sort() {
    std::sort(entries_.begin(), entries_.end(), [](const Entry& l, const Entry& r) { return l.uuid < r.uuid; });
  }

  std::optional<SessionNumber> find(const SessionUuid& uuid) const {
    const auto at = place_of(uuid);
    return at != entries_.end() && at->uuid == uuid ? std::optional(at->number) : std::nullopt;
  }
  // The number of sessions of this robot and name.
  std::size_t namesakes(const SessionHeader& header) const {
    const std::uint64_t name = name_of(header);
    return static_cast<std::size_t>(
        std::count_if(entries_.begin(), entries_.end(), [name](const Entry& entry) { return entry.name == name; }));
  }
  std::size_t size() const { return entries_.size(); }

  // Of one session, with room to grow.
  static constexpr std::size_t bytes_each() { return 2 * sizeof(Entry); }

 private:
  struct Entry {
    SessionUuid uuid;
    SessionNumber number = 0;
    std::uint64_t name = 0;  // hash of robot and name
  };

  static std::uint64_t name_of(const SessionHeader& header) {
    return std::hash<std::string>()(header.robot + '\0' + header.name);
  }
  std::vector<Entry>::const_iterator place_of(const SessionUuid& uuid) const {
    return std::lower_bound(entries_.begin(), entries_.end(), uuid,
                            [](const Entry& entry, const SessionUuid& key) { return entry.uuid < key; });
  }

  std::vector<Entry> entries_;  // ascending by uuid
};

}  // namespace relmap::map
