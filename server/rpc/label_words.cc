#include "server/rpc/label_words.h"

#include <algorithm>
#include <string>
#include <vector>

namespace relmap {
namespace {

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  bool within = false;
  for (const char c : text) {
    const bool upper = c >= 'A' && c <= 'Z', digit = c >= '0' && c <= '9';
    const bool letter = upper || (c >= 'a' && c <= 'z') || (static_cast<unsigned char>(c) & 0x80) != 0;
    if ((letter || digit) && !within) words.emplace_back();
    within = letter || digit;
    if (within) words.back() += upper ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return words;
}

}  // namespace

bool has_words(std::string_view label, std::string_view wanted) {
  const std::vector<std::string> words = words_of(label), asked = words_of(wanted);
  return std::all_of(asked.begin(), asked.end(), [&](const std::string& word) {
    return std::any_of(words.begin(), words.end(), [&](const std::string& one) { return one.starts_with(word); });
  });
}

}  // namespace relmap
