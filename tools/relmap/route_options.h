// A route as the user asks for it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "tools/relmap/view_options.h"

namespace relmap::cli {

struct RouteOptions {
  std::string from, to, by = "distance";
  bool standing = false;
  double max_cost = 0;
};
void add_route_options(CLI::App& command, RouteOptions& options, bool required);

Result<client::RouteRequest> make_route_request(client::Client& client, Console& console, const RouteOptions& options,
                                                const ViewOptions& camera);

}  // namespace relmap::cli
