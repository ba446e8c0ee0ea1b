#include "client/text_wrap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace relmap::client {
namespace {

using ::testing::ElementsAre;

class TextWrap : public ::testing::TestWithParam<bool> {
 protected:
  const std::unique_ptr<Drawing> measure_ =
      GetParam() ? make_svg_drawing(1, 1, {255, 255, 255}) : make_png_drawing(1, 1, {255, 255, 255}, 2);
};

TEST_P(TextWrap, KeepsAllTextWithinTheWidth) {
  const TextStyle style{.size = 15, .colour = {}};
  for (const std::string text :
       {"a short one", "evening survey of the second robot in the northern hall, on the day before the fair",
        "a_name_without_any_space_that_is_much_wider_than_the_room_that_there_is",
        "Überfahrt nach Größenwahn im Schnee", "WWWWWWWWWWWWWWWWWWWWWWWWWWWWWW mmmmmmmmmmmmmmmmmmmmmmmmmmmmmmm",
        "測量二零二六年十一月二十四日上午第一次行駛"}) {
    std::string together;
    for (const std::string& line : wrap(*measure_, text, style, 120)) {
      EXPECT_LE(measure_->text_width(line, style), 120) << line;
      together += line;
    }
    std::string letters = text;
    const auto no_spaces = [](std::string& s) { s.erase(std::remove(s.begin(), s.end(), ' '), s.end()); };
    no_spaces(letters);
    no_spaces(together);
    EXPECT_EQ(together, letters);
  }
}

TEST_P(TextWrap, BreaksAtSpacesButNotBeforeAUnit) {
  const TextStyle style{.size = 15, .colour = {}};
  const double width = measure_->text_width("route to bakery, 12 m", style) - 1;
  EXPECT_THAT(wrap(*measure_, "route to bakery, 12 m", style, width), ElementsAre("route to bakery,", "12 m"));
  EXPECT_THAT(wrap(*measure_, "", style, width), ElementsAre(""));
}

TEST_P(TextWrap, BreaksANameBehindItsSeparators) {
  const TextStyle style{.size = 15, .colour = {}};
  const double width = measure_->text_width("data/euroc_v101_keyf", style);
  EXPECT_THAT(wrap(*measure_, "data/euroc_v101_keyframes100", style, width),
              ElementsAre("data/euroc_v101_", "keyframes100"));
}

INSTANTIATE_TEST_SUITE_P(Drawings, TextWrap, ::testing::Bool(),
                         [](const auto& which) { return which.param ? "Svg" : "Png"; });

// The widths at 100 points in DejaVu Sans, the widest of the fonts that an SVG asks for.
TEST(SvgText, IsNeverWiderThanItsEstimate) {
  const auto svg = make_svg_drawing(1, 1, {255, 255, 255});
  const TextStyle plain{.size = 100, .colour = {}}, bold{.size = 100, .colour = {}, .bold = true};
  EXPECT_GE(svg->text_width("WWWW", plain), 395.1);
  EXPECT_GE(svg->text_width("illi", plain), 110.7);
  EXPECT_GE(svg->text_width("Part 20 of 20", bold), 732.2);
  EXPECT_GE(svg->text_width("öäü", plain), 185.7);
}

}  // namespace
}  // namespace relmap::client
