#include "tools/relmap-admin/runbook.h"

#include <algorithm>

namespace relmap::admin {

namespace {

constexpr std::string_view kFirstLook = "## Where to look first\n";
constexpr std::string_view kGroup = "\n## ";
constexpr std::string_view kName = "### ";

std::string_view line_at(std::string_view text, std::size_t at) {
  return text.substr(at, std::min(text.find('\n', at), text.size()) - at);
}

std::string trimmed(std::string_view text) { return std::string(text.substr(0, text.find_last_not_of('\n') + 1)); }

}  // namespace

Runbook read_runbook() {
  Runbook runbook;
  std::string group;
  for (std::string_view part : runbook_parts()) {
    // The heading of the next group stands at the end of a part, with what is said of the whole group.
    const std::size_t last = part.rfind(kGroup), first = part.find(kGroup);
    if (part.starts_with(kName)) {
      const std::string_view name = line_at(part, 0).substr(kName.size());
      runbook.explanations.push_back({std::string(name), group, trimmed(part.substr(0, first))});
    } else if (const std::size_t at = part.find(kFirstLook); at != std::string_view::npos) {
      runbook.first_look = trimmed(part.substr(at, part.find(kGroup, at) - at));
    }
    if (last != std::string_view::npos) group = line_at(part, last + 1).substr(kGroup.size() - 1);
  }
  return runbook;
}

}  // namespace relmap::admin
