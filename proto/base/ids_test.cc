#include "proto/base/ids.h"

#include <gtest/gtest.h>

#include <set>

namespace relmap {
namespace {

TEST(FrameId, TextGoesBothWays) {
  for (const FrameId id : {FrameId{1, 0}, FrameId{3, 120}, FrameId{4294967295u, 4294967295u}})
    EXPECT_EQ(FrameId::parse(id.to_string()), id);
  EXPECT_EQ((FrameId{3, 120}.to_string()), "3:120");
}

TEST(FrameId, RefusesWhatIsNoFrame) {
  for (const char* text : {"", ":", "3", "3:", ":5", "0:5", "-1:5", "3:-5", "3:5 ", " 3:5", "3:5:6", "3.5", "a:b",
                           "4294967296:0", "1:4294967296"})
    EXPECT_FALSE(FrameId::parse(text)) << text;
}

TEST(FrameId, PacksIntoSixtyFourBitsInOrder) {
  const FrameId a{3, 4294967295u}, b{4, 0};
  EXPECT_LT(a, b);
  EXPECT_LT(a.packed(), b.packed());
  EXPECT_EQ(FrameId::unpack(a.packed()), a);
}

TEST(EdgeId, TextGoesBothWays) {
  const EdgeId id{{3, 120}, 1};
  EXPECT_EQ(id.to_string(), "3:120/1");
  EXPECT_EQ(EdgeId::parse("3:120/1"), id);
  for (const char* text : {"3:120", "3:120/", "/1", "0:120/1", "3:120/1/2", "3:120/x"})
    EXPECT_FALSE(EdgeId::parse(text)) << text;
}

TEST(SessionUuid, TextGoesBothWays) {
  const SessionUuid uuid = SessionUuid::random();
  EXPECT_EQ(SessionUuid::parse(uuid.to_string()), uuid);
  const std::string text = "00112233-4455-6677-8899-aabbccddeeff";
  EXPECT_EQ(SessionUuid::parse(text)->to_string(), text);
  EXPECT_EQ(SessionUuid::parse("00112233-4455-6677-8899-AABBCCDDEEFF")->to_string(), text);
  for (const char* bad : {"", "00112233445566778899aabbccddeeff", "00112233-4455-6677-8899-aabbccddeef",
                          "00112233-4455-6677-8899-aabbccddeeff0", "g0112233-4455-6677-8899-aabbccddeeff"})
    EXPECT_FALSE(SessionUuid::parse(bad)) << bad;
}

TEST(SessionUuid, RandomOnesDifferAndAreOfVersionFour) {
  std::set<SessionUuid> seen;
  for (int i = 0; i < 100; ++i) {
    const SessionUuid uuid = SessionUuid::random();
    EXPECT_EQ(uuid.to_string()[14], '4');
    EXPECT_FALSE(uuid.is_nil());
    seen.insert(uuid);
  }
  EXPECT_EQ(seen.size(), 100u);
}

}  // namespace
}  // namespace relmap
