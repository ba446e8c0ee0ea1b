// Any quadlets as the configuration ROM of a camera, which is read from its registers: it is parsed, or refused with a
// named reason.
#include <cstring>
#include <utility>
#include <vector>

#include "frontend/capture/iidc/config_rom.h"
#include "proto/base/testing/fuzzing.h"

namespace {

using namespace relmap;
using namespace relmap::iidc;
using fuzzing::must;

constexpr std::uint64_t kRom = 0xfffff0000400;  // where every node has it (IEEE 1212)

// A camera that has nothing but a ROM.
class RomLink final : public CameraLink {
 public:
  explicit RomLink(std::vector<std::uint32_t> rom) : rom_(std::move(rom)) {}
  Status read(std::uint64_t address, std::span<std::uint32_t> quadlets) override {
    for (std::uint32_t& quadlet : quadlets) {
      if (address < kRom || (address - kRom) / 4 >= rom_.size()) return {Reason::IO_ERROR, "no such address"};
      quadlet = rom_[(address - kRom) / 4];
      address += 4;
    }
    return {};
  }
  Status write(std::uint64_t, std::uint32_t) override { return {Reason::IO_ERROR, "read only"}; }
  Status claim() override { return {}; }
  Status start(const StreamRequest&) override { return {Reason::NO_BANDWIDTH, "no stream"}; }
  Result<RawFrame> next(std::chrono::milliseconds) override { return Status(Reason::CAMERA_SILENT, "no stream"); }
  void stop() override {}

 private:
  const std::vector<std::uint32_t> rom_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint32_t> quadlets(size / 4);
  if (!quadlets.empty()) std::memcpy(quadlets.data(), data, 4 * quadlets.size());
  RomLink camera(quadlets);
  const auto read = read_config_rom(camera);
  if (read.ok()) must(read->size() <= quadlets.size() && std::equal(read->begin(), read->end(), quadlets.begin()));
  const auto rom = parse_config_rom(quadlets);
  must(rom.ok() || fuzzing::is_one_of(rom.reason(), {Reason::CORRUPT, Reason::TRUNCATED, Reason::UNSUPPORTED}));
  return 0;
}
