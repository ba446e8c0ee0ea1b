#include "tools/console/http/router.h"

#include <algorithm>
#include <utility>

#include "proto/base/percent.h"

namespace relmap::console {

namespace {

constexpr std::size_t kMaxParameters = 32;

std::vector<std::string> split(std::string_view path) {
  std::vector<std::string> parts;
  while (!path.empty()) {
    path.remove_prefix(1);  // of the slash
    const std::size_t end = std::min(path.find('/'), path.size());
    parts.emplace_back(path.substr(0, end));
    path.remove_prefix(end);
  }
  return parts;
}

bool is_printable(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
}

}  // namespace

void Router::add(Route route) {
  std::vector<std::string> pattern = split(route.pattern);
  entries_.push_back({std::move(route), std::move(pattern)});
}

Result<Router::Match> Router::find(std::string_view method, std::string_view path) const {
  if (!path.starts_with('/')) return Status(Reason::INVALID_ARGUMENT, "the path does not begin with /");
  const std::vector<std::string> parts = split(path);
  bool other_method = false;
  for (const Entry& entry : entries_) {
    if (entry.pattern.size() != parts.size()) continue;
    Match match{&entry.route, {}};
    bool fits = true;
    for (std::size_t i = 0; fits && i < parts.size(); ++i) {
      if (entry.pattern[i] != "*") {
        fits = entry.pattern[i] == parts[i];
        continue;
      }
      auto part = percent_decoded(parts[i]);
      if (!part) return Status(Reason::INVALID_ARGUMENT, "a % in the path is not followed by two hexadecimal digits");
      fits = !part->empty();
      match.parts.push_back(std::move(*part));
    }
    if (!fits) continue;
    if (entry.route.method == method) return match;
    other_method = true;
  }
  if (other_method) return Status(Reason::UNSUPPORTED, "this path has another method than " + std::string(method));
  return Status(Reason::NO_SUCH_FILE, "the console has nothing at this path");
}

Status parse_target(std::string_view target, std::string& path, std::map<std::string, std::string>& query) {
  const auto refused = [](const char* what) { return Status(Reason::INVALID_ARGUMENT, what); };
  if (!target.starts_with('/') || !is_printable(target)) return refused("the target of the request is no path");
  const std::size_t mark = std::min(target.find('?'), target.size());
  path = target.substr(0, mark);
  std::string_view rest = target.substr(std::min(mark + 1, target.size()));
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string_view pair = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const std::size_t equals = std::min(pair.find('='), pair.size());
    auto name = percent_decoded(pair.substr(0, equals));
    auto value = percent_decoded(pair.substr(std::min(equals + 1, pair.size())));
    if (!name || !value) return refused("a % in the query is not followed by two hexadecimal digits");
    if (query.size() >= kMaxParameters) return refused("the query has more than 32 parameters");
    query[std::move(*name)] = std::move(*value);
  }
  return {};
}

}  // namespace relmap::console
