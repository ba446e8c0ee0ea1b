// One part of the map on the page: a plan of it seen from above, with a grid and a scale of its own.
#pragma once

#include <cstddef>
#include <vector>

#include "client/drawing.h"
#include "client/label_placement.h"
#include "client/map_contents.h"
#include "client/map_plan.h"

namespace relmap::client {

// How motion and closures look; legends show the same.
Stroke motion_stroke(MapPicture::EdgeKind kind, Colour colour);
struct ClosureStyle {
  MapPicture::EdgeKind kind = MapPicture::EdgeKind::kLoopAccepted;
  const char* name = "";
  const char* meaning = "";  // of its dashes
  Stroke stroke;
  bool hollow = false;  // its ends
};
// What is drawn later lies above.
const std::vector<ClosureStyle>& closure_styles();
void draw_closure(Drawing& out, const ClosureStyle& style, const Vector2& from, const Vector2& to);
void draw_start(Drawing& out, const Vector2& at, Colour colour);
void draw_end(Drawing& out, const Vector2& at, Colour colour);
void draw_arrow(Drawing& out, const Vector2& at, const Vector2& direction, Colour colour);
void draw_label_point(Drawing& out, const Vector2& at);
void draw_route_piece(Drawing& out, const std::vector<Vector2>& way);
void draw_route_begin(Drawing& out, const Vector2& at);
void draw_route_end(Drawing& out, const Vector2& at);
// `view`: where it looks, as long as it is drawn.
void draw_query(Drawing& out, const Vector2& at, const Vector2& view);

class MapPanel {
 public:
  // Of this part of what is to be shown, as wide as `width` with its margins; the plan no higher than `tallest`.
  MapPanel(const MapContents& contents, std::size_t part, double width, double tallest);

  std::size_t part() const { return part_; }
  double plan_height() const { return plan_.height() + 2 * inset_; }
  // Below the plan, for the scale.
  static constexpr double kScaleHeight = 30;

  // The plan in the middle of `area`, whose width is that of the panel, the scale below it.
  void draw(Drawing& out, const Box& area) const;

 private:
  class Pen;

  const MapContents& contents_;
  const std::size_t part_;
  const double inset_;
  const MapPlan plan_;
};

}  // namespace relmap::client
