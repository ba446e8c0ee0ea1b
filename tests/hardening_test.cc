// The programs are built as Debian builds what faces a network (hardening=+all), and load no more than they use.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/process.h"

namespace relmap::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Hardening, ProgramsAreBuiltWithAllThatDebianAsksFor) {
  for (const char* name : {"relmapd", "relmap", "relmap-admin", "relmap-frontend"}) {
    const Finished read = run_program({"readelf", "-hldW", "--dyn-syms", built_program(name)});
    ASSERT_EQ(read.exit_code, 0) << read.standard_error;
    EXPECT_THAT(read.standard_output, HasSubstr("DYN (Position-Independent Executable file)")) << name;
    EXPECT_THAT(read.standard_output, HasSubstr("GNU_RELRO")) << name;
    EXPECT_THAT(read.standard_output, HasSubstr("NOW PIE")) << name;
    EXPECT_THAT(read.standard_output, HasSubstr("__stack_chk_fail")) << name;
    EXPECT_THAT(read.standard_output, HasSubstr("_chk@GLIBC")) << name << ": calls that are checked (fortify)";
  }
}

// OpenCV's codecs load 126 more libraries.
TEST(Libraries, TheConsoleDrawsNoPicturesAndLoadsNothingForThem) {
  const Finished read = run_program({"readelf", "-dW", built_program("relmap-console")});
  ASSERT_EQ(read.exit_code, 0) << read.standard_error;
  EXPECT_THAT(read.standard_output, HasSubstr("NEEDED"));
  EXPECT_THAT(read.standard_output, Not(HasSubstr("opencv")));
}

}  // namespace
}  // namespace relmap::testing
