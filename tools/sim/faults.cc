#include "tools/sim/faults.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>
#include <utility>

#include "tools/sim/random.h"

namespace relmap::sim {
namespace {

struct Kind {
  FaultKind kind;
  const char* name;
  double duration;  // seconds; 0: a single pair
};
constexpr double kSwing = 0.25;  // seconds, each way
constexpr std::array<Kind, 11> kKinds{{{FaultKind::kNone, "none", 0},
                                       {FaultKind::kDropped, "dropped", 0},
                                       {FaultKind::kBlack, "black", 1},
                                       {FaultKind::kLongBlack, "long_black", 10},
                                       {FaultKind::kSwivel, "swivel", 2 * kSwing},
                                       {FaultKind::kBlur, "blur", 1},
                                       {FaultKind::kOneEye, "one_eye", 2},
                                       {FaultKind::kMover, "mover", 3},
                                       {FaultKind::kDoubled, "doubled", 0},
                                       {FaultKind::kTimeBack, "time_back", 0},
                                       {FaultKind::kTimeAhead, "time_ahead", 0}}};

const Kind& entry(FaultKind kind) { return kKinds[static_cast<std::size_t>(kind)]; }
bool single(FaultKind kind) { return entry(kind).duration == 0; }

Status bad(const std::string& message) { return {Reason::INVALID_ARGUMENT, message}; }

Result<std::vector<FaultEpisode>> all_faults(int frames, double rate) {
  std::vector<FaultEpisode> episodes;
  int free = frames;
  for (const Kind& k : kKinds)
    if (k.kind > FaultKind::kDropped && k.kind != FaultKind::kLongBlack) {
      episodes.push_back({k.kind, 0});
      free -= episodes.back().end(rate);
    }
  const int gaps = static_cast<int>(episodes.size()) + 1;
  if (free < 2 * gaps) return bad("all faults need more than " + std::to_string(frames) + " frames");
  int taken = 0;
  for (int k = 0; k + 1 < gaps; ++k) {
    const int length = episodes[k].end(rate);
    episodes[k].begin = (k + 1) * free / gaps + taken;
    taken += length;
  }
  return episodes;
}

}  // namespace

const char* fault_name(FaultKind kind) { return entry(kind).name; }

int FaultEpisode::end(double rate) const {
  return begin + std::max(1, static_cast<int>(std::ceil(entry(kind).duration * rate - 1e-9)));
}

Result<std::vector<FaultEpisode>> parse_faults(const std::string& text, int frames, double rate) {
  if (text == "all") return all_faults(frames, rate);
  std::vector<FaultEpisode> episodes;
  if (text == "none") return episodes;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    const std::size_t colon = std::min(word.find(':'), word.size());
    const auto kind =
        std::find_if(kKinds.begin(), kKinds.end(), [&](const Kind& k) { return word.compare(0, colon, k.name) == 0; });
    if (kind == kKinds.end() || kind->kind == FaultKind::kNone) return bad("no fault is called \"" + word + "\"");
    FaultEpisode episode{kind->kind, 0};
    const char *begin = word.data() + std::min(colon + 1, word.size()), *end = word.data() + word.size();
    const auto [rest, error] = std::from_chars(begin, end, episode.begin);
    if (error != std::errc() || rest != end) return bad("\"" + word + "\" is not kind:frame");
    episodes.push_back(episode);
  }
  return episodes;
}

Status check_faults(const std::vector<FaultEpisode>& episodes, int frames, double rate) {
  for (const FaultEpisode& a : episodes) {
    if (a.kind == FaultKind::kNone) return bad("a fault needs a kind");
    if (a.begin < 1 || a.begin >= frames)
      return bad(std::string(fault_name(a.kind)) + " begins at frame " + std::to_string(a.begin) + ", not in 1 .. " +
                 std::to_string(frames - 1));
    for (const FaultEpisode& b : episodes)
      if (&a != &b && a.begin < b.end(rate) && b.begin < a.end(rate))
        return bad(std::string(fault_name(a.kind)) + " and " + fault_name(b.kind) + " overlap at frame " +
                   std::to_string(std::max(a.begin, b.begin)));
  }
  return {};
}

namespace {

// A swing of the head from rest to rest; its rate rises and falls in short smooth ramps, so that there are derivatives.
HeadTurn swing(double t) {
  constexpr double kRate = 190 * M_PI / 180, kRamp = 0.03;
  const double last = kSwing - kRamp;
  if (t <= 0) return {};
  if (t >= kSwing) return {kRate * last, 0, 0};
  if (t > kSwing / 2) {
    const HeadTurn mirrored = swing(kSwing - t);
    return {kRate * last - mirrored.angle, mirrored.rate, -mirrored.acceleration};
  }
  if (t >= kRamp) return {kRate * (t - kRamp / 2), kRate, 0};
  const double x = t / kRamp;
  return {kRate * kRamp * (x * x * x - x * x * x * x / 2), kRate * (3 - 2 * x) * x * x,
          kRate * 6 * x * (1 - x) / kRamp};
}

}  // namespace

FaultSchedule::FaultSchedule(std::vector<FaultEpisode> episodes, double drop_share, double rate, std::uint64_t seed)
    : episodes_(std::move(episodes)), drop_share_(drop_share), rate_(rate), seed_(seed) {
  std::sort(episodes_.begin(), episodes_.end(),
            [](const FaultEpisode& a, const FaultEpisode& b) { return a.begin < b.begin; });
}

const FaultEpisode* FaultSchedule::episode_at(int i) const {
  const auto after = std::upper_bound(episodes_.begin(), episodes_.end(), i,
                                      [](int frame, const FaultEpisode& e) { return frame < e.begin; });
  return after != episodes_.begin() && i < (after - 1)->end(rate_) ? &*(after - 1) : nullptr;
}

FaultKind FaultSchedule::at(int i) const {
  if (dropped(i)) return FaultKind::kDropped;
  const FaultEpisode* episode = episode_at(i);
  return episode ? episode->kind : FaultKind::kNone;
}

bool FaultSchedule::dropped(int i) const {
  const FaultEpisode *here = episode_at(i), *next = episode_at(i + 1);
  if (here && here->kind == FaultKind::kDropped) return true;
  if (i == 0 || (here && single(here->kind)) || (next && next->kind != FaultKind::kDropped && single(next->kind)))
    return false;
  return Random(seed_, 19, static_cast<std::uint64_t>(i)).chance(drop_share_);
}

bool FaultSchedule::black(int i, bool right) const {
  const FaultEpisode* episode = episode_at(i);
  if (!episode) return false;
  if (episode->kind != FaultKind::kOneEye)
    return episode->kind == FaultKind::kBlack || episode->kind == FaultKind::kLongBlack;
  const auto earlier =
      std::count_if(episodes_.data(), episode, [](const FaultEpisode& e) { return e.kind == FaultKind::kOneEye; });
  return right == (earlier % 2 == 0);
}

int FaultSchedule::shown(int i) const {
  const FaultEpisode* episode = episode_at(i);
  return episode && episode->kind == FaultKind::kDoubled ? shown(i - 1) : i;
}

HeadTurn FaultSchedule::head_turn(double frame) const {
  const double t = since(FaultKind::kSwivel, frame);
  if (t < 0) return {};
  const HeadTurn out = swing(t), back = swing(t - kSwing);
  return {out.angle - back.angle, out.rate - back.rate, out.acceleration - back.acceleration};
}

double FaultSchedule::since(FaultKind kind, double frame) const {
  for (const FaultEpisode& e : episodes_)
    if (e.kind == kind && frame >= e.begin && frame < e.end(rate_)) return (frame - e.begin) / rate_;
  return -1;
}

}  // namespace relmap::sim
