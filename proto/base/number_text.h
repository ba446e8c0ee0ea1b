// Numbers as people read them in messages. (std::to_string() gives six digits behind the point, whatever they are
// worth.) Zero has no sign, nor what is rounded to it.
#pragma once

#include <cstdint>
#include <string>

namespace relmap {

// Three digits, and all that stand before the point: "0.0123", "0.5", "31.6", "1048576". "nan", "inf", "-inf".
std::string number_text(double value);
// So many digits behind the point: "12.34".
std::string fixed(double value, int digits);
// "1,234,567"
std::string count_text(std::uint64_t count);
// "1 keyframe", "12,816 keyframes": of what takes an s.
std::string counted_text(std::uint64_t count, const std::string& what);
// Of a picture, pixels: "640 x 480".
std::string size_text(int width, int height);

}  // namespace relmap
