#include "tests/camera/config_rom.h"

#include <cstddef>
#include <span>

namespace relmap::testing {

namespace {

using Quadlets = std::vector<std::uint32_t>;

std::uint16_t crc(std::span<const std::uint32_t> quadlets) {
  std::uint32_t sum = 0;
  for (const std::uint32_t quadlet : quadlets)
    for (int bit = 31; bit >= 0; --bit) {
      const std::uint32_t carry = (sum >> 15) ^ (quadlet >> bit & 1);
      sum = (sum << 1 ^ (carry & 1) * 0x1021) & 0xffff;
    }
  return static_cast<std::uint16_t>(sum);
}

// Its first quadlet tells the length and the check sum of the others.
void seal(Quadlets& block) {
  const std::span<const std::uint32_t> rest = std::span(block).subspan(1);
  block[0] = static_cast<std::uint32_t>(rest.size()) << 16 | crc(rest);
}

Quadlets text_leaf(const std::string& text) {
  Quadlets leaf(3 + (text.size() + 3) / 4);  // after the header: minimal ASCII, no language
  for (std::size_t i = 0; i < text.size(); ++i)
    leaf[3 + i / 4] |= static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])) << (24 - 8 * (i % 4));
  seal(leaf);
  return leaf;
}

// An entry that points from its own place to another.
std::uint32_t pointer(std::uint32_t key, std::size_t from, std::size_t to) {
  return key << 24 | static_cast<std::uint32_t>(to - from);
}

}  // namespace

std::vector<std::uint32_t> ConfigRom::quadlets() const {
  const auto vendor_id = static_cast<std::uint32_t>(guid >> 40);
  const Quadlets vendor_leaf = text_leaf(vendor), model_leaf = text_leaf(model);
  constexpr std::size_t kRoot = 5, kRootSize = 5, kUnit = kRoot + kRootSize, kUnitSize = 4;
  constexpr std::size_t kDependent = kUnit + kUnitSize, kDependentSize = 5, kVendor = kDependent + kDependentSize;
  const std::size_t model_at = kVendor + vendor_leaf.size();

  Quadlets bus = {0, 0x31333934, 0x0000'a002, static_cast<std::uint32_t>(guid >> 32), static_cast<std::uint32_t>(guid)};
  Quadlets root = {0, 0x03u << 24 | vendor_id, pointer(0x81, kRoot + 2, kVendor), 0x0c00'83c0,
                   pointer(0xd1, kRoot + 4, kUnit)};
  Quadlets unit = {0, 0x1200'a02d, 0x1300'0102, pointer(0xd4, kUnit + 3, kDependent)};
  Quadlets dependent = {0, 0x40u << 24 | command_registers / 4, pointer(0x81, kDependent + 2, kVendor),
                        pointer(0x82, kDependent + 3, model_at), 0x3800'0020};  // version 1.32
  seal(root);
  seal(unit);
  seal(dependent);
  Quadlets all = bus;
  for (const Quadlets& block : {root, unit, dependent, vendor_leaf, model_leaf})
    all.insert(all.end(), block.begin(), block.end());
  const std::span<const std::uint32_t> checked = std::span(all).subspan(1);
  all[0] = 4u << 24 | static_cast<std::uint32_t>(checked.size()) << 16 | crc(checked);
  return all;
}

}  // namespace relmap::testing
