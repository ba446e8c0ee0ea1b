// Two pictures side by side with the points that both show joined by lines, so that a person sees whether they are of
// one place: the ends of a loop closure, or a picture and a place of the map that it could show. Wide pictures lie
// above each other instead. A sheet has several pairs, one a row.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/drawing.h"
#include "client/map_types.h"

namespace relmap::client {

struct PairPicture {
  struct Side {
    std::string title;                 // "1:85"
    std::vector<std::string> details;  // each in a line of its own: when, in which session
    // JPEG or PNG. If there is none, the points are drawn on a grey ground that says why.
    FramePicture picture;
    // Of the camera in whose pixels the points are. 0: of the picture without its scale.
    std::uint32_t camera_width = 0, camera_height = 0;
  };
  struct Point {
    Vector2 left = Vector2::Zero(), right = Vector2::Zero();  // pixels of the cameras
    bool inlier = false;
    bool beside = false;  // on one side it is only projected from a frame beside: drawn hollow
  };
  // A bar for a value between 0 and 1, with its text.
  struct Gauge {
    double value = 0;
    std::string text;
    Colour colour;
    bool strong = false;  // larger than those that explain it
  };

  std::string title;  // "2:85/1, in force"
  Side left, right;
  std::vector<Point> points;
  std::string no_points;  // why there are none; for display
  std::vector<Gauge> gauges;
  std::vector<std::string> notes;  // a paragraph each
  std::optional<Side> other;       // another place that the right picture could show; small, in a single pair only
};

struct PairSheet {
  std::string title, subtitle;
  std::vector<PairPicture> pairs;
};

// Of the inliers at most so many are joined by lines, and so many of the others; further ones are points only.
inline constexpr std::size_t kMaxInlierLines = 60, kMaxOutlierLines = 24;

// The picture as the bytes of a file; of a PNG, with one pixel a point. The reasons of Drawing::file().
Result<std::string> draw_pair(const PairPicture& pair, PictureFormat format);
// Pairs in rows, each with its gauges and notes beside it. EMPTY_MAP: there is no pair.
Result<std::string> draw_pair_sheet(const PairSheet& sheet, PictureFormat format);

}  // namespace relmap::client
