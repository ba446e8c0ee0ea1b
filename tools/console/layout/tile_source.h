// Tiles of layouts by request: kept as long as they are asked for, with what they need from the daemon.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "client/relmap_client.h"
#include "tools/console/layout/keyframe_lines.h"
#include "tools/console/layout/lru_cache.h"
#include "tools/console/layout/single_flight.h"
#include "tools/console/layout/tile_index.h"

namespace relmap::console {

struct TileRequest {
  std::uint64_t version = 0;  // of the layout
  TileId tile;
  std::uint64_t from = 0;         // of an older layout: with the positions there; 0: without
  std::optional<FrameId> root{};  // with standard deviations relative to this frame
};

// Thread-safe.
class TileSource {
 public:
  struct Limits {
    std::size_t tile_bytes = 64u << 20, keyframe_bytes = 96u << 20;
    std::size_t roots = 4;
    std::chrono::milliseconds away{2000};  // for so long a daemon that did not answer is not asked for keyframes again
  };
  explicit TileSource(Limits limits);
  TileSource() : TileSource(Limits()) {}

  // The bytes of a tile of `index`'s layout; null: nothing is there. `old`: the layout of `from`, or null. Keyframes
  // beyond MapLayout::zooms are read through `client`; if that fails, the tile has only the points of the layout, and
  // is made again next time. INVALID_ARGUMENT: there is no such tile. NO_SUCH_FRAME: the root is not in the layout.
  using TileBytes = std::shared_ptr<const std::string>;
  Result<TileBytes> tile(const TileIndex& index, const MapLayout* old, const TileRequest& request,
                         const ClientOf& client);
  // The same, but nullopt where the daemon would be asked.
  Result<std::optional<TileBytes>> tile_at_once(const TileIndex& index, const MapLayout* old,
                                                const TileRequest& request);

  std::size_t bytes() const { return tiles_.bytes() + sigmas_.bytes(); }

 private:
  using Sigmas = std::vector<float>;
  using SigmasOf = std::pair<std::uint64_t, FrameId>;  // version of the layout, root
  Result<std::shared_ptr<const Sigmas>> sigmas_of(const MapLayout& layout, FrameId root);
  // `client`: null where the daemon must not be asked.
  Result<std::optional<TileBytes>> made(const TileIndex& index, const MapLayout* old, const TileRequest& request,
                                        const ClientOf* client);

  const Limits limits_;
  using TileKey = std::tuple<std::uint64_t, TileId, std::uint64_t, FrameId>;
  LruCache<TileKey, std::string> tiles_;
  LruCache<SigmasOf, Sigmas> sigmas_;
  SingleFlight<SigmasOf, Result<std::shared_ptr<const Sigmas>>> sigmas_made_;
  KeyframeLines keyframes_;
};

}  // namespace relmap::console
