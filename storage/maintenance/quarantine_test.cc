// What a repair sets aside survives a power failure.
#include "storage/maintenance/quarantine.h"

#include <gtest/gtest.h>

#include "storage/testing/forgetful_files.h"

namespace relmap::storage {
namespace {

TEST(Quarantine, WhatIsKeptSurvivesAPowerFailureWithItsFolder) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const auto disk = ForgetfulFiles::create(seed);
    Quarantine quarantine("map/quarantine", disk);
    EXPECT_FALSE(quarantine.used());
    ASSERT_TRUE(quarantine.keep("frame 1", Bytes(700, 1)).ok());
    ASSERT_TRUE(quarantine.keep("frame 1", Bytes(900, 2)).ok());
    EXPECT_TRUE(quarantine.used());
    disk->restart();
    for (const auto& [name, size] : {std::pair("frame 1", 700u), std::pair("frame 1.2", 900u)}) {
      const auto file = disk->open_read(std::string("map/quarantine/") + name);
      ASSERT_TRUE(file.ok()) << name << ", seed " << seed;
      EXPECT_EQ((*file)->size(), size) << name << ", seed " << seed;
    }
  }
}

}  // namespace
}  // namespace relmap::storage
