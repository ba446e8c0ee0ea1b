// What a drawing in SVG holds, for tests: its texts and where they lie, its lines, its pictures.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "client/drawing.h"
#include "client/map_plan.h"

namespace relmap::client {

inline int count_in(const std::string& text, const std::string& part) {
  int n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

// The texts of an SVG, and an upper bound of where each ends: texts are assumed to be as wide as they were laid out.
struct SvgText {
  double left = 0, right = 0, y = 0, size = 0;
  std::string text;
  Box box() const { return {{left, y - 0.75 * size}, {right, y + 0.2 * size}}; }
};
inline std::vector<SvgText> texts_of(const std::string& svg) {
  const auto measure = make_svg_drawing(1, 1, {255, 255, 255});
  std::vector<SvgText> texts;
  for (std::size_t at = svg.find("<text "); at != std::string::npos; at = svg.find("<text ", at + 1)) {
    SvgText text;
    char anchor[16] = {};
    EXPECT_EQ(std::sscanf(svg.c_str() + at, R"(<text x="%lf" y="%lf" font-size="%lf" text-anchor="%15[a-z]")",
                          &text.left, &text.y, &text.size, anchor),
              4);
    const std::size_t begin = svg.find('>', at) + 1;
    text.text = svg.substr(begin, svg.find("</text>", at) - begin);
    TextStyle style;
    style.size = text.size;
    style.bold = svg.substr(at, begin - at).find("bold") != std::string::npos;
    const double width = measure->text_width(text.text, style);
    if (std::string(anchor) == "end") text.left -= width;
    if (std::string(anchor) == "middle") text.left -= width / 2;
    text.right = text.left + width;
    texts.push_back(text);
  }
  return texts;
}

// All lines of text, joined by spaces.
inline std::string said_in(const std::string& svg) {
  std::string all;
  for (const SvgText& text : texts_of(svg)) all += text.text + " ";
  return all;
}

inline std::pair<double, double> page_of(const std::string& svg) {
  double width = 0, height = 0;
  EXPECT_EQ(std::sscanf(svg.c_str() + svg.find(" width="), R"( width="%lf" height="%lf")", &width, &height), 2);
  return {width, height};
}

inline void expect_nothing_cut_off(const std::string& svg) {
  const auto [width, height] = page_of(svg);
  for (const SvgText& text : texts_of(svg)) {
    EXPECT_GE(text.left, 0) << text.text;
    EXPECT_LE(text.right, width) << text.text;
    EXPECT_LE(text.y, height - 10) << text.text;
  }
}

// The points of each line.
inline std::vector<std::vector<Vector2>> lines_of(const std::string& svg) {
  constexpr char kBegin[] = "<polyline points=\"";
  std::vector<std::vector<Vector2>> lines;
  for (std::size_t at = svg.find(kBegin); at != std::string::npos; at = svg.find(kBegin, at + 1)) {
    std::vector<Vector2>& line = lines.emplace_back();
    const char* next = svg.c_str() + at + sizeof kBegin - 1;
    for (Vector2 point; std::sscanf(next, "%lf,%lf", &point.x(), &point.y()) == 2;) {
      line.push_back(point);
      while (*next != ' ' && *next != '"') ++next;
      if (*next == '"') break;
      ++next;
    }
  }
  return lines;
}

// Where the embedded pictures lie.
inline std::vector<Box> pictures_of(const std::string& svg) {
  std::vector<Box> boxes;
  for (std::size_t at = svg.find("<image "); at != std::string::npos; at = svg.find("<image ", at + 1)) {
    Vector2 corner, size;
    EXPECT_EQ(std::sscanf(svg.c_str() + at, R"(<image x="%lf" y="%lf" width="%lf" height="%lf")", &corner.x(),
                          &corner.y(), &size.x(), &size.y()),
              4);
    boxes.push_back({corner, corner + size});
  }
  return boxes;
}

}  // namespace relmap::client
