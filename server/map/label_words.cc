#include "server/map/label_words.h"

#include <algorithm>
#include <string>
#include <vector>

namespace relmap::map {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::vector<std::string> label_words_of(std::string_view text) {
  std::vector<std::string> words;
  bool within = false;
  for (const char given : text) {
    const char c = lower(given);
    const bool digit = c >= '0' && c <= '9';
    const bool letter = (c >= 'a' && c <= 'z') || (static_cast<unsigned char>(c) & 0x80) != 0;
    if ((letter || digit) && !within) words.emplace_back();
    within = letter || digit;
    if (within) words.back() += c;
  }
  return words;
}

}  // namespace

bool has_words(std::string_view label, std::string_view wanted) {
  const std::vector<std::string> words = label_words_of(label), asked = label_words_of(wanted);
  return std::all_of(asked.begin(), asked.end(), [&](const std::string& word) {
    return std::any_of(words.begin(), words.end(), [&](const std::string& one) { return one.starts_with(word); });
  });
}

bool begins_with(std::string_view label, std::string_view prefix) {
  return label.size() >= prefix.size() &&
         std::equal(prefix.begin(), prefix.end(), label.begin(), [](char a, char b) { return lower(a) == lower(b); });
}

}  // namespace relmap::map
