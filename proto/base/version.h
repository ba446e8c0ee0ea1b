// Which relmap this is. Every program prints version_line() for --version.
//
// What they return is compiled into the library relmap_version, of which only programs and what is made for them may
// ask: whoever links it is linked again after each commit.
#pragma once

#include <string>
#include <string_view>

namespace relmap {

// "0.2.0"
std::string_view version();

// The commit that the sources are of: its first 12 digits, with "-modified" behind them if a tracked file differs from
// it. Empty if that is not known, since the sources were built outside a git repository.
std::string_view build_commit();

// The day of that commit, "2026-11-30", or of SOURCE_DATE_EPOCH; empty if neither is known.
std::string_view build_date();

// "relmap 0.2.0 (ed5a5e5e5e0e)", or "relmap 0.2.0" if the commit is not known.
std::string version_line();

}  // namespace relmap
