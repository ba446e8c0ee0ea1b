#include "proto/base/json_object.h"

#include <gtest/gtest.h>

#include "proto/base/json.h"

namespace relmap {
namespace {

TEST(JsonObject, HasWhatJsonWrote) {
  const std::string text = "a \"quoted\"\nline, \u20ac";
  const auto read = JsonObject::parse(Json().add("text", text).add("number", -1.5).add("whole", 7).add("", "e").text());
  ASSERT_TRUE(read.has_value());
  ASSERT_TRUE(read->text("text"));
  EXPECT_EQ(*read->text("text"), text);
  EXPECT_EQ(read->number("number"), -1.5);
  EXPECT_EQ(read->number("whole"), 7);
  EXPECT_EQ(*read->text(""), "e");
  EXPECT_FALSE(read->text("number"));
  EXPECT_FALSE(read->number("text"));
  EXPECT_FALSE(read->text("other"));
  EXPECT_TRUE(JsonObject::parse("{}").has_value());
}

TEST(JsonObject, LeavesOutWhatIsNested) {
  const auto read = JsonObject::parse(R"({"a":{"b":"inner"},"l":["x",{"b":1}],"t":true,"n":null,"b":"outer"})");
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(*read->text("b"), "outer");
  EXPECT_FALSE(read->text("a"));
  EXPECT_FALSE(read->text("l"));
}

TEST(JsonObject, IsNothingElse) {
  for (const char* text : {"", "7", "\"a\"", "[1]", "[{\"a\":1}]", "{", "{\"a\":1", "{\"a\":1}x", "{\"a\":1}{\"a\":2}",
                           "{a:1}", "null", "{\"a\":\"\xff\"}"})
    EXPECT_FALSE(JsonObject::parse(text).has_value()) << text;
  EXPECT_FALSE(JsonObject::parse(std::string(100'000, '[')).has_value());
  EXPECT_FALSE(JsonObject::parse("{\"a\":" + std::string(100'000, '[')).has_value());
}

}  // namespace
}  // namespace relmap
