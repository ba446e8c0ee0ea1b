// Stores the keyframes of one session until the daemon has settled them.
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

  // The map that the session is in; not known before a daemon has said it.
  const MapIdentity& map() const { return map_; }
  virtual Status set_map(const MapIdentity& map) = 0;

  // Notes that another run of the source would give other keyframes under the same sequences, since tracking started in
  // the middle of it, or pairs may have been dropped.
  virtual Status mark_unrepeatable() { return {}; }

  // When they return, the record is as durable as the spool can make it. IO_ERROR.
  virtual Status append(std::uint32_t sequence, ByteSpan payload, std::uint32_t crc) = 0;
  virtual Status append_gap(const Gap& gap) = 0;

  // Returns a keyframe's payload. NO_SUCH_FRAME, IO_ERROR; CORRUPT if it has changed.
  virtual Result<Bytes> read(std::uint32_t sequence) const = 0;

  // Keyframes and gaps below `sequence` are no longer needed and may be removed.
  virtual Status remove_below(std::uint64_t sequence) = 0;

 protected:
  SessionHeader session_;
  std::map<std::uint32_t, Entry> keyframes_;
  std::vector<Gap> gaps_;
  MapIdentity map_;
};

}  // namespace relmap::publishing
