// What the digests of a map should be, from its frames, for comparison with what MapView::visit_digests() visits.
#pragma once

#include <map>

#include "storage/format/digest_codec.h"
#include "storage/map/map.h"

namespace relmap::storage {

// Digests by chunk, as bytes that can be compared.
using DigestsByChunk = std::map<ChunkId, Bytes>;

inline Bytes digest_bytes(const ChunkDigest& digests) {
  DigestWriter writer(digests.id, 0);
  for (const FrameDigest& frame : digests.frames) writer.add(frame);
  return writer.finish();
}

inline DigestsByChunk digests_of_frames(const Graph& graph) {
  DigestsByChunk all;
  for (const Session& session : graph.sessions()) {
    if (session.frames == 0) continue;
    ChunkDigest digests{chunk_id({session.number, session.first}), {}};
    const auto close = [&](ChunkId next) {
      if (!digests.frames.empty()) all[digests.id] = digest_bytes(digests);
      digests = {next, {}};
    };
    for (std::uint64_t index = session.first; index <= session.last; ++index) {
      const FrameId id{session.number, static_cast<std::uint32_t>(index)};
      if (chunk_id(id) != digests.id) close(chunk_id(id));
      if (const auto hot = graph.hot(id)) digests.frames.push_back(as_stored(id, digest_of(id, *hot)));
    }
    close({});
  }
  return all;
}

// Also compares them with what is visited if only closures are asked for.
inline DigestsByChunk digests_visited(const MapView& view, ChunkId from = {}) {
  DigestsByChunk all, closures;
  ChunkId last;
  throw_if(view.visit_digests(from, [&](const ChunkDigest& digests) {
    if (!(last < digests.id) || digests.frames.empty()) throw std::logic_error("digests out of order, or none");
    last = digests.id;
    all[digests.id] = digest_bytes(digests);
    ChunkDigest with_closures = digests;
    std::erase_if(with_closures.frames, [](const FrameDigest& frame) { return frame.closures.empty(); });
    if (!with_closures.frames.empty()) closures[digests.id] = digest_bytes(with_closures);
    return true;
  }));
  throw_if(view.visit_digests(
      from,
      [&](const ChunkDigest& digests) {
        const auto expected = closures.find(digests.id);
        if (expected == closures.end() || expected->second != digest_bytes(digests))
          throw std::logic_error("other closures than in all digests");
        closures.erase(expected);
        return true;
      },
      DigestsOf::kClosures));
  if (!closures.empty()) throw std::logic_error("closures missing");
  return all;
}

}  // namespace relmap::storage
