#include "frontend/capture/dc1394/firewire_nodes.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace relmap::iidc::dc1394 {
namespace {

namespace fs = std::filesystem;

class Iidc1394Nodes : public ::testing::Test {
 protected:
  ~Iidc1394Nodes() override { fs::remove_all(folder_); }

  void write(const std::string& node, const std::string& attribute, const std::string& text) {
    fs::create_directories(folder_ / node);
    std::ofstream(folder_ / node / attribute) << text << '\n';
  }

  const fs::path folder_ =
      fs::path(::testing::TempDir()) / ("nodes-" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
                                        "-" + ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(Iidc1394Nodes, ACameraIsKnownByItsUnit) {
  write("fw0", "guid", "0x0011066600000001");
  write("fw0", "units", "");
  write("fw1", "guid", "0x00b09d0100c0ffee");
  write("fw1", "vendor_name", "Point Grey Research");
  write("fw1", "model_name", "Bumblebee2 BB2-03S2C-38");
  write("fw1", "units", "0x00a02d:0x000102 ");
  write("fw1.0", "specifier_id", "0x00a02d");
  const auto nodes = firewire_nodes(folder_).or_throw();
  ASSERT_EQ(2u, nodes.size());
  EXPECT_FALSE(nodes[0].camera);
  EXPECT_TRUE(nodes[1].camera);
  EXPECT_EQ(0x00b0'9d01'00c0'ffeeu, nodes[1].guid);
  EXPECT_EQ("/dev/fw1", nodes[1].file);
  EXPECT_EQ("Point Grey Research", nodes[1].vendor);
  EXPECT_EQ("Bumblebee2 BB2-03S2C-38", nodes[1].model);
}

TEST_F(Iidc1394Nodes, WithoutAnAdapterThereIsNoBus) {
  EXPECT_EQ("UNSUPPORTED: no IEEE 1394 in this machine: its kernel has no driver of an adapter (firewire-ohci)",
            firewire_nodes(folder_).status().to_string());
  fs::create_directories(folder_);
  EXPECT_EQ("UNSUPPORTED: no IEEE 1394 in this machine: it has no adapter",
            firewire_nodes(folder_).status().to_string());
}

TEST_F(Iidc1394Nodes, WhatSaysNothingIsNoCamera) {
  fs::create_directories(folder_ / "fw7");
  const auto nodes = firewire_nodes(folder_).or_throw();
  ASSERT_EQ(1u, nodes.size());
  EXPECT_FALSE(nodes[0].camera);
  EXPECT_EQ(0u, nodes[0].guid);
}

}  // namespace
}  // namespace relmap::iidc::dc1394
