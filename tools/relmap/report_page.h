// A report as one page of HTML that needs nothing else: no script, and every picture within it.
#pragma once

#include <string>

#include "tools/relmap/report_data.h"

namespace relmap::cli {

// The page. All that comes from the map, as names, labels and messages, is escaped.
std::string report_page(const MapReport& report);

// What a reader should look at first, most urgent first, as text: "12 keyframes were refused: ...". Empty: nothing.
std::vector<std::string> findings_of(const MapReport& report);

}  // namespace relmap::cli
