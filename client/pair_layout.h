// Where the two pictures of a pair lie on the page, and the lines between them. Internal to client/.
#pragma once

#include <string>
#include <vector>

#include "client/map_plan.h"
#include "client/pair_picture.h"

namespace relmap::client {

// Of the camera of a side, pixels.
Vector2 camera_size(const PairPicture::Side& side);
// Draws the picture of a side; if there is none, a grey ground that says why.
void draw_side(Drawing& out, const PairPicture::Side& side, const Box& box);

// The two pictures with their titles above them, the matches, and a line below that counts them.
class PairLayout {
 public:
  // In a column that is `width` wide; `pair` must outlive it.
  PairLayout(const PairPicture& pair, const Drawing& measure, double width);

  double height() const { return height_; }
  bool stacked() const { return stacked_; }
  const Box& left() const { return left_; }
  const Box& right() const { return right_; }
  // Of a point of the left or right camera, on the page.
  Vector2 at_left(const Vector2& pixel) const { return left_.low + left_scale_ * pixel; }
  Vector2 at_right(const Vector2& pixel) const { return right_.low + right_scale_ * pixel; }

  // With its top left corner at the origin of the layout, moved by `corner`.
  void draw(Drawing& out, const Vector2& corner) const;

 private:
  struct Words {
    Vector2 at;
    std::string text;
    TextStyle style;
  };
  void add_words(const PairPicture::Side& side, const Vector2& at, double width);
  void draw_matches(Drawing& out, const Vector2& corner) const;

  const PairPicture& pair_;
  const Drawing& measure_;
  bool stacked_ = false;
  Box left_, right_;
  double left_scale_ = 1, right_scale_ = 1;  // points per pixel of the camera
  double height_ = 0;
  std::vector<Words> words_;
};

}  // namespace relmap::client
