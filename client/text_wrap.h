// Texts of a page that must not be longer than the room that there is.
#pragma once

#include <string>
#include <vector>

#include "client/drawing.h"

namespace relmap::client {

// Lines no wider than `width`, of all of the text: broken at spaces, but not between a number and its unit; a word that
// is too long, behind the last / _ - . or comma that fits, or between its letters. At least one line.
std::vector<std::string> wrap(const Drawing& measure, const std::string& utf8, const TextStyle& style, double width);

}  // namespace relmap::client
