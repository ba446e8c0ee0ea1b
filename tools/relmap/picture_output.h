// Pictures that commands write: pairs, sheets, strips, maps.
#pragma once

#include <string>

#include "client/drawing.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

// Writes the bytes of a file so that it is there whole, or as it was before; "-" is standard output. IO_ERROR.
Status write_output(const std::string& path, const std::string& bytes, terminal::Console& console);

}  // namespace relmap::cli
