// docs/runbook.md, which is part of the program: whoever needs it may have nothing else at hand.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relmap::admin {

// A paragraph of the runbook: what an alert or a reason means, and what to do.
struct Explanation {
  std::string name;   // "RelmapDown", "DISK_FULL"
  std::string group;  // the heading above it
  std::string text;   // Markdown, with its heading
  bool is_alert() const { return name.starts_with("Relmap"); }
};

struct Runbook {
  std::string first_look;  // "Where to look first", Markdown
  std::vector<Explanation> explanations;
};
Runbook read_runbook();

// The text of docs/runbook.md, cut before each of its "### ", since compilers limit the length of one literal.
std::span<const std::string_view> runbook_parts();

}  // namespace relmap::admin
