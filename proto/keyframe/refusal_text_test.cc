#include "proto/keyframe/refusal_text.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>

#include "tests/paths.h"

namespace relmap {
namespace {

std::string contents(const std::string& file) {
  std::ifstream in(std::string(RELMAP_SOURCE_DIR) + "/" + file);
  EXPECT_TRUE(in) << file;
  return {std::istreambuf_iterator<char>(in), {}};
}

// All that judges keyframes names its reasons in these sources.
TEST(RefusalText, SaysWhyForEveryReasonForWhichAKeyframeIsRefused) {
  std::map<std::string, Reason> by_name;
#define X(name, number) by_name.emplace(#name, Reason::name);
  RELMAP_REASONS(X)
#undef X
  std::set<std::string> named;
  const std::regex reason(R"(Reason::([A-Z_]+))");
  for (const char* file :
       {"proto/base/names.cc", "proto/calibration/calibration.cc", "proto/keyframe/extension_codec.cc",
        "proto/keyframe/keyframe.cc", "proto/keyframe/keyframe_check.cc", "server/intake/session_intake.cc",
        "server/intake/intake.cc"}) {
    const std::string text = contents(file);
    for (auto it = std::sregex_iterator(text.begin(), text.end(), reason); it != std::sregex_iterator(); ++it)
      named.insert((*it)[1]);
  }
  EXPECT_GT(named.size(), 20u);
  // Of gaps, of messages that settle nothing, and of what passes.
  for (const char* other :
       {"OK", "DROPPED_BY_ROBOT", "CAPTURE_FAILED", "MAP_RESTORED", "INVALID_ARGUMENT", "NO_SUCH_SESSION",
        "RATE_LIMITED", "BUDGET_EXCEEDED", "DISK_FULL", "IO_ERROR", "READ_ONLY", "SHUTTING_DOWN", "INTERNAL"})
    named.erase(other);
  for (const std::string& name : named) {
    ASSERT_TRUE(by_name.contains(name)) << name;
    EXPECT_NE(refusal_text(by_name.at(name)), "") << name;
  }
}

TEST(RefusalText, HasNothingToSayOfOtherReasons) {
  EXPECT_EQ(refusal_text(Reason::OK), "");
  EXPECT_EQ(refusal_text(Reason::NEW_PLACE), "");
}

}  // namespace
}  // namespace relmap
