#include <gtest/gtest.h>

#include "tests/camera/under_mock.h"

int main(int count, char** arguments) {
  relmap::testing::start_under_mock(arguments);
  ::testing::InitGoogleTest(&count, arguments);
  return RUN_ALL_TESTS();
}
