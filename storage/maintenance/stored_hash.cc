#include "storage/maintenance/stored_hash.h"

#include "storage/graph/forwarding_graph.h"
#include "storage/maintenance/stored_graph.h"
#include "storage/maintenance/stored_sessions.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kCacheBytes = std::size_t{16} << 20;

[[noreturn]] void lost(const std::string& what) { throw StatusError(Status(Reason::DATA_LOSS, what)); }

// Gives frames that are asked for in order, a chunk at a time. Throws where something is damaged.
class WholeGraph final : public ForwardingGraph<Graph> {
 public:
  using Progress = std::function<Status(std::uint64_t done, std::uint64_t total)>;

  WholeGraph(const EngineSnapshot& snapshot, const StoredGraph& stored, const Progress& progress)
      : ForwardingGraph(stored), snapshot_(snapshot), stored_(stored), progress_(progress) {
    for (const Session& session : stored_.sessions()) total_ += session.frames;
  }

  std::shared_ptr<const FrameHot> hot(FrameId id) const override {
    const auto part = stored_.hot_chunk(chunk_id(id));
    if (!part->damage.empty()) lost(part->damage.front().what);
    const auto& frame = part->frames[slot_of(id)];
    if (frame && progress_ && done_++ % kFramesPerChunk == 0)
      if (Status going = progress_(done_, total_); !going.ok()) throw StatusError(going);
    return frame;
  }
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override {
    auto frame = in(warm_, id);
    return frame ? frame : std::make_shared<const FrameWarm>();
  }
  std::shared_ptr<const FrameCold> cold(FrameId id) const override {
    FrameCold frame;
    if (const auto cold = in(cold_, id)) frame = *cold;
    if (const auto words = in(words_, id)) frame.words = *words;
    return std::make_shared<const FrameCold>(std::move(frame));
  }

 private:
  template <typename Frame>
  std::shared_ptr<const Frame> in(StoredPart<Frame>& part, FrameId id) const {
    const ChunkId chunk = chunk_id(id);
    if (part.id != chunk || part.keys.empty()) part = load_part<Frame>(snapshot_, chunk);
    if (!part.damage.empty()) lost(part.damage.front().what);
    return part.frames[slot_of(id)];
  }

  const EngineSnapshot& snapshot_;
  const StoredGraph& stored_;
  const Progress& progress_;
  std::uint64_t total_ = 0;
  mutable std::uint64_t done_ = 0;
  mutable StoredPart<FrameWarm> warm_;
  mutable StoredPart<FrameCold> cold_;
  mutable StoredPart<FrameWords> words_;
};

}  // namespace

Result<MapHash> hash_stored(const EngineSnapshot& snapshot,
                            const std::function<Status(std::uint64_t done, std::uint64_t total)>& progress) try {
  StoredSessions stored = load_sessions(snapshot);
  if (!stored.damage.empty()) lost(stored.damage.front().what);
  if (!stored.unknown.empty()) lost("record of session " + std::to_string(stored.unknown.front()) + ": missing");
  const StoredGraph graph(snapshot, std::move(stored.sessions), kCacheBytes);
  return hash_map(WholeGraph(snapshot, graph, progress));
} catch (const StatusError& error) {
  return error.status();
}

}  // namespace relmap::storage
