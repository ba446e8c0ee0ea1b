// What happens to a map, in lines that a person reads.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client/map_types.h"
#include "client/watch_types.h"

namespace relmap::cli {

// Frames are gathered until flush(): they come by the thousand.
class WatchView {
 public:
  // The sessions whose names are known.
  void know(const std::vector<client::Session>& sessions);

  // The lines that an event is told in, without their ends; none for what only counts, or is no news. All that comes
  // from the map is shown as visible_text() does.
  std::vector<std::string> lines_of(const client::WatchEvent& event);
  // A line for each session with frames since the last call.
  std::vector<std::string> flush();

 private:
  struct Motion {
    std::int64_t time_us = 0;  // of the last of it
    std::uint64_t added = 0, moved = 0;
    std::uint32_t first = 0, last = 0;  // added
  };
  std::string session_text(SessionNumber session) const;
  bool storage_is_news(const Status& state);

  std::map<SessionNumber, std::string> names_;
  std::map<SessionNumber, client::SessionState> states_;  // that were told
  std::map<SessionNumber, Motion> motion_;
  Reason storage_ = Reason::OK;
};

// "2026-11-30 16:12:03", in local time.
std::string local_time_text(std::int64_t time_us);

}  // namespace relmap::cli
