// Breaks texts into lines.
#pragma once

#include <string>
#include <vector>

#include "client/drawing.h"

namespace relmap::client {

// Breaks a text into lines no wider than `width` (unless a single letter is wider), and returns at least one. It breaks
// at spaces, but not between a number and its unit. A word that is too long is broken behind the last / _ - . or comma
// that fits, or else between letters.
std::vector<std::string> wrap(const Drawing& measure, const std::string& utf8, const TextStyle& style, double width);

}  // namespace relmap::client
