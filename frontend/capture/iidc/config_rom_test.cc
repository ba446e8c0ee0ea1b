#include "frontend/capture/iidc/config_rom.h"

#include <gtest/gtest.h>

#include "frontend/capture/iidc/registers.h"

namespace relmap::iidc {
namespace {

// The directories of a camera, as IIDC lays them out.
std::vector<std::uint32_t> sample() {
  return {
      0x04040000, 0x31333934, 0xe0ff8000, 0x00b09d01, 0x00abcdef,  // 0: bus information, GUID
      0x00030000, 0x0300b09d, 0x0c0083c0, 0xd1000001,              // 5: root: vendor, capabilities, unit 1 on
      0x00030000, 0x1200a02d, 0x13000102, 0xd4000001,              // 9: unit: IIDC 1.30 and later
      0x00030000, 0x403c0000, 0x81000002, 0x82000006,              // 13: registers, names
      0,                                                           // 17
      0x00050000, 0,          0,          0x506f696e, 0x74204772,  // 18: "Point Gr"
      0x65790000,                                                  // 23: "ey"
      0x00050000, 0,          0,          0x42756d62, 0x6c656265,  // 24: "Bumblebe"
      0x65320000,                                                  // 29: "e2"
  };
}

// Leaves where the entries point to.
std::vector<std::uint32_t> rom() {
  std::vector<std::uint32_t> quadlets = sample();
  quadlets[15] = 0x81000000 | (18 - 15);
  quadlets[16] = 0x82000000 | (24 - 16);
  return quadlets;
}

TEST(IidcConfigRom, TellsWhoTheCameraIsAndWhereItsRegistersAre) {
  const auto parsed = parse_config_rom(rom());
  ASSERT_TRUE(parsed.ok()) << parsed.status().to_string();
  EXPECT_EQ(parsed->guid, 0x00b09d0100abcdefu);
  EXPECT_EQ(parsed->vendor_id, 0x00b09du);
  EXPECT_EQ(parsed->vendor, "Point Grey");
  EXPECT_EQ(parsed->model, "Bumblebee2");
  EXPECT_EQ(parsed->version, 0x102u);
  EXPECT_EQ(parsed->command_registers, 0xfffff0f00000u);
}

TEST(IidcConfigRom, WhatIsNoCameraIsRefusedByName) {
  EXPECT_EQ(parse_config_rom({}).reason(), Reason::TRUNCATED);
  auto other = rom();
  other[1] = 0x12345678;
  EXPECT_EQ(parse_config_rom(other).reason(), Reason::CORRUPT);
  other = rom();
  other[10] = 0x12000001;  // another specifier: a disk, say
  EXPECT_EQ(parse_config_rom(other).reason(), Reason::UNSUPPORTED);
  other = rom();
  other[8] = 0xd1ffffff;
  EXPECT_EQ(parse_config_rom(other).reason(), Reason::TRUNCATED);
  other = rom();
  other[14] = 0x3f3c0000;  // the registers' entry is another
  EXPECT_EQ(parse_config_rom(other).reason(), Reason::CORRUPT);
}

TEST(IidcConfigRom, EveryCutAndEveryFlippedByteIsAnswered) {
  const auto whole = rom();
  for (std::size_t length = 0; length < 17; ++length)
    EXPECT_FALSE(parse_config_rom(std::span(whole).first(length)).ok()) << length;
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (int byte = 0; byte < 4; ++byte) {
      auto flipped = whole;
      flipped[at] ^= 0xffu << (8 * byte);
      (void)parse_config_rom(flipped);  // nothing but an answer: the sanitizers look on
    }
}

}  // namespace
}  // namespace relmap::iidc
