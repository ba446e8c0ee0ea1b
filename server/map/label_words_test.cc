#include "server/map/label_words.h"

#include <gtest/gtest.h>

namespace relmap::map {
namespace {

TEST(LabelWords, EachWordBeginsOneOfTheLabel) {
  EXPECT_TRUE(has_words("Trafalgar Square", "square"));
  EXPECT_TRUE(has_words("Trafalgar Square", "sq TRAF"));
  EXPECT_FALSE(has_words("Trafalgar Square", "quare"));
  EXPECT_FALSE(has_words("Trafalgar Square", "trafalgar station"));
  EXPECT_TRUE(has_words("dock-3/north", "3"));
  EXPECT_TRUE(has_words("dock-3/north", "NORTH dock"));
  EXPECT_FALSE(has_words("dock-3/north", "33"));
}

TEST(LabelWords, BytesOfOtherAlphabetsAreCompared) {
  EXPECT_TRUE(has_words("Küche im Obergeschoß", "kü ober"));
  EXPECT_FALSE(has_words("Küche", "ku"));
}

TEST(LabelWords, WithoutWordsEveryLabelIsFound) {
  EXPECT_TRUE(has_words("dock", ""));
  EXPECT_TRUE(has_words("dock", " - "));
  EXPECT_FALSE(has_words("", "dock"));
}

TEST(LabelWords, APrefixIsFoundInAnyCase) {
  for (const char* prefix : {"traf", "Traffic L", "TRAFFIC LIGHT", ""})
    EXPECT_TRUE(begins_with("Traffic light", prefix)) << prefix;
  for (const char* prefix : {"light", "traffic lights", "raf"})
    EXPECT_FALSE(begins_with("Traffic light", prefix)) << prefix;
}

}  // namespace
}  // namespace relmap::map
