// What the engine stores besides the journal, with every commit. Private to storage/rocksdb.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "proto/base/bytes.h"
#include "proto/base/ids.h"
#include "proto/base/status.h"

namespace relmap::storage {

// The engine's own keys sort before those of the map, which never begin with a zero byte.
inline constexpr std::string_view kRootKey("\0root", 5);

struct Root {
  std::uint64_t epoch = 0;
  std::uint64_t applied = 0;
  std::uint64_t commits = 0;
  SessionNumber session = 0;

  std::string encode() const {
    ByteWriter w;
    w.put(epoch);
    w.put(applied);
    w.put(commits);
    w.put(session);
    return {w.bytes().begin(), w.bytes().end()};
  }
  static Result<Root> decode(const std::string& bytes) {
    ByteReader r(as_bytes(bytes));
    Root root;
    root.epoch = r.get<std::uint64_t>();
    root.applied = r.get<std::uint64_t>();
    root.commits = r.get<std::uint64_t>();
    root.session = r.get<SessionNumber>();
    if (!r.at_end()) return Status(Reason::DATA_LOSS, "the map's root is damaged");
    return root;
  }
};

}  // namespace relmap::storage
