#include "server/rpc/messages.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

namespace relmap::rpc {
namespace {

// All values that can be stored.
constexpr std::array kStored = {storage::Verification::kNone,     storage::Verification::kStereo,
                                storage::Verification::kPnP,      storage::Verification::kEpipolar,
                                storage::Verification::kImported, storage::Verification::kCompounded};

TEST(VerificationOnTheWire, HasAllStoredValues) {
  constexpr std::array kExpected = {v1::VERIFICATION_NONE,     v1::VERIFICATION_STEREO,   v1::VERIFICATION_PNP,
                                    v1::VERIFICATION_EPIPOLAR, v1::VERIFICATION_IMPORTED, v1::VERIFICATION_COMPOUNDED};
  for (std::size_t i = 0; i < kStored.size(); ++i) EXPECT_EQ(to_wire(kStored[i]), kExpected[i]) << i;
}

TEST(VerificationOnTheWire, HasOnlyStoredValuesAndHomography) {
  std::set<int> wire{v1::VERIFICATION_HOMOGRAPHY};
  for (const storage::Verification verification : kStored)
    EXPECT_TRUE(wire.insert(to_wire(verification)).second) << v1::Verification_Name(to_wire(verification));
  for (int value = v1::Verification_MIN; value <= v1::Verification_MAX; ++value)
    EXPECT_EQ(wire.contains(value), v1::Verification_IsValid(value)) << value;
}

TEST(CountsOfReasons, AreAppended) {
  v1::GetStatusReply reply;
  add_count(*reply.mutable_refused_by_reason(), Reason::CORRUPT, 3);
  add_count(*reply.mutable_refused_by_reason(), Reason::BAD_SIZE, 1);
  ASSERT_EQ(reply.refused_by_reason_size(), 2);
  EXPECT_EQ(reply.refused_by_reason(0).reason(), v1::REASON_CORRUPT);
  EXPECT_EQ(reply.refused_by_reason(0).count(), 3u);
  EXPECT_EQ(reply.refused_by_reason(1).reason(), v1::REASON_BAD_SIZE);
}

}  // namespace
}  // namespace relmap::rpc
