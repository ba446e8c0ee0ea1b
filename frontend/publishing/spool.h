// Keyframes of one session until the daemon has settled them.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "proto/base/map_identity.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::publishing {

// Single-threaded.
class Spool {
 public:
  struct Entry {
    std::uint32_t crc = 0;  // of the payload
    std::uint32_t bytes = 0;
  };

  virtual ~Spool() = default;

  const SessionHeader& session() const { return session_; }
  const std::map<std::uint32_t, Entry>& keyframes() const { return keyframes_; }
  const std::vector<Gap>& gaps() const { return gaps_; }  // in the order in which they were declared

  // The map that the session is in; not known: no daemon has said it yet.
  const MapIdentity& map() const { return map_; }
  virtual Status set_map(const MapIdentity& map) = 0;

  // Another run of the source would give other keyframes under the same sequences: the tracking was begun in its midst,
  // or pairs were dropped since it could not wait.
  virtual Status mark_unrepeatable() { return {}; }

  // As safe as it gets when they return. IO_ERROR.
  virtual Status append(std::uint32_t sequence, ByteSpan payload, std::uint32_t crc) = 0;
  virtual Status append_gap(const Gap& gap) = 0;

  // NO_SUCH_FRAME, IO_ERROR; CORRUPT if it has changed.
  virtual Result<Bytes> read(std::uint32_t sequence) const = 0;

  // What lies below `sequence` is not wanted any more.
  virtual Status remove_below(std::uint64_t sequence) = 0;

 protected:
  SessionHeader session_;
  std::map<std::uint32_t, Entry> keyframes_;
  std::vector<Gap> gaps_;
  MapIdentity map_;
};

}  // namespace relmap::publishing
