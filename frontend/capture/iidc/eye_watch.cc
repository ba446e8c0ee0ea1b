#include "frontend/capture/iidc/eye_watch.h"

#include <algorithm>
#include <string>

#include "proto/base/number_text.h"

namespace relmap::iidc {

namespace {

constexpr int kStepX = 16, kStepY = 8;  // pixels of the grid
constexpr int kBlank = 6;               // grey levels between the darkest and the brightest pixel, as noise alone has
constexpr int kFrozen = 5;              // pairs without any change; the noise of two exposures always differs

struct Seen {
  std::vector<std::uint8_t> grid;
  int range = 0;
  int mean = 0;
};

Seen see(vision::ImageView picture) {
  Seen seen;
  int darkest = 255, brightest = 0;
  long sum = 0;
  for (int y = kStepY / 2; y < picture.height; y += kStepY)
    for (int x = kStepX / 2; x < picture.width; x += kStepX) {
      const int pixel = picture.at(x, y);
      darkest = std::min(darkest, pixel);
      brightest = std::max(brightest, pixel);
      sum += pixel;
      seen.grid.push_back(static_cast<std::uint8_t>(pixel));
    }
  if (seen.grid.empty()) return seen;
  seen.range = brightest - darkest;
  seen.mean = static_cast<int>(sum / static_cast<long>(seen.grid.size()));
  return seen;
}

}  // namespace

EyeWatch::Verdict EyeWatch::look(vision::ImageView left, vision::ImageView right) {
  const std::array<vision::ImageView, 2> pictures = {left, right};
  std::array<Seen, 2> seen = {see(left), see(right)};
  std::array<bool, 2> blank, still;
  for (std::size_t i = 0; i < 2; ++i) {
    blank[i] = pictures[i].empty() || seen[i].range < kBlank;
    still[i] = seen[i].grid == eyes_[i].grid;
    eyes_[i].grid.swap(seen[i].grid);
  }
  Verdict verdict;
  for (std::size_t i = 0; i < 2; ++i) {
    Status& told = i == 0 ? verdict.left : verdict.right;
    const std::string name = i == 0 ? "the left eye" : "the right eye";
    const std::size_t other = 1 - i;
    if (still[i] && !still[other])
      ++eyes_[i].frozen;
    else if (!still[i])
      eyes_[i].frozen = 0;
    if (blank[i] && !blank[other])
      told = {Reason::EYE_DEAD, name + " shows nothing (grey " + number_text(seen[i].mean) + " all over)"};
    else if (eyes_[i].frozen >= kFrozen)
      told = {Reason::EYE_DEAD, name + " shows the same picture all the time"};
  }
  return verdict;
}

}  // namespace relmap::iidc
