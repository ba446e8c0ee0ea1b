#include "proto/base/number_text.h"

#include <cmath>
#include <cstdio>
#include <string_view>

namespace relmap {

std::string number_text(double value) {
  char text[400];  // the largest double has 309 digits
  std::snprintf(text, sizeof text, std::abs(value) < 999.5 ? "%.3g" : "%.0f", value + 0.0);  // -0 + 0 is 0
  return text;
}

std::string fixed(double value, int digits) {
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  const std::string_view digits_of = text;
  return digits_of.find_first_of("123456789in") == std::string_view::npos && text[0] == '-' ? text + 1 : text;
}

std::string count_text(std::uint64_t count) {
  std::string text = std::to_string(count);
  for (std::size_t end = text.size(); end > 3; end -= 3) text.insert(end - 3, ",");
  return text;
}

std::string counted_text(std::uint64_t count, const std::string& what) {
  return count_text(count) + " " + what + (count == 1 ? "" : "s");
}

std::string size_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

}  // namespace relmap
