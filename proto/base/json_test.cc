#include "proto/base/json.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace relmap {
namespace {

TEST(Json, MembersStandInTheOrderInWhichTheyAreAdded) {
  const Json json = Json().add("b", 1).add("a", "text").add("c", Json().add("d", true)).add_null("e");
  EXPECT_EQ(json.text(), R"({"b":1,"a":"text","c":{"d":true},"e":null})");
  EXPECT_EQ(Json().add("b", 1).add("a", 2).text_lines(), "{\n  \"b\":1,\n  \"a\":2\n}\n");
  EXPECT_EQ(Json().text(), "{}");
}

TEST(Json, EveryTextIsReadBackAsItWas) {
  std::string text;
  for (int c = 1; c < 128; ++c) text += static_cast<char>(c);
  text += "\u00e4\u20ac\U0001f916";
  EXPECT_EQ(nlohmann::json::parse(Json().add(text, text).text()).at(text), text);
  EXPECT_EQ(nlohmann::json::parse(Json::quoted("a\xff z")), "a\ufffd z") << "no UTF-8";
}

TEST(Json, NumbersAreReadBackExactly) {
  const std::vector<double> numbers{0, -0.0, 1, -3, 0.1, 1e-300, 1e300, 1.0 / 3, 123456789012345678.0};
  const auto read = nlohmann::json::parse(Json().add("numbers", numbers).text()).at("numbers");
  EXPECT_EQ(read.get<std::vector<double>>(), numbers);
  EXPECT_EQ(Json().add("whole", 12.0).add("tenth", 0.1).add("zero", -0.0).text(),
            R"({"whole":12,"tenth":0.1,"zero":0})");
  EXPECT_EQ(Json().add("most", std::numeric_limits<std::uint64_t>::max()).text(), R"({"most":18446744073709551615})");
  EXPECT_EQ(Json().add("nan", std::numeric_limits<double>::quiet_NaN()).text(), R"({"nan":null})");
}

TEST(Json, RoundsAndMerges) {
  EXPECT_EQ(Json().add("a", 1.23456, 3).add("b", -0.0004, 3).add("c", std::nullopt, 3).text(),
            R"({"a":1.235,"b":0,"c":null})");
  EXPECT_EQ(Json().add("l", {1.23456, -0.0004, 2}, 3).text(), R"({"l":[1.235,0,2]})");
  EXPECT_EQ(Json().add("a", 1).merge(Json().add("b", 2)).text(), R"({"a":1,"b":2})");
}

TEST(Json, WhatIsAbsentIsNull) {
  EXPECT_EQ(Json().add("a", std::optional(Json().add("b", 1))).add("c", std::optional<Json>()).text(),
            R"({"a":{"b":1},"c":null})");
  EXPECT_EQ(Json().add("a", std::optional<std::string>("")).add("b", std::optional<std::string>()).text(),
            R"({"a":"","b":null})");
  EXPECT_EQ(Json().add("a", std::optional(7U)).add("b", std::optional<std::uint64_t>()).text(), R"({"a":7,"b":null})");
}

TEST(Json, AValueThatIsJsonAlreadyStaysAsItIs) {
  EXPECT_EQ(Json().add_json("l", "[[1.50,2.00]]").add("a", 1).text(), R"({"l":[[1.50,2.00]],"a":1})");
}

TEST(Json, ListsHoldObjectsOrTexts) {
  EXPECT_EQ(Json().add("l", std::vector<Json>{Json().add("a", 1), Json()}).text(), R"({"l":[{"a":1},{}]})");
  EXPECT_EQ(Json().add("l", std::vector<std::string>{"a", "\""}).text(), R"({"l":["a","\""]})");
}

}  // namespace
}  // namespace relmap
