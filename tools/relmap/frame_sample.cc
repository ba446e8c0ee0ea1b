#include "tools/relmap/frame_sample.h"

#include <algorithm>

namespace relmap::cli {

namespace {

constexpr std::uint64_t kFewest = 3;  // of a session

// The k-th of `chosen` positions that are spread evenly from 0 to `count` - 1; `chosen` is at most `count`.
std::uint64_t position(std::uint64_t k, std::uint64_t chosen, std::uint64_t count) {
  return chosen < 2 ? 0 : k * (count - 1) / (chosen - 1);
}

}  // namespace

std::vector<SampledSession> sample_frames(const std::vector<client::Session>& sessions, std::size_t most) {
  std::vector<const client::Session*> with_frames;
  for (const client::Session& session : sessions)
    if (session.frames > 0 && session.last >= session.first) with_frames.push_back(&session);
  const std::size_t chosen = std::min(most, with_frames.size());
  std::vector<const client::Session*> sampled;
  std::uint64_t frames = 0;
  for (std::size_t k = 0; k < chosen; ++k) {
    sampled.push_back(with_frames[position(k, chosen, with_frames.size())]);
    frames += sampled.back()->frames;
  }
  std::vector<SampledSession> sample;
  for (const client::Session* session : sampled) {
    const std::uint64_t indices = std::uint64_t{session->last} - session->first + 1;
    const std::uint64_t share = std::max<std::uint64_t>(kFewest, most * session->frames / frames);
    const std::uint64_t wanted = std::min({share, std::uint64_t{session->frames}, indices});
    SampledSession& of_session = sample.emplace_back(SampledSession{session->number, {}});
    for (std::uint64_t k = 0; k < wanted; ++k)
      of_session.indices.push_back(session->first + static_cast<std::uint32_t>(position(k, wanted, indices)));
  }
  return sample;
}

}  // namespace relmap::cli
