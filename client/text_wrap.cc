#include "client/text_wrap.h"

#include <algorithm>
#include <cctype>

namespace relmap::client {

namespace {

// The words of `text`. A number and its unit, as in "12 m", are one word.
std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = std::min(text.find(' ', begin), text.size());
    const std::size_t unit = std::min(text.find(' ', end + 1), text.size());
    if (end > begin && std::isdigit(static_cast<unsigned char>(text[end - 1])) && end < unit && unit - end <= 4)
      end = unit;
    if (end > begin) words.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

// Whether a long name such as "drives/2026-11-24_morning" may be broken behind `c`.
bool separates(char c) { return c == '/' || c == '_' || c == '-' || c == '.' || c == ','; }

// The end of the letter that begins at `at`.
std::size_t after_letter(const std::string& utf8, std::size_t at) {
  for (++at; at < utf8.size() && (static_cast<unsigned char>(utf8[at]) & 0xC0) == 0x80;) ++at;
  return at;
}

}  // namespace

std::vector<std::string> wrap(const Drawing& measure, const std::string& utf8, const TextStyle& style, double width) {
  const auto fits = [&](const std::string& line) { return measure.text_width(line, style) <= width; };
  std::vector<std::string> lines(1);
  for (std::string word : words_of(utf8)) {
    const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
    if (fits(longer)) {
      lines.back() = longer;
      continue;
    }
    if (!lines.back().empty()) lines.emplace_back();
    while (!fits(word)) {
      std::size_t end = after_letter(word, 0);
      for (std::size_t next = end; next < word.size() && fits(word.substr(0, next = after_letter(word, next)));)
        end = next;
      if (end == word.size()) break;  // one letter is wider than the room
      for (std::size_t behind = end; behind > 1; --behind)
        if (separates(word[behind - 1])) {
          end = behind;
          break;
        }
      lines.back() = word.substr(0, end);
      lines.emplace_back();
      word.erase(0, end);
    }
    lines.back() = word;
  }
  return lines;
}

}  // namespace relmap::client
