#include "frontend/capture/iidc/config_rom.h"

#include <optional>

#include "frontend/capture/iidc/registers.h"

namespace relmap::iidc {

namespace {

constexpr std::size_t kMaxQuadlets = 256;
constexpr std::uint32_t kBusName = 0x31333934;  // "1394"

// Keys of directory entries: two bits of type (0 immediate, 1 CSR offset, 2 leaf, 3 directory), six of what.
enum Key : std::uint8_t {
  kVendorId = 0x03,
  kSpecifierId = 0x12,
  kSoftwareVersion = 0x13,
  kCommandRegisters = 0x40,
  kTextLeaf = 0x81,       // of the entry before it; in IIDC's unit dependent directory the vendor's name
  kModelNameLeaf = 0x82,  // in the same directory
  kUnitDirectory = 0xd1,
  kUnitDependentDirectory = 0xd4,
};

struct Entry {
  std::uint8_t key;
  std::uint32_t value;  // 24 bits
  std::size_t target;   // what it points to, if it does
};

using Quadlets = std::span<const std::uint32_t>;

Status behind(std::size_t at) {
  return {Reason::TRUNCATED, "the configuration ROM points to its quadlet " + std::to_string(at) + ", behind its end"};
}

Result<std::vector<Entry>> directory(Quadlets rom, std::size_t at) {
  if (at >= rom.size()) return behind(at);
  const std::size_t entries = rom[at] >> 16;
  if (at + entries >= rom.size()) return behind(at + entries);
  std::vector<Entry> found;
  for (std::size_t i = at + 1; i <= at + entries; ++i)
    found.push_back({static_cast<std::uint8_t>(rom[i] >> 24), rom[i] & 0xffffff, i + (rom[i] & 0xffffff)});
  return found;
}

const Entry* find(const std::vector<Entry>& entries, Key key) {
  for (const Entry& entry : entries)
    if (entry.key == key) return &entry;
  return nullptr;
}

// The text of a leaf: its length, two quadlets of coding (0 for ASCII), characters up to the first 0. Only printable
// characters are kept.
std::string text(Quadlets rom, const Entry* leaf) {
  std::string found;
  if (!leaf || leaf->target >= rom.size()) return found;
  const std::size_t length = rom[leaf->target] >> 16;
  for (std::size_t i = leaf->target + 3; i <= leaf->target + length && i < rom.size(); ++i)
    for (int shift = 24; shift >= 0; shift -= 8) {
      const char letter = static_cast<char>(rom[i] >> shift & 0xff);
      if (letter == 0) return found;
      if (letter >= ' ' && letter <= '~') found += letter;
    }
  return found;
}

}  // namespace

Result<ConfigRom> parse_config_rom(Quadlets rom) {
  rom = rom.first(std::min(rom.size(), kMaxQuadlets));
  if (rom.size() < 6) return {Reason::TRUNCATED, "a configuration ROM of " + std::to_string(rom.size()) + " quadlets"};
  if (rom[1] != kBusName) return {Reason::CORRUPT, "the configuration ROM does not begin as one of an IEEE 1394 node"};
  ConfigRom result;
  result.guid = std::uint64_t{rom[3]} << 32 | rom[4];
  const auto root = directory(rom, 1 + (rom[0] >> 24));
  if (!root.ok()) return root.status();
  if (const Entry* vendor = find(*root, kVendorId)) {
    result.vendor_id = vendor->value;
    if (vendor + 1 < root->data() + root->size() && vendor[1].key == kTextLeaf) result.vendor = text(rom, vendor + 1);
  }
  for (const Entry& entry : *root) {
    if (entry.key != kUnitDirectory) continue;
    const auto unit = directory(rom, entry.target);
    if (!unit.ok()) return unit.status();
    const Entry* const specifier = find(*unit, kSpecifierId);
    const Entry* const version = find(*unit, kSoftwareVersion);
    if (!specifier || specifier->value != kIidcSpecifier || !version || version->value < kIidcVersionFirst) continue;
    result.version = version->value;
    const Entry* const dependent = find(*unit, kUnitDependentDirectory);
    if (!dependent) return {Reason::CORRUPT, "the IIDC unit has no unit dependent directory"};
    const auto details = directory(rom, dependent->target);
    if (!details.ok()) return details.status();
    const Entry* const registers = find(*details, kCommandRegisters);
    if (!registers) return {Reason::CORRUPT, "the IIDC unit does not say where its registers are"};
    result.command_registers = kRegisterSpace + 4 * std::uint64_t{registers->value};
    if (std::string name = text(rom, find(*details, kTextLeaf)); !name.empty()) result.vendor = std::move(name);
    result.model = text(rom, find(*details, kModelNameLeaf));
    return result;
  }
  return {Reason::UNSUPPORTED, "no unit of IIDC in its configuration ROM"};
}

Result<std::vector<std::uint32_t>> read_config_rom(CameraLink& link) {
  std::vector<std::uint32_t> rom;
  while (rom.size() < kMaxQuadlets) {
    std::uint32_t quadlet = 0;
    const Status status = link.read(kConfigRom + 4 * rom.size(), {&quadlet, 1});
    if (status.reason() == Reason::IO_ERROR && rom.size() > 5) break;
    if (!status.ok()) return status;
    rom.push_back(quadlet);
  }
  return rom;
}

}  // namespace relmap::iidc
