// Hexadecimal text: lower case, two digits a byte, leading zeros included.
#pragma once

#include <cstdint>
#include <string>

#include "proto/base/bytes.h"

namespace relmap {

std::string hex(ByteSpan bytes);        // the first byte first
std::string hex(std::uint32_t number);  // 8 digits
std::string hex(std::uint64_t number);  // 16 digits
int hex_digit(char c);                  // the value of a digit in either case; -1 for any other character

}  // namespace relmap
