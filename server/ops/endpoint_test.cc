#include "server/ops/endpoint.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "server/ops/process.h"
#include "server/ops/socket_path.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::ops {
namespace {

TEST(Endpoint, IsWrittenAtomicallyAndRemoved) {
  const std::string folder = testing::TempDir() + "relmap_endpoint_test";
  std::filesystem::create_directories(folder);
  const auto written = [&](const Endpoint& endpoint) {
    EXPECT_TRUE(write_endpoint(folder, endpoint).ok());
    std::ostringstream text;
    text << std::ifstream(folder + "/endpoint").rdbuf();
    return text.str();
  };
  EXPECT_EQ(written({"/a/socket", "127.0.0.1:50070", 4711, "b007"}),
            "socket /a/socket\naddress 127.0.0.1:50070\npid 4711\nboot b007\n");
  EXPECT_EQ(written({"/a/socket", "", 4711, "b007"}), "socket /a/socket\npid 4711\nboot b007\n");
  EXPECT_FALSE(std::filesystem::exists(folder + "/endpoint.new"));
  remove_endpoint(folder);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::filesystem::remove_all(folder);
}

TEST(Endpoint, AMissingFolderIsAnError) { EXPECT_EQ(write_endpoint("/nowhere/at/all", {}).reason(), Reason::IO_ERROR); }

// A socket's path has at most 107 bytes, with ".new" while it is made.
TEST(SocketPath, IsInTheDataFolderOrWhereThatIsTooLongInTheRuntimeFolder) {
  EXPECT_EQ(socket_path("/srv/map").or_throw(), "/srv/map/socket");
  EXPECT_EQ(socket_path("/srv/./map/").or_throw(), "/srv/map/socket");
  const storage::TemporaryFolder runtime;
  const std::string deep = "/srv/" + std::string(100, 'x');
  setenv("RUNTIME_DIRECTORY", (runtime / "a:/b").c_str(), 1);
  const std::string elsewhere = socket_path(deep).or_throw(), other = socket_path(deep + "y").or_throw();
  unsetenv("RUNTIME_DIRECTORY");
  EXPECT_TRUE(elsewhere.starts_with(runtime / "a/")) << elsewhere;
  EXPECT_LT(elsewhere.size(), 104u);
  EXPECT_NE(elsewhere, other);
}

TEST(Process, KnowsItsResidentSize) {
  EXPECT_GT(resident_bytes(), 1u << 20);
  EXPECT_GE(peak_resident_bytes(), resident_bytes() / 2);
}

}  // namespace
}  // namespace relmap::ops
