// Files of tab-separated lines that a run writes, and an interrupted one goes on with.
#pragma once

#include <fstream>
#include <string>

#include "proto/base/status.h"

namespace relmap::frontend {

// For writing lines under `names`, which is the first. An existing file is replaced; that of an interrupted run that
// `goes_on` is added to. IO_ERROR; INVALID_ARGUMENT: what is there has other columns, and is not a report of this kind.
Result<std::ofstream> open_table(const std::string& path, const std::string& names, bool goes_on);

}  // namespace relmap::frontend
