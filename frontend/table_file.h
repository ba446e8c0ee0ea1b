// Opens files of tab-separated lines, to which an interrupted run can append.
#pragma once

#include <fstream>
#include <string>

#include "proto/base/status.h"

namespace relmap::frontend {

// Opens a file for writing, whose first line is `names`. Replaces an existing file; if an interrupted run `goes_on`,
// appends to it. IO_ERROR; INVALID_ARGUMENT if the existing file has other columns, so that it is no report of this
// kind.
Result<std::ofstream> open_table(const std::string& path, const std::string& names, bool goes_on);

}  // namespace relmap::frontend
