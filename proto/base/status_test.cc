#include "proto/base/status.h"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

namespace relmap {
namespace {

template <typename Exception>
Status caught(const Exception& exception) {
  try {
    throw exception;
  } catch (...) {
    return caught_status();
  }
}

TEST(Status, OfACaughtExceptionNamesItsReason) {
  EXPECT_EQ(caught(StatusError({Reason::DATA_LOSS, "page 3"})).to_string(), "DATA_LOSS: page 3");
  EXPECT_EQ(caught(std::bad_alloc()).to_string(), "BUDGET_EXCEEDED: out of memory");
  EXPECT_EQ(caught(std::runtime_error("odd")).to_string(), "INTERNAL: odd");
  EXPECT_EQ(caught(1).to_string(), "INTERNAL: an unknown exception");
}

}  // namespace
}  // namespace relmap
