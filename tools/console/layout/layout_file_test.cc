#include "tools/console/layout/layout_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "proto/base/crc32c.h"
#include "storage/testing/temporary_folder.h"
#include "tools/console/layout/testing/drawn_map.h"
#include "tools/console/layout/tile_maker.h"

namespace relmap::console {
namespace {

using testing::draw_layout;

// With a checksum that fits the payload, whatever that is.
Bytes with_checksum(Bytes bytes) {
  const std::uint32_t crc = crc32c(ByteSpan(bytes).subspan(24));
  std::memcpy(bytes.data() + 12, &crc, sizeof crc);
  const std::uint64_t size = bytes.size() - 24;
  std::memcpy(bytes.data() + 16, &size, sizeof size);
  return bytes;
}

TEST(LayoutFile, KeepsALayoutAsItWas) {
  const storage::TemporaryFolder folder;
  const auto layout = draw_layout({});
  const std::string cache = folder / "cache/layouts";
  EXPECT_EQ(load_layout(cache, layout->map).reason(), Reason::NO_SUCH_FILE);
  ASSERT_TRUE(save_layout(cache, *layout).ok());
  const MapLayout read = load_layout(cache, layout->map).or_throw();
  EXPECT_EQ(encode_layout(read), encode_layout(*layout));
  EXPECT_EQ(read.version, layout->version);
  EXPECT_EQ(read.boot_id, "boot");
  EXPECT_EQ(read.points.size(), layout->points.size());
  EXPECT_EQ(read.place({2, 15})->position, layout->place({2, 15})->position);
  const TileIndex a(layout), b(std::make_shared<const MapLayout>(read));
  EXPECT_EQ(make_tile(a, {0, 0, 0}), make_tile(b, {0, 0, 0}));
  EXPECT_EQ(load_layout(cache, {Uuid::random(), 5}).reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(load_layout(cache, {layout->map.uuid, 6}).reason(), Reason::NO_SUCH_FILE);
  // One file of each map, and nothing beside it.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(cache), {}), 1);
}

TEST(LayoutFile, RefusesWhatIsDamaged) {
  const storage::TemporaryFolder folder;
  const auto layout = draw_layout({.parts = 1, .sessions = 1, .points = 30});
  ASSERT_TRUE(save_layout(folder / "", *layout).ok());
  const std::string path = layout_file(folder / "", layout->map);
  const Bytes whole = encode_layout(*layout);
  for (std::size_t size = 0; size < whole.size(); size += 1 + size / 16)
    EXPECT_EQ(decode_layout(ByteSpan(whole).first(size)).reason(), Reason::CORRUPT);
  std::mt19937 random(1);
  for (int k = 0; k < 500; ++k) {
    Bytes changed = whole;
    changed[random() % changed.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
    const auto read = decode_layout(changed);
    EXPECT_TRUE(read.reason() == Reason::CORRUPT || read.reason() == Reason::UNSUPPORTED);
  }
  std::ofstream(path, std::ios::binary) << "RMLAYOUT, or so";
  EXPECT_EQ(load_layout(folder / "", layout->map).reason(), Reason::UNSUPPORTED);
  std::ofstream(path, std::ios::binary) << "";
  EXPECT_EQ(load_layout(folder / "", layout->map).reason(), Reason::CORRUPT);
  // A whole one of another map.
  const auto other = draw_layout({});
  const Bytes bytes = encode_layout(*other);
  std::ofstream(layout_file(folder / "", {Uuid::random(), 1}), std::ios::binary);
  const MapIdentity renamed{Uuid{{9}}, 1};
  std::ofstream(layout_file(folder / "", renamed), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  EXPECT_EQ(load_layout(folder / "", renamed).reason(), Reason::CORRUPT);
}

// Whatever a payload with the right checksum holds, it is refused, or is a layout that can be drawn.
TEST(LayoutFile, TakesNoPayloadThatContradictsItself) {
  const auto layout = draw_layout({.parts = 2, .sessions = 1, .points = 20, .closures = 10});
  const Bytes whole = encode_layout(*layout);
  std::mt19937 random(2);
  std::size_t refused = 0, taken = 0;
  for (int k = 0; k < 20'000; ++k) {
    Bytes changed = whole;
    for (int times = 0; times < 1 + k % 3; ++times) {
      const std::size_t at = 24 + random() % (changed.size() - 24);
      switch (random() % 4) {
        case 0:
          changed[at] = static_cast<std::uint8_t>(random());
          break;
        case 1:
          changed[at] = 0xff;
          break;
        case 2:
          changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(at));
          break;
        default:
          changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(at), static_cast<std::uint8_t>(random()));
      }
    }
    auto read = decode_layout(with_checksum(std::move(changed)));
    if (!read.ok()) {
      EXPECT_EQ(read.reason(), Reason::CORRUPT);
      ++refused;
      continue;
    }
    ++taken;
    read->zooms = std::min(read->zooms, 3u);
    const TileIndex index(std::make_shared<const MapLayout>(*std::move(read)));
    for (const std::uint32_t zoom : {0u, index.layout().zooms, index.layout().zooms + 1})
      static_cast<void>(make_tile(index, {zoom, 0, 0}));
    static_cast<void>(index.layout().place({1, 40}));
  }
  EXPECT_GT(refused, 1000u);
  EXPECT_GT(taken, 1000u);
}

}  // namespace
}  // namespace relmap::console
