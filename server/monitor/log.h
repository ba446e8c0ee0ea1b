// The daemon's log on standard error: one line for each event, in the form that its reader wants.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace relmap::monitor {

// auto: journal where standard error leads to the systemd journal, or else text.
// text: "[2026-03-04 05:06:07.089] [relmapd] [info] MESSAGE", in colours on a terminal, in local time.
// json: an object with the keys time (RFC 3339, UTC), level, message, and request_id and trace_id of what is logged for
//   a call.
// journal: "<PRIORITY>MESSAGE", which the journal takes apart (sd-daemon(3)); it knows the time.
// Control characters in a message are escaped in all of them. In text and journal the request's id precedes the message
// in brackets, in text not at level info.
const std::vector<std::string>& log_formats();

// Sets up the log of this process. `format` is one of log_formats(). The last words of a process that ends suddenly
// have the same form. Call it before other threads log.
void set_up_log(const std::string& format);

// Lines at these levels since the start.
struct LogCounts {
  std::uint64_t warnings = 0, errors = 0, criticals = 0;
};
LogCounts log_counts();

}  // namespace relmap::monitor
