#include "server/route/overlay/overlay_table.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "proto/base/crc32c.h"
#include "storage/io/file.h"
#include "storage/io/random_file.h"

namespace relmap::route {
namespace {

constexpr char kMagic[] = "RELMAPRT";
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kHeaderBytes = 16;

std::string path_in(const std::string& data_folder) { return data_folder + "/routes/table"; }

// The bytes of the file; empty if there is none or it cannot be read.
Bytes read_all(const std::string& path) {
  const auto file = storage::posix_file_system()->open_read(path);
  if (!file.ok()) return {};
  auto bytes = (*file)->read(0, (*file)->size());
  return bytes.ok() ? std::move(bytes).value() : Bytes();
}

}  // namespace

Status write_table(const std::string& data_folder, std::uint64_t commit, const Overlay& overlay,
                   std::span<const storage::ChunkId> stale) {
  // Cells are synced before the table, so that it never names a cell whose place still holds an earlier one.
  if (Status status = overlay.store()->sync(); !status.ok()) return status;
  ByteWriter w;
  w.put_bytes(as_bytes(kMagic));
  w.put(kVersion);
  w.put(std::uint32_t{0});
  w.put(commit);
  w.put(static_cast<std::uint32_t>(stale.size()));
  for (const storage::ChunkId chunk : stale) {
    w.put(chunk.session);
    w.put(chunk.chunk);
  }
  overlay.put(w);
  w.patch(kHeaderBytes - 4, crc32c(ByteSpan(w.bytes()).subspan(kHeaderBytes)));
  auto file = storage::RandomFile::open(path_in(data_folder));
  if (!file.ok()) return file.status();
  Status status = (*file)->write(0, w.bytes());
  if (status.ok()) status = (*file)->truncate(w.size());
  if (!status.ok()) (void)storage::posix_file_system()->remove(path_in(data_folder));
  return status;
}

std::optional<OverlayTable> take_table(const std::string& data_folder, std::uint64_t commit,
                                       std::span<const RouteWeights> metrics, std::shared_ptr<storage::Budget> budget,
                                       std::uint64_t room_for_others) {
  const Bytes bytes = read_all(path_in(data_folder));
  // The table is removed before anything is written to the cells that it names.
  if (!storage::posix_file_system()->remove(path_in(data_folder)).ok() ||
      !storage::posix_file_system()->sync_directory(data_folder + "/routes").ok() || bytes.size() < kHeaderBytes)
    return std::nullopt;
  ByteReader r(bytes);
  const ByteSpan magic = r.get_bytes(8);
  const auto version = r.get<std::uint32_t>(), crc = r.get<std::uint32_t>();
  if (std::memcmp(magic.data(), kMagic, 8) != 0 || version != kVersion ||
      crc != crc32c(ByteSpan(bytes).subspan(kHeaderBytes)) || r.get<std::uint64_t>() != commit)
    return std::nullopt;
  const auto count = r.get<std::uint32_t>();
  if (!r.fits(count, 8)) return std::nullopt;
  std::vector<storage::ChunkId> stale(count);
  for (storage::ChunkId& chunk : stale) {
    chunk.session = r.get<SessionNumber>();
    chunk.chunk = r.get<std::uint32_t>();
  }
  auto store = CellStore::reopen(data_folder, std::move(budget), room_for_others);
  if (!store.ok()) return std::nullopt;
  auto overlay = Overlay::get(r, *std::move(store));
  if (!overlay || !r.at_end() ||
      !std::equal(metrics.begin(), metrics.end(), overlay->metrics().begin(), overlay->metrics().end()))
    return std::nullopt;
  return OverlayTable{*std::move(overlay), std::move(stale)};
}

}  // namespace relmap::route
