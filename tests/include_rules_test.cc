// Checks the direction of dependencies: reads every #include and fails on a forbidden one. The table in
// docs/architecture.md is generated from these rules; with RELMAP_WRITE_DOCS=1 in the environment it is written anew.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/generated_part.h"

namespace {

namespace fs = std::filesystem;
using relmap::testing::content_of;

const fs::path& kRoot = relmap::testing::kSourceTree;

struct Part {
  std::set<std::string> may_use;    // other parts, besides itself
  std::set<std::string> libraries;  // of third parties, by the name given below
  std::string within = {};          // the part that those outside know it as
};

// Folder -> what it may include. The longest folder that is a prefix of a file decides.
const std::map<std::string, Part> kParts = {
    {"proto/base", {{}, {"json"}, "proto"}},
    {"proto/geometry", {{"proto/base"}, {"eigen"}, "proto"}},
    {"proto/calibration", {{"proto/base", "proto/geometry"}, {"eigen", "yaml"}, "proto"}},
    {"proto/keyframe", {{"proto/base", "proto/geometry", "proto/calibration"}, {"eigen"}, "proto"}},
    {"proto/access", {{"proto"}, {"openssl"}}},
    {"proto/linear", {{"proto"}, {"eigen", "cholmod"}}},
    {"proto/wire", {{"proto"}, {"eigen", "protobuf", "grpc", "lcm"}}},
    {"frontend/vision", {{"proto"}, {"eigen", "opencv", "jpeg", "zlib"}}},
    {"frontend/capture", {{"proto", "frontend/vision"}, {"eigen", "opencv", "yaml"}}},
    {"frontend/capture/iidc", {{"proto", "frontend/vision", "frontend/capture"}, {"libusb"}}},
    {"frontend/capture/dc1394", {{"proto", "frontend/capture/iidc"}, {"dc1394"}}},
    {"frontend/tracking", {{"proto", "frontend/vision"}, {"eigen", "opencv"}}},
    {"frontend/publishing", {{"proto"}, {"eigen"}}},
    {"frontend/publishing/lcm", {{"proto", "proto/access", "proto/wire", "frontend/publishing"}, {}}},
    {"frontend/publishing/grpc",
     {{"proto", "proto/wire", "frontend/publishing", "client"}, {"eigen", "protobuf", "grpc"}}},
    {"frontend/recording", {{"proto", "proto/wire"}, {"eigen"}}},
    {"frontend",
     {{"proto", "frontend/vision", "frontend/capture", "frontend/tracking", "frontend/publishing",
       "frontend/recording"},
      {"eigen", "opencv", "cli11"}}},
    {"frontend/workflow",
     {{"proto", "frontend", "frontend/vision", "frontend/capture", "frontend/capture/iidc", "frontend/capture/dc1394",
       "frontend/tracking", "frontend/publishing", "frontend/recording"},
      {"eigen"}}},
    {"frontend/workflow/wire",
     {{"proto", "proto/access", "frontend", "frontend/workflow", "frontend/publishing", "frontend/publishing/lcm",
       "frontend/publishing/grpc", "frontend/recording"},
      {}}},
    {"storage/memory", {{"proto"}, {}, "storage"}},
    {"storage/io", {{"proto"}, {}, "storage"}},
    {"storage/engine", {{"proto"}, {}, "storage"}},
    {"storage/graph", {{"proto"}, {"eigen"}, "storage"}},
    {"storage/format", {{"proto", "storage/memory", "storage/graph"}, {"eigen", "zstd"}, "storage"}},
    {"storage/journal", {{"proto", "storage/io", "storage/graph", "storage/format"}, {"eigen"}, "storage"}},
    {"storage/events",
     {{"proto", "storage/engine", "storage/format", "storage/graph", "storage/journal"}, {"eigen"}, "storage"}},
    {"storage/map",
     {{"proto", "storage/memory", "storage/engine", "storage/graph", "storage/format", "storage/events"},
      {"eigen"},
      "storage"}},
    {"storage/testing", {{"proto", "storage"}, {"eigen"}}},
    {"storage/maintenance", {{"proto", "storage"}, {"eigen"}}},
    {"storage/rocksdb", {{"proto", "storage", "storage/maintenance"}, {"eigen", "rocksdb"}}},
    {"storage/migrate", {{"proto", "storage", "storage/maintenance", "storage/rocksdb"}, {"eigen"}}},
    {"server/rba", {{"proto", "proto/linear", "storage"}, {"eigen"}}},
    {"server/place", {{"proto", "storage", "frontend/vision", "server/route"}, {"eigen", "opencv"}}},
    {"server/route", {{"proto", "storage"}, {"eigen"}}},
    {"server/route/overlay", {{"proto", "storage", "server/route"}, {"eigen"}}},
    {"server/skeleton", {{"proto", "storage"}, {"eigen"}}},
    {"server/map",
     {{"proto", "storage", "frontend/vision", "server/rba", "server/place", "server/route", "server/route/overlay"},
      {"eigen", "spdlog"}}},
    {"server/intake", {{"proto", "storage"}, {"eigen"}}},
    {"server/ingest",
     {{"proto", "proto/access", "proto/wire", "storage", "server/map", "server/rba", "server/place", "server/intake"},
      {"eigen", "lcm", "spdlog"}}},
    {"server/rpc",
     {{"proto", "proto/access", "proto/wire", "storage", "storage/maintenance", "frontend/vision", "server/map",
       "server/rba", "server/place", "server/route", "server/route/overlay", "server/skeleton", "server/intake",
       "server/ingest"},
      {"eigen", "protobuf", "grpc", "spdlog"}}},
    {"server/monitor",
     {{"proto", "proto/access", "storage", "server/map", "server/rba", "server/place", "server/route",
       "server/route/overlay", "server/intake", "server/rpc"},
      {"eigen", "grpc", "protobuf", "boost", "openssl", "prometheus", "spdlog"}}},
    {"server/service", {{"proto"}, {"spdlog"}}},
    {"server/ops",
     {{"proto", "proto/access", "proto/wire", "storage", "storage/rocksdb", "server/map", "server/rba", "server/place",
       "server/route", "server/route/overlay", "server/intake", "server/ingest", "server/rpc", "server/monitor",
       "server/service"},
      {"eigen", "yaml", "spdlog"}}},
    {"server", {{"proto", "server/monitor", "server/ops", "server/service"}, {"cli11", "spdlog"}}},
    {"client", {{"proto", "proto/access", "proto/linear", "proto/wire"}, {"eigen", "opencv", "protobuf", "grpc"}}},
    {"tools/sim", {{"proto"}, {"eigen"}}},
    {"tools/vocab", {{"proto", "frontend/vision", "server/place"}, {"eigen", "opencv", "cli11"}}},
    {"tools/camera",
     {{"proto", "frontend/vision", "frontend/capture", "frontend/capture/iidc", "frontend/capture/dc1394",
       "tools/terminal"},
      {"eigen", "opencv", "cli11"}}},
    {"tools/console/http", {{"proto", "proto/access"}, {"boost", "openssl", "zlib"}}},
    {"tools/console/forward", {{"proto", "client"}, {"boost", "grpc"}}},
    {"tools/console",
     {{"proto", "proto/access", "proto/wire", "client", "tools/console/http", "tools/console/forward",
       "tools/console/layout", "tools/terminal"},
      {"boost", "protobuf", "grpc"}}},
    {"tools/terminal", {{"proto"}, {"eigen", "cli11"}}},
    {"tools/g2o", {{"proto"}, {"eigen"}}},
    {"tools/batch", {{"proto", "client", "tools/terminal"}, {"eigen", "json"}}},
    {"tools/console/layout", {{"proto", "client"}, {"eigen", "json"}}},
    {"tools/relmap", {{"proto", "client", "tools/batch", "tools/terminal", "tools/g2o"}, {"eigen", "cli11"}}},
    {"tools/relmap-admin",
     {{"proto", "proto/access", "storage", "storage/maintenance", "storage/migrate", "storage/rocksdb", "server/place",
       "client", "tools/terminal"},
      {"eigen", "cli11"}}},
};
// Programs and tests may reach further than the library in whose folder they stand.
const std::set<std::string> kAnything = {"tests", "tools/bench"};

// As the documents name them.
const std::map<std::string, std::string> kNames = {
    {"eigen", "Eigen"},
    {"opencv", "OpenCV"},
    {"jpeg", "libjpeg"},
    {"yaml", "yaml-cpp"},
    {"protobuf", "protobuf"},
    {"grpc", "gRPC"},
    {"lcm", "LCM"},
    {"rocksdb", "RocksDB"},
    {"zstd", "zstd"},
    {"zlib", "zlib"},
    {"spdlog", "spdlog"},
    {"cli11", "CLI11"},
    {"json", "nlohmann-json"},
    {"libusb", "libusb"},
    {"dc1394", "libdc1394"},
    {"cholmod", "CHOLMOD"},
    {"openssl", "OpenSSL"},
    {"boost", "Boost"},
    {"prometheus", "prometheus-cpp"},
};

const std::vector<std::pair<std::string, std::regex>> kLibraries = {
    {"eigen", std::regex("^Eigen/.*")},
    {"opencv", std::regex("^opencv2/.*")},
    {"jpeg", std::regex("^j(peglib|error)\\.h$")},
    {"yaml", std::regex("^yaml-cpp/.*")},
    {"json", std::regex("^nlohmann/.*")},
    {"protobuf", std::regex("^google/(protobuf|rpc)/.*|.*\\.pb\\.h$")},
    {"grpc", std::regex("^(grpc|grpcpp)/.*|.*\\.grpc\\.pb\\.h$")},
    {"lcm", std::regex("^(lcm|relmap_lcm)/.*")},
    {"rocksdb", std::regex("^rocksdb/.*")},
    {"zlib", std::regex("^zlib\\.h$")},
    {"openssl", std::regex("^openssl/.*")},
    {"boost", std::regex("^boost/.*")},
    {"prometheus", std::regex("^prometheus/.*")},
    {"zstd", std::regex("^zstd\\.h$")},
    {"spdlog", std::regex("^(spdlog|fmt)/.*")},
    {"cli11", std::regex("^CLI/.*")},
    {"libusb", std::regex("^libusb-1\\.0/.*|^libusb\\.h$")},
    {"dc1394", std::regex("^dc1394/.*")},
    {"cholmod", std::regex("^(suitesparse/)?cholmod.*|^Eigen/CholmodSupport$")},
    {"gtest", std::regex("^(gtest|gmock)/.*")},
};

std::string part_of(const std::string& file) {
  std::string best;
  const auto consider = [&](const std::string& folder) {
    if (file.starts_with(folder + "/") && folder.size() > best.size()) best = folder;
  };
  for (const auto& [folder, part] : kParts) consider(folder);
  for (const auto& folder : kAnything) consider(folder);
  return best;
}

// Whether one folder may include another: itself, what its rule names, and what stands within a part that its rule
// names, unless both stand within the same one.
bool may_use(const std::string& folder, const std::string& other) {
  if (folder == other) return true;
  const auto of_other = kParts.find(other);
  if (of_other == kParts.end()) return false;  // tests and benchmarks
  const std::string& within = of_other->second.within;
  const Part& part = kParts.at(folder);
  return part.may_use.contains(other) || (!within.empty() && within != part.within && part.may_use.contains(within));
}

bool ends_with_any(const std::string& name, std::initializer_list<const char*> endings) {
  return std::any_of(endings.begin(), endings.end(), [&](const char* ending) { return name.ends_with(ending); });
}

std::vector<std::string> our_sources() {
  return relmap::testing::sources_in({"proto", "storage", "server", "client", "frontend", "tools", "tests"});
}

struct Include {
  std::string file, name;
  bool quoted;
};

std::vector<Include> includes_of_sources() {
  static const std::regex kInclude("^\\s*#\\s*include\\s*([<\"])([^>\"]+)[>\"].*");
  std::vector<Include> includes;
  for (const std::string& file : our_sources()) {
    std::ifstream in(kRoot / file);
    std::string line;
    std::smatch match;
    while (std::getline(in, line))
      if (std::regex_match(line, match, kInclude)) includes.push_back({file, match[2], match[1] == "\""});
  }
  return includes;
}

const char* library_of(const std::string& header) {
  const char* found = nullptr;
  for (const auto& [library, pattern] : kLibraries)
    if (std::regex_match(header, pattern)) found = library.c_str();  // the last, most special, wins
  return found;
}

std::string table_of_rules() {
  std::string table = "| folder | may include (besides itself) | third parties |\n|---|---|---|\n";
  for (const auto& [folder, part] : kParts) {
    std::string uses, libraries;
    for (const std::string& other : part.may_use) uses += (uses.empty() ? "" : ", ") + other;
    for (const std::string& library : part.libraries) libraries += (libraries.empty() ? "" : ", ") + kNames.at(library);
    table += "| `" + folder + "` | " + uses + " | " + libraries + " |\n";
  }
  return table;
}

TEST(IncludeRules, TheTableInTheDocumentsIsTheSame) {
  relmap::testing::expect_generated_part("docs/architecture.md", "include rules", table_of_rules());
}

TEST(IncludeRules, EveryFolderHasItsRules) {
  for (const std::string& file : our_sources())
    EXPECT_FALSE(part_of(file).empty()) << file << ": no rule covers its folder";
}

TEST(IncludeRules, PartsIncludeOnlyWhatTheyMay) {
  const auto includes = includes_of_sources();
  ASSERT_GT(includes.size(), 200u);
  for (const Include& include : includes) {
    const std::string part = part_of(include.file);
    const bool free = ends_with_any(include.file, {"_test.cc", "_main.cc", "_fuzz.cc"}) || kAnything.contains(part) ||
                      include.file.find("/testing/") != std::string::npos;
    if (free) continue;
    const std::string target = part_of(include.name);
    if (!target.empty()) {
      EXPECT_TRUE(may_use(part, target)) << include.file << " includes " << include.name << ": " << part
                                         << " may not use " << target;
    } else if (const char* library = library_of(include.name)) {
      EXPECT_TRUE(kParts.at(part).libraries.contains(library))
          << include.file << " includes " << include.name << ": " << part << " may not use " << library;
    }
  }
}

// What tests and benchmarks share stands in tests/support and tests/file_faults.
TEST(IncludeRules, NothingLinksBenchmarksAndTheyLinkNoTest) {
  for (const Include& include : includes_of_sources()) {
    if (part_of(include.file) != "tools/bench") {
      EXPECT_FALSE(include.name.starts_with("tools/bench/")) << include.file << " includes " << include.name;
    } else {
      EXPECT_TRUE(!include.name.starts_with("tests/") || include.name.starts_with("tests/support/") ||
                  include.name.starts_with("tests/file_faults/") || include.name == "tests/paths.h")
          << include.file << " includes " << include.name;
    }
  }
}

// Clang checks the use of our own mutexes only (proto/base/mutex.h). Tests may use others.
TEST(IncludeRules, CodeThatIsNoTestUsesMutexesThatClangChecks) {
  const std::string own = "proto/base/mutex.h";
  const auto unchecked = [](const std::string& text) {
    for (const char* name : {"std::mutex", "std::timed_mutex", "std::recursive_mutex", "std::recursive_timed_mutex",
                             "std::shared_mutex", "std::shared_timed_mutex", "std::condition_variable"})
      if (text.find(name) != std::string::npos) return name;
    return "";
  };
  ASSERT_STREQ(unchecked(content_of(own)), "std::mutex") << "which it wraps";
  for (const std::string& file :
       relmap::testing::sources_in({"proto", "storage", "server", "client", "frontend", "tools"}))
    if (file != own && !file.ends_with("_test.cc") && file.find("/testing/") == std::string::npos) {
      EXPECT_STREQ(unchecked(content_of(file)), "") << file;
    }
}

// Headers are read by every user of a library: OpenCV and generated code would become theirs. proto/wire/convert.h is
// the adapters' own.
TEST(IncludeRules, HeadersKeepOpenCvAndGeneratedCodeToThemselves) {
  const std::set<std::string> adapters = {"proto/wire", "server/rpc"};
  for (const Include& include : includes_of_sources()) {
    const bool internal = include.file.ends_with("_impl.h") || include.file.find("/testing/") != std::string::npos;
    if (!include.file.ends_with(".h") || internal || kAnything.contains(part_of(include.file))) continue;
    const char* library = library_of(include.name);
    if (!library) continue;
    const std::string name = library;
    EXPECT_NE(name, "opencv") << include.file << " includes " << include.name;
    if (name == "protobuf" || name == "grpc") {
      EXPECT_TRUE(adapters.contains(part_of(include.file))) << include.file << " includes " << include.name;
    }
  }
}

TEST(IncludeRules, OwnHeadersAreQuotedFromTheRootAndOthersAreNot) {
  for (const Include& include : includes_of_sources()) {
    const bool ours = fs::exists(kRoot / include.name);
    const bool generated = include.name.find(".pb.h") != std::string::npos || include.name.starts_with("relmap_lcm/") ||
                           include.name == "tests/paths.h";
    if (include.quoted) {
      EXPECT_TRUE(ours || generated) << include.file << " includes \"" << include.name << "\"";
    } else {
      EXPECT_FALSE(ours) << include.file << " includes <" << include.name << ">";
    }
  }
}

}  // namespace
