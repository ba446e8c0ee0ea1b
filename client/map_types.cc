#include "client/map_types.h"

#include <array>

namespace relmap::client {

namespace {
constexpr std::array<const char*, 5> kStates = {"unknown", "candidate", "accepted", "quarantined", "removed"};
constexpr std::array<const char*, 4> kSessionStates = {"open", "ended", "frozen", "deleting"};
constexpr std::array<const char*, 4> kKinds = {"unknown", "odometry", "loop", "prior"};
constexpr std::array<const char*, 7> kVerifications = {"none",     "stereo",     "pnp",       "epipolar",
                                                       "imported", "homography", "compounded"};

constexpr std::array<const char*, 10> kDoubts = {"unknown",
                                                 "few inliers",
                                                 "poor spread",
                                                 "improbable by appearance",
                                                 "another place fits as well",
                                                 "the place differs",
                                                 "contradicted",
                                                 "few agree",
                                                 "under tension",
                                                 "not seen beyond"};

template <std::size_t N, typename Enum>
const char* pick(const std::array<const char*, N>& names, Enum value) {
  const auto i = static_cast<std::size_t>(value);
  return i < N ? names[i] : "unknown";
}
}  // namespace

const char* name_of(EdgeState state) { return pick(kStates, state); }
const char* name_of(SessionState state) { return pick(kSessionStates, state); }
const char* name_of(EdgeKind kind) { return pick(kKinds, kind); }
const char* name_of(Verification verification) { return pick(kVerifications, verification); }

const char* name_of(DoubtKind kind) {
  const auto i = static_cast<std::size_t>(kind);
  return kDoubts[i < kDoubts.size() ? i : 0];
}

std::optional<EdgeState> parse_edge_state(std::string_view text) {
  for (std::size_t i = 1; i < kStates.size(); ++i)
    if (text == kStates[i]) return static_cast<EdgeState>(i);
  return std::nullopt;
}

}  // namespace relmap::client
