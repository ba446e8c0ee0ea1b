#include "frontend/publishing/memory_spool.h"

#include <gtest/gtest.h>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"

namespace relmap::publishing {
namespace {

Bytes payload(std::uint32_t sequence) { return Bytes(1000, static_cast<std::uint8_t>(sequence)); }

TEST(MemorySpool, KeepsWhatIsWanted) {
  SessionHeader header = sample_keyframe().session;
  header.uuid = {};
  MemorySpool spool(header);
  const SessionUuid uuid = spool.session().uuid;
  EXPECT_FALSE(uuid.is_nil());
  for (const std::uint32_t s : {0u, 1u, 2u, 3u, 5u, 6u, 7u, 8u, 9u})
    ASSERT_TRUE(spool.append(s, payload(s), crc32c(payload(s))).ok());
  ASSERT_TRUE(spool.append_gap({uuid, 4, 4, Reason::CAPTURE_FAILED}).ok());
  EXPECT_EQ(spool.keyframes().size(), 9u);
  EXPECT_EQ(spool.keyframes().at(3).bytes, 1000u);
  EXPECT_EQ(*spool.read(3), payload(3));
  EXPECT_EQ(spool.read(4).reason(), Reason::NO_SUCH_FRAME);
  ASSERT_TRUE(spool.remove_below(7).ok());
  EXPECT_EQ(spool.keyframes().size(), 3u);
  EXPECT_TRUE(spool.gaps().empty());
  EXPECT_EQ(spool.read(6).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(*spool.read(7), payload(7));
}

TEST(MemorySpool, KeepsTheUuidItIsGiven) {
  const SessionHeader header = sample_keyframe().session;
  EXPECT_EQ(MemorySpool(header).session().uuid, header.uuid);
}

}  // namespace
}  // namespace relmap::publishing
