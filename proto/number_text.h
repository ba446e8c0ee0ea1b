// Numbers as people read them in messages. (std::to_string() gives six digits behind the point, whatever they are
// worth.)
#pragma once

#include <string>

namespace relmap {

// Three digits, and all that stand before the point: "0.0123", "0.5", "31.6", "1048576". "nan", "inf", "-inf".
std::string number_text(double value);
// Of a picture, pixels: "640 x 480".
std::string size_text(int width, int height);

}  // namespace relmap
