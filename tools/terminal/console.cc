#include "tools/terminal/console.h"

#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <iostream>
#include <sstream>

#include "proto/base/bar_text.h"
#include "proto/base/printf_text.h"
#include "proto/base/visible_text.h"

namespace relmap::terminal {

namespace {

std::string padded(const std::string& text, std::size_t width, bool right) {
  const std::string pad(width - std::min(width, width_of(text)), ' ');
  return right ? pad + text : text + pad;
}

}  // namespace

void Console::reply(const std::string& document) {
  if (json && !aside_) out_ << document << '\n';
}

void Console::report(const Status& why) {
  if (why.ok()) return;
  std::istringstream lines(why.to_string());  // a message may have several
  for (std::string line; std::getline(lines, line);) err_ << visible_text(line) << '\n';
}

void Console::table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& cells) {
  std::vector<std::vector<std::string>> rows = cells;
  for (auto& row : rows)
    for (std::string& cell : row) cell = visible_text(cell);
  std::vector<std::size_t> widths;
  std::vector<std::string> names = header;
  std::vector<bool> right;
  for (std::string& name : names) {
    right.push_back(name.starts_with('>'));
    if (right.back()) name.erase(0, 1);
    widths.push_back(width_of(name));
  }
  for (const auto& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  const auto print = [&](const std::vector<std::string>& row) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += padded(row[i], widths[i], right[i]) + "  ";
    line.erase(line.find_last_not_of(' ') + 1);
    out_ << line << '\n';
  };
  print(names);
  for (const auto& row : rows) print(row);
}

void Console::facts(const std::vector<std::pair<std::string, std::string>>& facts) {
  std::size_t width = 0;
  for (const auto& fact : facts) width = std::max(width, width_of(visible_text(fact.first)));
  for (const auto& [name, value] : facts)
    out_ << padded(visible_text(name), width, false) << "  " << visible_text(value) << '\n';
}

std::string bytes_text(std::uint64_t bytes) {
  const auto value = static_cast<double>(bytes);
  if (value >= 1e9) return printf_text("%.1f GB", value / 1e9);
  if (value >= 1e6) return printf_text("%.1f MB", value / 1e6);
  return printf_text("%.1f kB", value / 1e3);
}

std::string duration_text(double seconds) {
  if (seconds < 120) return printf_text("%.1f s", seconds);
  const auto minutes = static_cast<long>(seconds / 60);
  if (minutes < 120) return printf_text("%ld min %02ld s", minutes, static_cast<long>(seconds) % 60);
  if (minutes < 48 * 60) return printf_text("%ld h %02ld min", minutes / 60, minutes % 60);
  return printf_text("%ld d %ld h", minutes / (24 * 60), minutes / 60 % 24);
}

std::string vector_text(const Vector3& v) {
  return "(" + fixed(v.x(), 3) + ", " + fixed(v.y(), 3) + ", " + fixed(v.z(), 3) + ")";
}

std::string bar_text(std::uint64_t used, std::uint64_t whole) {
  constexpr std::uint64_t kWidth = 20;
  const double part = whole == 0 ? 0 : std::min(1.0, static_cast<double>(used) / static_cast<double>(whole));
  auto filled = static_cast<std::uint64_t>(part * kWidth + 0.5);
  if (used > 0 && filled == 0) filled = 1;
  return filled_bar_text(filled, kWidth);
}

std::size_t width_of(const std::string& utf8) {
  return static_cast<std::size_t>(
      std::count_if(utf8.begin(), utf8.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

bool can_ask() { return isatty(STDIN_FILENO) != 0 && isatty(STDERR_FILENO) != 0; }

Status ask(Console& console, const std::string& question) {
  console.err() << visible_text(question) << " [y/N] " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  if (answer == "y" || answer == "Y" || answer == "yes" || answer == "Yes") return {};
  if (!std::cin) console.err() << '\n';  // after an end of input the cursor is still behind the question
  return {Reason::NOT_CONFIRMED, "nothing is changed"};
}

}  // namespace relmap::terminal
