// Numbers that programs write for themselves, read back: in tokens, positions and names of files.
#pragma once

#include <charconv>
#include <concepts>
#include <string_view>

namespace relmap {

// Reads the whole text as an unsigned decimal number. False, with `number` as it was, if the text is empty, has
// anything else than digits, a sign or spaces included, or is more than the type holds.
template <std::unsigned_integral Number>
[[nodiscard]] bool read_number(std::string_view text, Number& number) {
  Number read = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), read);
  if (error != std::errc{} || end != text.data() + text.size()) return false;
  number = read;
  return true;
}

}  // namespace relmap
