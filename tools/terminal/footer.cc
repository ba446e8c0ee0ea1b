#include "tools/terminal/footer.h"

#include <algorithm>
#include <cstddef>
#include <sstream>
#include <utility>

namespace relmap::terminal {

namespace {

constexpr std::size_t kIndent = 2;
constexpr const char* kExamples = "Examples";

std::size_t indent_of(const std::string& line) { return std::min(line.find_first_not_of(' '), line.size()); }

void append(std::string& text, const std::string& more) {
  if (!text.empty()) text += ' ';
  text += more;
}

FooterPart list_under(const std::string& line) {
  FooterPart list;
  list.heading = line.substr(0, line.size() - 1);
  if (list.heading == "Example") list.heading = kExamples;
  return list;
}

void add_line(FooterPart& list, const std::string& line) {
  if (list.heading == kExamples) {
    list.commands.push_back(line.substr(kIndent));
    return;
  }
  const std::string text = line.substr(indent_of(line));
  if (indent_of(line) > kIndent && !list.items.empty()) {
    append(list.items.back().text, text);
    return;
  }
  const std::size_t end = std::min(text.find("  "), text.size());
  const std::size_t begin = std::min(text.find_first_not_of(' ', end), text.size());
  list.items.push_back({text.substr(0, end), text.substr(begin)});
}

}  // namespace

std::vector<FooterPart> parts_of(const std::string& footer) {
  std::vector<std::string> lines;
  std::istringstream stream(footer);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);

  std::vector<FooterPart> parts;
  std::string paragraph;
  const auto end_paragraph = [&] {
    if (!paragraph.empty()) parts.push_back({std::exchange(paragraph, ""), "", {}, {}});
  };
  const auto indented = [&](std::size_t i) { return i < lines.size() && indent_of(lines[i]) >= kIndent; };
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].empty()) {
      end_paragraph();
    } else if (lines[i].ends_with(':') && indented(i + 1)) {
      end_paragraph();
      FooterPart list = list_under(lines[i]);
      while (indented(i + 1)) add_line(list, lines[++i]);
      parts.push_back(std::move(list));
    } else {
      append(paragraph, lines[i].substr(indent_of(lines[i])));
    }
  }
  end_paragraph();
  return parts;
}

}  // namespace relmap::terminal
