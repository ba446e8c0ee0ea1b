// Base of tests on real recordings. They run if RELMAP_DATA names the folder of data sets; a missing set is a failure.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace relmap::testing {

class DataTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("RELMAP_DATA");
    if (!data || !*data) GTEST_SKIP() << "RELMAP_DATA is not set";
    data_ = data;
  }
  std::string data_;  // the folder
};

}  // namespace relmap::testing
