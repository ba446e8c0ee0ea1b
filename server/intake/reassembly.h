// Reassembles payloads from parts, in bounded memory. When memory runs out, the holder of most bytes loses the assembly
// that has waited longest for a part; its robot sends it again.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "proto/keyframe/ingest_messages.h"
#include "proto/keyframe/part_assembly.h"
#include "server/intake/reassembly_charge.h"
#include "server/intake/sender.h"

namespace relmap::intake {

// Versions of a keyframe with different checksums are reassembled separately; the caller decides which of them counts.
class Reassembly {
 public:
  // Drops a complete keyframe that waits elsewhere and is charged to the same share: one of the party with most such
  // bytes, if these are more than `more_than`. Returns whether one was dropped.
  using GiveWay = std::function<bool(std::size_t more_than)>;
  Reassembly(storage::Budget& budget, GiveWay others = nullptr) : budget_(budget), others_(std::move(others)) {}

  struct Payload {
    std::uint32_t crc = 0;
    Bytes bytes;
    ReassemblyCharge charge;
  };

  // Adds a part that has passed check_part(). Returns the payload if this was its last part, nullopt while others are
  // missing. `holder` is charged with the memory.
  // CORRUPT if the complete payload fails its checksum (it is dropped), BUDGET_EXCEEDED if there is no room.
  Result<std::optional<Payload>> add(const KeyframePart& part, const Party& holder);

  bool has_incomplete(const SessionUuid& session) const;
  // The session's incomplete sequences, ascending.
  std::vector<std::uint32_t> incomplete(const SessionUuid& session) const;
  // The same with their missing parts, within the limits of an acknowledgement.
  std::vector<MissingParts> missing(const SessionUuid& session) const;

  // Drops the session's sequences below `below`.
  void forget(const SessionUuid& session, std::uint64_t below);

  // Reserves so many bytes; if necessary, the holders of most bytes give way. Empty if there is no room.
  ReassemblyCharge take_room(std::size_t bytes);

  std::size_t size() const { return assemblies_.size(); }
  std::uint64_t evicted() const { return evicted_; }

 private:
  using Key = std::tuple<SessionUuid, std::uint32_t, std::uint32_t>;  // session, sequence, crc
  struct Holder {
    std::size_t bytes = 0;
    std::list<Key> ages;  // assemblies, that which has waited longest for a part first
  };
  using Holders = std::map<Party, Holder>;
  struct Assembly {
    PartAssembly parts;
    ReassemblyCharge charge;
    std::size_t bytes = 0;
    Holders::iterator holder;
    std::list<Key>::iterator age;
  };
  using Assemblies = std::map<Key, Assembly>;

  Assemblies::iterator begin_assembly(const Key& key, const KeyframePart& part, const Party& holder);
  Assemblies::iterator drop(Assemblies::iterator it);

  storage::Budget& budget_;
  const GiveWay others_;
  Assemblies assemblies_;
  Holders holders_;  // those with an assembly
  std::uint64_t evicted_ = 0;
};

}  // namespace relmap::intake
