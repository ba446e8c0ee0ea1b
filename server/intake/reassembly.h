// Parts become payloads. Bounded bytes: when they run out, who holds most gives way, with what has waited longest for a
// part; it is sent again.
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

namespace relmap::intake {

// Versions of a keyframe with different checksums are put together apart: which of them counts is not decided here.
class Reassembly {
 public:
  // Whole keyframes that wait elsewhere at the same share's expense: lets go of one of who holds most of them, if that
  // is more than so many bytes. False: nobody does.
  using GiveWay = std::function<bool(std::size_t more_than)>;
  Reassembly(storage::Budget& budget, GiveWay others = nullptr) : budget_(budget), others_(std::move(others)) {}

  struct Payload {
    std::uint32_t crc = 0;
    Bytes bytes;
    ReassemblyCharge charge;
  };

  // The payload when this was its last part; nothing while others are missing. The part has passed check_part().
  // `holder`: at whose expense; a session that has begun answers for itself, all others together (nil). CORRUPT: the
  // payload is whole and fails its checksum; it is dropped. BUDGET_EXCEEDED.
  Result<std::optional<Payload>> add(const KeyframePart& part, const SessionUuid& holder);

  bool has_incomplete(const SessionUuid& session) const;
  // Of one session, ascending by sequence.
  std::vector<std::uint32_t> incomplete(const SessionUuid& session) const;
  // The same with the parts that are missing, oldest first, within the limits of an acknowledgement.
  std::vector<MissingParts> missing(const SessionUuid& session) const;

  // Drops what can no longer be used: sequences below `below`, or all.
  void forget(const SessionUuid& session, std::uint64_t below);

  // Room for so many bytes, at the expense of who holds most. Empty: there is none.
  ReassemblyCharge take_room(std::size_t bytes);

  std::size_t size() const { return assemblies_.size(); }
  std::uint64_t evicted() const { return evicted_; }

 private:
  using Key = std::tuple<SessionUuid, std::uint32_t, std::uint32_t>;  // session, sequence, crc
  struct Holder {
    std::size_t bytes = 0;
    std::list<Key> ages;  // the one that has waited longest for a part first
  };
  using Holders = std::map<SessionUuid, Holder>;
  struct Assembly {
    PartAssembly parts;
    ReassemblyCharge charge;
    std::size_t bytes = 0;
    Holders::iterator holder;
    std::list<Key>::iterator age;
  };
  using Assemblies = std::map<Key, Assembly>;

  Assemblies::iterator begin_assembly(const Key& key, const KeyframePart& part, const SessionUuid& holder);
  Assemblies::iterator drop(Assemblies::iterator it);

  storage::Budget& budget_;
  const GiveWay others_;
  Assemblies assemblies_;
  Holders holders_;  // of something
  std::uint64_t evicted_ = 0;
};

}  // namespace relmap::intake
