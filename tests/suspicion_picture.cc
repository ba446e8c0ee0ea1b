#include "tests/suspicion_picture.h"

#include <cmath>
#include <functional>
#include <vector>

#include "client/drawing.h"
#include "client/map_colours.h"
#include "proto/base/number_text.h"
#include "server/map/suspicion.h"
#include "server/map/testing/ordinary_closure.h"

namespace relmap::testing {
namespace {

using client::Anchor;
using client::Colour;
using client::Drawing;
using map::DoubtKind;
using storage::ClosureDigest;

constexpr double kWidth = 1080, kMargin = 30, kGap = 34, kHead = 96, kPanelHeight = 262;
constexpr double kTitle = 20, kAxis = 46, kLeft = 34;  // room above, below and left of the curves of a panel
constexpr int kColumns = 3;
constexpr Colour kPaper{252, 252, 250}, kGrid{228, 228, 222};

// An ordinary closure, which three others confirm. The robot's motion says nothing.
ClosureDigest sound() {
  ClosureDigest closure = map::ordinary_closure();
  closure.agreeing = 3;
  closure.tests = {};
  return closure;
}

double weight_of(DoubtKind kind, const ClosureDigest& closure) {
  for (const map::Doubt& doubt : map::suspicion_of(closure).doubts)
    if (doubt.kind == kind) return doubt.weight;
  return 0;
}

struct Curve {
  std::string name;
  std::function<void(ClosureDigest&, double)> change;  // to what the curve is of, with the fact's value
};
struct Panel {
  DoubtKind kind;
  std::string title, fact;
  double from, to, step;  // of the fact, and between the marks on its axis
  bool counts;            // the fact is a number of things
  std::vector<Curve> curves;
};

// The fact at a closure that others confirm, and at one that nothing confirms.
std::vector<Curve> confirmed_or_not(const std::function<void(ClosureDigest&, double)>& set) {
  return {{"nothing confirms it",
           [set](ClosureDigest& c, double x) {
             c.agreeing = 0;
             set(c, x);
           }},
          {"3 others agree", set}};
}

std::vector<Panel> panels() {
  const auto agreeing = [](std::uint16_t count, void (*set)(ClosureDigest&, double)) {
    return [count, set](ClosureDigest& c, double x) {
      c.agreeing = count;
      set(c, x);
    };
  };
  const auto opposing = [](ClosureDigest& c, double x) { c.tests.opposing = static_cast<std::uint16_t>(x); };
  return {
      {DoubtKind::kFewInliers, "FEW_INLIERS", "points that agree (inliers)", 0, 120, 20, true,
       confirmed_or_not([](ClosureDigest& c, double x) { c.inliers = static_cast<std::uint16_t>(x); })},
      {DoubtKind::kPoorSpread, "POOR_SPREAD", "share of the picture that they cover (spread)", 0, 0.4, 0.1, false,
       confirmed_or_not([](ClosureDigest& c, double x) { c.spread = static_cast<float>(x); })},
      {DoubtKind::kImprobable, "IMPROBABLE", "probability by appearance", 0, 1, 0.2, false,
       confirmed_or_not([](ClosureDigest& c, double x) { c.probability = static_cast<float>(x); })},
      {DoubtKind::kRunnerUp, "RUNNER_UP", "inliers of the runner-up / its own", 0, 1.2, 0.2, false,
       confirmed_or_not([](ClosureDigest& c, double x) {
         c.inliers = 100;
         c.uniqueness.runner_up_inliers = static_cast<std::uint16_t>(std::lround(100 * x));
       })},
      {DoubtKind::kChanged, "CHANGED", "share of what both should show that differs", 0, 1, 0.2, false,
       confirmed_or_not([](ClosureDigest& c, double x) { c.uniqueness.differs = static_cast<float>(x); })},
      {DoubtKind::kTension,
       "TENSION",
       "sigmas by which refinement moved it",
       0,
       20,
       5,
       false,
       {{"", [](ClosureDigest& c, double x) { c.tension = static_cast<float>(x); }}}},
      {DoubtKind::kContradiction,
       "CONTRADICTION",
       "closures that contradicted it",
       0,
       8,
       2,
       true,
       {{"none agrees", agreeing(0, opposing)},
        {"1 agrees", agreeing(1, opposing)},
        {"4 agree", agreeing(4, opposing)},
        {"motion against it, 1 agrees",
         [](ClosureDigest& c, double x) {
           c.agreeing = 1;
           c.tests.motion = storage::MotionSays::kContradicts;
           c.tests.opposing = static_cast<std::uint16_t>(x);
         }}}},
      {DoubtKind::kLonely,
       "LONELY",
       "closures that agree with it",
       0,
       6,
       1,
       true,
       {{"motion says nothing", [](ClosureDigest& c, double x) { c.agreeing = static_cast<std::uint16_t>(x); }},
        {"motion agrees, to 1 m",
         [](ClosureDigest& c, double x) {
           c.agreeing = static_cast<std::uint16_t>(x);
           c.tests.motion = storage::MotionSays::kAgrees;
           c.tests.motion_sigma = 1;
         }}}},
      {DoubtKind::kUnseen,
       "UNSEEN",
       "frames after it that saw nothing of the place",
       0,
       12,
       2,
       true,
       {{"", [](ClosureDigest& c, double x) { c.unseen = static_cast<std::uint16_t>(x); }}}},
  };
}

void draw(const Panel& panel, const Vector2& corner, double width, Drawing& out) {
  const double left = corner.x() + kLeft, right = corner.x() + width, top = corner.y() + kTitle + 8,
               bottom = corner.y() + kPanelHeight - kAxis;
  const auto at = [&](double x, double weight) {
    return Vector2(left + (x - panel.from) / (panel.to - panel.from) * (right - left),
                   bottom - weight * (bottom - top));
  };
  const client::TextStyle small{.size = 12, .colour = client::kFaintColour};
  client::TextStyle below = small, beside = small;
  below.anchor = Anchor::kMiddle;
  beside.anchor = Anchor::kRight;
  out.text({corner.x(), corner.y() + 13}, panel.title, {.size = 15, .colour = client::kInkColour, .bold = true});
  for (const double weight : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    out.line(at(panel.from, weight), at(panel.to, weight), {kGrid, 1, 1, 0});
    out.text(at(panel.from, weight) + Vector2(-6, 4), number_text(weight), beside);
  }
  for (int k = 0; panel.from + k * panel.step <= panel.to + 1e-9; ++k) {
    const double x = panel.from + k * panel.step;
    out.line(at(x, 0), at(x, 0) + Vector2(0, 4), {client::kFaintColour, 1, 1, 0});
    out.text(at(x, 0) + Vector2(0, 18), number_text(x), below);
  }
  below.colour = client::kInkColour;
  below.size = 13;
  out.text({(left + right) / 2, bottom + 36}, panel.fact, below);
  const std::vector<Colour> colours{client::kLoopColour, client::session_colour(0), client::session_colour(1),
                                    client::session_colour(5)};
  // Where no curve is.
  const bool rising_high = panel.curves.size() > 2;
  double legend = rising_high ? bottom - 10 - 17 * static_cast<double>(panel.curves.size() - 1) : top + 12;
  for (std::size_t c = 0; c < panel.curves.size(); ++c) {
    const auto weight = [&](double x) {
      ClosureDigest closure = sound();
      panel.curves[c].change(closure, x);
      return weight_of(panel.kind, closure);
    };
    std::vector<Vector2> line;
    const int steps = panel.counts ? static_cast<int>(panel.to - panel.from) : 120;
    for (int k = 0; k <= steps; ++k) {
      const double x = panel.from + k * (panel.to - panel.from) / steps;
      line.push_back(at(x, weight(x)));
    }
    out.polyline(line, {colours[c], 2.4, 1, 0});
    if (panel.counts && steps <= 12)
      for (const Vector2& point : line) out.disc(point, 3, colours[c], 0, kPaper);
    if (panel.curves[c].name.empty()) continue;
    client::TextStyle named{.size = 12, .colour = client::kInkColour, .anchor = Anchor::kRight, .halo = 2};
    const double length = out.text_width(panel.curves[c].name, named);
    out.line({right - length - 28, legend - 4}, {right - length - 8, legend - 4}, {colours[c], 2.4, 1, 0});
    out.text({right - 2, legend}, panel.curves[c].name, named);
    legend += 17;
  }
}

}  // namespace

std::string suspicion_picture() {
  const std::vector<Panel> all = panels();
  const int rows = (static_cast<int>(all.size()) + kColumns - 1) / kColumns;
  const auto page = client::make_svg_drawing(kWidth, kHead + rows * (kPanelHeight + kGap) - kGap + kMargin, kPaper);
  page->text({kMargin, 42}, "What a fact adds to the suspicion of a closure",
             {.size = 22, .colour = client::kInkColour, .bold = true});
  page->text({kMargin, 68},
             "The weight of each doubt, 0 to 1. All else about the closure is sound: the weights of several doubts "
             "combine to 1 - (1 - w1)(1 - w2)...",
             {.size = 14, .colour = client::kFaintColour});
  const double width = (kWidth - 2 * kMargin - (kColumns - 1) * kGap) / kColumns;
  for (int p = 0; p < static_cast<int>(all.size()); ++p)
    draw(all[static_cast<std::size_t>(p)],
         {kMargin + (p % kColumns) * (width + kGap), kHead + (p / kColumns) * (kPanelHeight + kGap)}, width, *page);
  return page->file().or_throw();
}

}  // namespace relmap::testing
