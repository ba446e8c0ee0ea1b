// Reads pages of a daemon's HTTP port as curl does.
#pragma once

#include <map>
#include <string>

namespace relmap::testing {

struct HttpAnswer {
  int status = 0;  // 0: there was no answer
  std::string body;
};

// GET of the path at HOST:PORT, an IPv4 address. Waits at most five seconds for an answer.
HttpAnswer http_get(const std::string& address, const std::string& path);

// The samples of a page of metrics: values by "name{labels}".
std::map<std::string, double> samples_of(const std::string& page);

}  // namespace relmap::testing
