#include "tools/console/layout/tile_source.h"

#include "tools/console/layout/root_sigmas.h"
#include "tools/console/layout/tile_maker.h"

namespace relmap::console {

TileSource::TileSource(Limits limits)
    : limits_(limits),
      tiles_(limits.tile_bytes),
      sigmas_(limits.roots),
      keyframes_(limits.keyframe_bytes, limits.away) {}

Result<std::shared_ptr<const TileSource::Sigmas>> TileSource::sigmas_of(const MapLayout& layout, FrameId root) {
  const SigmasOf key{layout.version, root};
  if (auto kept = sigmas_.find(key)) return kept;
  // All tiles of a picture ask for them at once.
  return sigmas_made_.get(key, [&]() -> Result<std::shared_ptr<const Sigmas>> {
    if (auto kept = sigmas_.find(key)) return kept;
    auto made = root_sigmas(layout, root);
    if (!made.ok()) return made.status();
    auto sigmas = std::make_shared<const Sigmas>(std::move(made).value());
    sigmas_.keep(key, sigmas, 1);  // counted, not weighed
    return sigmas;
  });
}

Result<TileSource::TileBytes> TileSource::tile(const TileIndex& index, const MapLayout* old, const TileRequest& request,
                                               const ClientOf& client) {
  auto tile = made(index, old, request, &client);
  if (!tile.ok()) return tile.status();
  return **std::move(tile);
}

Result<std::optional<TileSource::TileBytes>> TileSource::tile_at_once(const TileIndex& index, const MapLayout* old,
                                                                      const TileRequest& request) {
  return made(index, old, request, nullptr);
}

Result<std::optional<TileSource::TileBytes>> TileSource::made(const TileIndex& index, const MapLayout* old,
                                                              const TileRequest& request, const ClientOf* client) {
  const MapLayout& layout = index.layout();
  const TileId& id = request.tile;
  if (id.zoom > layout.zooms + kMoreZooms || id.x >= TileIndex::tiles(id.zoom) || id.y >= TileIndex::tiles(id.zoom))
    return {Reason::INVALID_ARGUMENT, "there is no tile " + std::to_string(id.zoom) + "/" + std::to_string(id.x) + "/" +
                                          std::to_string(id.y) + " of this layout, which has zooms 0 to " +
                                          std::to_string(layout.zooms + kMoreZooms)};
  const TileKey key{layout.version, id, old ? old->version : 0, request.root.value_or(FrameId())};
  const auto told = [](TileBytes bytes) { return std::optional(bytes->empty() ? nullptr : std::move(bytes)); };
  if (auto kept = tiles_.find(key)) return told(std::move(kept));

  TileContent content;
  content.old = old;
  std::shared_ptr<const Sigmas> sigmas;
  if (request.root) {
    auto found = sigmas_of(layout, *request.root);
    if (!found.ok()) return found.status();
    sigmas = *std::move(found);
    content.sigmas = sigmas.get();
  }
  KeyframeLines::Lines keyframes;
  bool whole = true;
  if (id.zoom > layout.zooms && layout.points.size() < layout.frames) {
    const auto sessions = sessions_in(index, id);
    keyframes = keyframes_.kept(layout, sessions);
    if (keyframes.size() < sessions.size()) {
      if (!client) return std::optional<TileBytes>();
      auto read = keyframes_.of(layout, sessions, *client);
      whole = read.ok();
      if (whole) keyframes = *std::move(read);
    }
    if (!keyframes.empty()) content.keyframes = &keyframes;
  }
  const Tile tile = make_tile(index, id, content);
  auto bytes = std::make_shared<const std::string>(tile.empty() ? std::string() : tile.encoded());
  if (whole) tiles_.keep(key, bytes, bytes->size() + 128);
  return told(std::move(bytes));
}

}  // namespace relmap::console
