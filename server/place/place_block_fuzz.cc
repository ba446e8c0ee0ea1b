// Parses any bytes as a block of places; a block that is accepted must be usable.
#include "server/place/block_scores.h"
#include "server/place/testing/random_vocabulary.h"

namespace {

struct Model {
  std::shared_ptr<const relmap::place::Vocabulary> vocabulary = relmap::place::random_vocabulary(300, 1, 1);
  relmap::place::FabMapModel terms{*vocabulary};
  relmap::place::BlockScores scores{terms};
  Model() {
    std::vector<std::uint32_t> all(300);
    for (std::uint32_t w = 0; w < 300; ++w) all[w] = w;
    scores.ask(all);
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Model model;
  const auto block = relmap::place::PlaceBlock::parse({data, size}, model.terms.size());
  if (!block.ok()) return 0;
  std::vector<relmap::place::LogLikelihood> values(block->places());
  model.scores.of_block(*block, values.data());
  // The block must also serve as the older part of a block that grows.
  if (block->places() == relmap::place::kPlacesPerBlock) return 0;
  std::uint64_t last = 0;
  for (const relmap::place::FrameRun& run : block->frames()) last = run.first.packed() + run.count - 1;
  const relmap::place::PlaceWords more{relmap::FrameId::unpack(last + 1), {1, 2, 299}};
  if (!more.frame.valid()) return 0;
  const relmap::Bytes bytes = relmap::place::encode_place_block(model.terms, &*block, {&more, 1});
  if (!relmap::place::PlaceBlock::parse(bytes, model.terms.size()).ok()) __builtin_trap();
  return 0;
}
