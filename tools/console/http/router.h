// Finds the route of a request.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/base/status.h"
#include "tools/console/http/message.h"

namespace relmap::console {

class Router {
 public:
  void add(Route route);

  struct Match {
    const Route* route = nullptr;
    std::vector<std::string> parts;  // decoded
  };
  // The route of the method and path; the first of those that fit. NO_SUCH_FILE: nothing is at this path. UNSUPPORTED:
  // the path has another method. INVALID_ARGUMENT: the path is malformed.
  Result<Match> find(std::string_view method, std::string_view path) const;

 private:
  struct Entry {
    Route route;
    std::vector<std::string> pattern;
  };
  std::vector<Entry> entries_;
};

// Takes the path and the parameters of a request's target apart. INVALID_ARGUMENT: it is not "/PATH?NAME=VALUE&...".
Status parse_target(std::string_view target, std::string& path, std::map<std::string, std::string>& query);

}  // namespace relmap::console
