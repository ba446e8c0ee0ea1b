#include "server/ops/endpoint.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "server/ops/process.h"

namespace relmap::ops {
namespace {

TEST(Endpoint, IsWrittenAtomicallyAndRemoved) {
  const std::string folder = testing::TempDir() + "relmap_endpoint_test";
  std::filesystem::create_directories(folder);
  ASSERT_TRUE(write_endpoint(folder, {"127.0.0.1:50070", 4711, "b007"}).ok());
  std::ostringstream text;
  text << std::ifstream(folder + "/endpoint").rdbuf();
  EXPECT_EQ(text.str(), "address 127.0.0.1:50070\npid 4711\nboot b007\n");
  EXPECT_FALSE(std::filesystem::exists(folder + "/endpoint.new"));
  remove_endpoint(folder);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::filesystem::remove_all(folder);
}

TEST(Endpoint, AMissingFolderIsAnError) { EXPECT_EQ(write_endpoint("/nowhere/at/all", {}).reason(), Reason::IO_ERROR); }

TEST(Process, KnowsItsResidentSize) {
  EXPECT_GT(resident_bytes(), 1u << 20);
  EXPECT_GE(peak_resident_bytes(), resident_bytes() / 2);
}

}  // namespace
}  // namespace relmap::ops
