// What `relmap localise` printed.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "proto/base/ids.h"
#include "proto/geometry/geometry.h"
#include "tests/support/process.h"

namespace relmap::testing {

struct Where {
  FrameId frame;
  Vector3 t = Vector3::Zero();
};
// Parses an answer; fails the test if there is none.
inline Where where(const Finished& answer) {
  Where found;
  EXPECT_EQ(answer.exit_code, 0) << answer.standard_error;
  const std::string& text = answer.standard_output;
  const std::size_t position = text.find("position in it");
  if (answer.exit_code != 0 || position == std::string::npos) return found;
  EXPECT_EQ(std::sscanf(text.c_str(), "frame %u:%u", &found.frame.session, &found.frame.index), 2) << text;
  EXPECT_EQ(
      std::sscanf(text.c_str() + text.find('(', position), "(%lf, %lf, %lf)", &found.t.x(), &found.t.y(), &found.t.z()),
      3)
      << text;
  return found;
}

}  // namespace relmap::testing
