#include "server/intake/reassembly.h"

#include <algorithm>
#include <string>
#include <utility>

#include "proto/base/crc32c.h"

namespace relmap::intake {

namespace {
constexpr std::size_t kOverhead = 512;  // approximate memory of an assembly without its bytes
}

ReassemblyCharge Reassembly::take_room(std::size_t bytes) {
  for (;;) {
    auto charge = ReassemblyCharge::take(budget_, bytes);
    if (charge) return charge;
    const auto largest = std::max_element(holders_.begin(), holders_.end(),
                                          [](const auto& a, const auto& b) { return a.second.bytes < b.second.bytes; });
    const std::size_t held = largest == holders_.end() ? 0 : largest->second.bytes;
    if (!others_ || !others_(held)) {
      if (held == 0) return charge;
      drop(assemblies_.find(largest->second.ages.front()));
    }
    ++evicted_;
  }
}

Reassembly::Assemblies::iterator Reassembly::begin_assembly(const Key& key, const KeyframePart& part,
                                                            const Party& holder) {
  const std::size_t bytes = part.total_bytes + kOverhead;
  auto charge = take_room(bytes);
  if (!charge) return assemblies_.end();
  const auto held = holders_.try_emplace(holder).first;
  held->second.bytes += bytes;
  const auto age = held->second.ages.insert(held->second.ages.end(), key);
  return assemblies_.emplace(key, Assembly{PartAssembly(part), std::move(charge), bytes, held, age}).first;
}

Reassembly::Assemblies::iterator Reassembly::drop(Assemblies::iterator it) {
  const auto held = it->second.holder;
  held->second.bytes -= it->second.bytes;
  held->second.ages.erase(it->second.age);
  if (held->second.ages.empty()) holders_.erase(held);
  return assemblies_.erase(it);
}

Result<std::optional<Reassembly::Payload>> Reassembly::add(const KeyframePart& part, const Party& holder) {
  const Key key{part.session, part.sequence, part.payload_crc};
  auto it = assemblies_.find(key);
  if (it != assemblies_.end() && !it->second.parts.fits(part)) {
    drop(it);
    it = assemblies_.end();
  }
  if (it == assemblies_.end()) it = begin_assembly(key, part, holder);
  if (it == assemblies_.end()) return {Reason::BUDGET_EXCEEDED, "no room to put keyframes together"};

  Assembly& assembly = it->second;
  std::list<Key>& ages = assembly.holder->second.ages;
  ages.splice(ages.end(), ages, assembly.age);
  if (!assembly.parts.add(part)) return std::optional<Payload>();

  Payload payload{part.payload_crc, std::move(assembly.parts.bytes()), std::move(assembly.charge)};
  drop(it);
  if (crc32c(payload.bytes) != payload.crc)
    return {Reason::CORRUPT, "keyframe " + std::to_string(part.sequence) + " fails its checksum"};
  return std::optional<Payload>(std::move(payload));
}

bool Reassembly::has_incomplete(const SessionUuid& session) const {
  const auto it = assemblies_.lower_bound({session, 0, 0});
  return it != assemblies_.end() && std::get<0>(it->first) == session;
}

std::vector<std::uint32_t> Reassembly::incomplete(const SessionUuid& session) const {
  std::vector<std::uint32_t> sequences;
  for (auto it = assemblies_.lower_bound({session, 0, 0}); it != assemblies_.end(); ++it) {
    if (std::get<0>(it->first) != session) break;
    const std::uint32_t sequence = std::get<1>(it->first);
    if (sequences.empty() || sequences.back() != sequence) sequences.push_back(sequence);
  }
  return sequences;
}

std::vector<MissingParts> Reassembly::missing(const SessionUuid& session) const {
  std::vector<MissingParts> all;
  std::size_t listed = 0;
  for (auto it = assemblies_.lower_bound({session, 0, 0}); it != assemblies_.end(); ++it) {
    const auto& [uuid, sequence, crc] = it->first;
    if (uuid != session || all.size() == kMaxAckIncomplete || listed == kMaxAckParts) break;
    MissingParts missing{sequence, crc, {}};
    const std::vector<bool>& present = it->second.parts.present();
    for (std::uint32_t i = 0; i < present.size() && listed < kMaxAckParts; ++i) {
      if (present[i]) continue;
      missing.parts.push_back(i);
      ++listed;
    }
    all.push_back(std::move(missing));
  }
  return all;
}

void Reassembly::forget(const SessionUuid& session, std::uint64_t below) {
  for (auto it = assemblies_.lower_bound({session, 0, 0}); it != assemblies_.end();) {
    if (std::get<0>(it->first) != session || std::get<1>(it->first) >= below) break;
    it = drop(it);
  }
}

}  // namespace relmap::intake
