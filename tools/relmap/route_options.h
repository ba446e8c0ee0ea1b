// The options by which the user describes a route.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tools/relmap/view_options.h"

namespace relmap::cli {

struct RouteOptions {
  std::vector<std::string> from, to;  // each an end and its alternatives
  std::string by = "distance";
  bool standing = false;
  std::vector<std::string> weights;
  double max_cost = 0;
  std::vector<std::string> sessions, avoid, suppose;
  std::uint32_t min_support = 0;
  bool no_long_loops = false, covariance = false;
  std::uint32_t alternatives = 0;
};
void add_route_options(CLI::App& command, RouteOptions& options, bool required);

Result<client::RouteRequest> make_route_request(client::Client& client, terminal::Console& console,
                                                const RouteOptions& options, const ViewOptions& camera);

}  // namespace relmap::cli
