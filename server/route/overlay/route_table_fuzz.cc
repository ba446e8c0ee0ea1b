// A table of cells, and the cells, of a small map with any changes: either they are not taken, or searches end with a
// route or a reason. The first byte chooses whether the rest is the table as it is, changes to it, or changes to the
// cells. After changes the checksums are right, so that what is behind them is reached.
#include <filesystem>
#include <string>
#include <vector>

#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "server/route/overlay/overlay_search.h"
#include "server/route/overlay/overlay_table.h"
#include "server/route/testing/drawn_map.h"
#include "storage/testing/patches.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using namespace relmap::route;
using fuzzing::must;

constexpr std::uint64_t kCommit = 5;
constexpr std::size_t kTableHeader = 16;
const std::vector<RouteWeights> kMetrics{kByDistance, kByTime};

// Twenty drives of three frames around a block, every second of them in one direction only, joined by closures.
class SmallTown {
 public:
  SmallTown() {
    const std::string names = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ01234567";
    for (std::size_t i = 0; i < names.size(); ++i)
      map.place(names[i], {static_cast<double>(i % 10), 0, static_cast<double>(i / 10)});
    for (std::size_t drive = 0; drive < names.size() / 3; ++drive) {
      map.drive(names.substr(3 * drive, 3), {.oneway = drive % 2 == 1});
      if (drive > 0) map.close(std::string{names[3 * drive - 1], names[3 * drive]});
      if (drive > 6) map.close(std::string{names[3 * drive - 20], names[3 * drive + 1]});
    }
    std::filesystem::create_directories(folder / "routes");
    Overlay overlay(kMetrics, CellStore::open(folder_path(), budget(), 0).or_throw());
    overlay.build(map);
    while (overlay.make_next()) continue;
    must(write_table(folder_path(), kCommit, overlay, std::vector<storage::ChunkId>{{2, 0}}).ok());
    table = fuzzing::read_file(table_path());
    cells = fuzzing::read_file(cells_path());
    find_parts();
  }
  std::string folder_path() const { return folder / ""; }
  std::string table_path() const { return folder / "routes/table"; }
  std::string cells_path() const { return folder / "routes/cells"; }
  static std::shared_ptr<storage::Budget> budget() { return std::make_shared<storage::Budget>(std::size_t{64} << 20); }

  // A part of a cell, behind its checksum.
  struct SealedPart {
    std::size_t offset = 0, bytes = 0;
  };
  DrawnMap map{""};
  Bytes table, cells;
  std::vector<SealedPart> parts;

 private:
  // Reads of the table where the cells are.
  void find_parts() {
    ByteReader r(table);
    r.get_bytes(kTableHeader + sizeof kCommit);
    r.get_bytes(8 * r.get<std::uint32_t>());                   // stale chunks
    r.get_bytes(4 * sizeof(double) * r.get<std::uint32_t>());  // metrics
    r.get_bytes(sizeof(double) + sizeof(std::uint32_t));       // of the tree
    const auto nodes = r.get<std::uint32_t>();
    for (std::uint32_t i = 0; i < nodes; ++i) {
      r.get_bytes(12);
      r.get_bytes(4 * r.get<std::uint32_t>());
    }
    for (std::uint32_t i = 0; i < nodes; ++i) {
      if (r.get<std::uint8_t>() != 0) {
        const auto offset = r.get<std::uint64_t>(), bytes = r.get<std::uint64_t>();
        const std::size_t frames = r.get<std::uint32_t>(), links = r.get<std::uint32_t>();
        const auto metrics = r.get<std::uint32_t>();
        const bool oneway = r.get<std::uint8_t>() != 0;
        r.get_bytes(13);
        std::size_t at = offset;
        const auto add = [&](std::size_t size) {
          parts.push_back({at + 4, size});
          at += 4 + size;
        };
        add(12 * frames + 4 + 44 * links);
        for (std::size_t m = 0; m < metrics * (oneway ? 2 : 1); ++m) add(SplitCostMatrix::memory_bytes(frames));
        must(at == offset + bytes);
      }
      r.get_bytes(2);
    }
    must(r.at_end() && parts.size() > 20);
  }

  const storage::TemporaryFolder folder;
};

void write_changed(const SmallTown& town, unsigned kind, ByteReader in) {
  Bytes table = town.table, cells = town.cells;
  if (kind == 0) {
    const ByteSpan all = in.get_bytes(in.remaining());
    table.assign(all.begin(), all.end());
  } else if (kind == 1) {
    Bytes body(table.begin() + kTableHeader, table.end());
    while (in.ok() && in.remaining() > 0) storage::patch(body, in);
    table.resize(kTableHeader);
    const std::uint32_t crc = crc32c(body);
    std::memcpy(table.data() + kTableHeader - 4, &crc, sizeof crc);
    table.insert(table.end(), body.begin(), body.end());
  } else {
    const bool sealed = kind == 2;
    while (in.ok() && in.remaining() > 0) storage::patch(cells, in);
    for (const auto& part : town.parts) {
      if (!sealed || part.offset + part.bytes > cells.size()) continue;
      const std::uint32_t crc = crc32c(ByteSpan(cells).subspan(part.offset, part.bytes));
      std::memcpy(cells.data() + part.offset - 4, &crc, sizeof crc);
    }
  }
  fuzzing::write_file(town.table_path(), table);
  fuzzing::write_file(town.cells_path(), cells);
}

// Whatever the cells are, an answer or a reason.
void search(const SmallTown& town, OverlayTable& table) {
  const Overlay& overlay = table.overlay;
  for (const auto& [from, to] : {std::pair('a', '7'), std::pair('Z', 'c'), std::pair('d', 'e'), std::pair('7', 'A')})
    for (std::size_t metric = 0; metric < kMetrics.size(); ++metric) {
      OverlayQuery query;
      query.metric = metric;
      query.stale = table.stale;
      const std::vector<FrameId> starts{town.map.id(from)}, goals{town.map.id(to)};
      auto found = find_route(overlay, town.map, query, starts, goals);
      if (found.ok() && unpack(overlay, town.map, metric, *found).ok())
        (void)follow(overlay, town.map, metric, *found, false);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const SmallTown kTown;
  if (size == 0) return 0;
  write_changed(kTown, data[0] % 4, ByteReader({data + 1, size - 1}));
  auto table = take_table(kTown.folder_path(), kCommit, kMetrics, SmallTown::budget(), 0);
  must(!std::filesystem::exists(kTown.table_path()));
  if (!table) return 0;
  const auto whole = [](auto read_it) {
    try {
      read_it();
      return true;
    } catch (const StatusError& error) {
      must(error.status().reason() == Reason::DATA_LOSS || error.status().reason() == Reason::BUDGET_EXCEEDED);
      return false;
    }
  };
  for (std::uint32_t number = 0; number < table->overlay.tree().size(); ++number) {
    const StoredCell* cell = table->overlay.cell(number);
    if (!cell) continue;
    whole([&] {
      const auto frames = cell->frames();
      for (std::uint32_t node = 0; node < frames->nodes.size(); ++node) {
        must(frames->find(frames->nodes[node]) == node);
        (void)frames->links_of(node);
      }
      must(cell->read_frames().nodes == frames->nodes);  // costs may be NaN, which equals nothing
    });
    for (std::size_t metric = 0; metric < kMetrics.size(); ++metric)
      for (const bool backward : {false, true})
        whole([&] { must(cell->within(metric, backward)->size() == cell->nodes()); });
  }
  whole([&] { search(kTown, *table); });
  whole([&] {
    table->overlay.refresh(kTown.map, table->stale);
    while (table->overlay.make_next()) continue;
    search(kTown, *table);
  });
  return 0;
}
