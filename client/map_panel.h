// Draws one part of the map as a plan seen from above, with its own grid and scale.
#pragma once

#include <cstddef>
#include <vector>

#include "client/drawing.h"
#include "client/label_placement.h"
#include "client/map_contents.h"
#include "client/map_plan.h"

namespace relmap::client {

// The styles of motion and closures, on the plan and in the legend.
Stroke motion_stroke(MapPicture::EdgeKind kind, Colour colour);
struct ClosureStyle {
  MapPicture::EdgeKind kind = MapPicture::EdgeKind::kLoopAccepted;
  const char* name = "";
  const char* meaning = "";  // of its dashes, for the legend
  Stroke stroke;
  bool hollow = false;  // its ends are drawn hollow
};
// In the order of drawing: later ones lie above earlier ones.
const std::vector<ClosureStyle>& closure_styles();
void draw_closure(Drawing& out, const ClosureStyle& style, const Vector2& from, const Vector2& to);
void draw_start(Drawing& out, const Vector2& at, Colour colour);
void draw_end(Drawing& out, const Vector2& at, Colour colour);
void draw_arrow(Drawing& out, const Vector2& at, const Vector2& direction, Colour colour);
// A line that is torn in its middle.
void draw_tear(Drawing& out, const Vector2& from, const Vector2& to);
void draw_label_point(Drawing& out, const Vector2& at);
void draw_route_piece(Drawing& out, const std::vector<Vector2>& way);
void draw_route_begin(Drawing& out, const Vector2& at);
void draw_route_end(Drawing& out, const Vector2& at);
// `view`: the direction in which the camera looks; its length is that of the drawn cone.
void draw_query(Drawing& out, const Vector2& at, const Vector2& view);

class MapPanel {
 public:
  // `width` includes the margins; the plan is at most `max_height` high. `contents` must outlive the panel.
  MapPanel(const MapContents& contents, std::size_t part, double width, double max_height);

  std::size_t part() const { return part_; }
  double plan_height() const { return plan_.height() + 2 * inset_; }
  // Room below the plan, for the scale.
  static constexpr double kScaleHeight = 30;

  // Draws the plan in the middle of `area`, which must be as wide as the panel, and the scale below `area`.
  void draw(Drawing& out, const Box& area) const;

 private:
  class Pen;

  const MapContents& contents_;
  const std::size_t part_;
  const double inset_;
  const MapPlan plan_;
};

}  // namespace relmap::client
