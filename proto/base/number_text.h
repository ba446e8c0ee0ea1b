// Numbers formatted for messages, unlike std::to_string(), which always gives six decimals. Zero has no sign, and
// neither has a number that is rounded to zero.
#pragma once

#include <cstdint>
#include <string>

namespace relmap {

// Three significant digits, but all digits before the point: "0.0123", "0.5", "31.6", "1048576". "nan", "inf", "-inf".
std::string number_text(double value);
// `digits` decimals: "12.34".
std::string fixed(double value, int digits);
// "1,234,567"
std::string count_text(std::uint64_t count);
// "1 keyframe", "12,816 keyframes". `what` must take an s in the plural.
std::string counted_text(std::uint64_t count, const std::string& what);
// The size of a picture in pixels: "640 x 480".
std::string size_text(int width, int height);

}  // namespace relmap
