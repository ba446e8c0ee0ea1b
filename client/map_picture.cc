#include "client/map_picture.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <unordered_map>

#include "client/drawing.h"
#include "client/label_placement.h"
#include "client/map_plan.h"

namespace relmap {
namespace {

// Okabe and Ito's palette, which readers with colour-blindness can tell apart, without the two that closures and
// routes have.
constexpr std::array<Colour, 6> kSessionColours{Colour{0, 114, 178},  Colour{0, 138, 100}, Colour{148, 73, 150},
                                                Colour{70, 160, 210}, Colour{125, 95, 45}, Colour{85, 85, 95}};
constexpr Colour kPaper{252, 252, 250}, kGrid{233, 233, 228}, kInk{38, 42, 48}, kFaint{112, 118, 126},
    kLoop{213, 94, 0}, kRoute{246, 190, 40}, kQuery{193, 18, 60}, kWhite{255, 255, 255};

constexpr double kMargin = 36, kLegendWidth = 236, kGap = 28, kInset = 34, kTallestPlan = 640;

struct LoopStyle {
  MapPicture::EdgeKind kind;
  const char* name;
  Stroke stroke;
};
constexpr std::array<LoopStyle, 4> kLoopStyles{
    LoopStyle{MapPicture::EdgeKind::kLoopRemoved, "removed closure", {kFaint, 1.2, 0.7, 3}},
    LoopStyle{MapPicture::EdgeKind::kLoopQuarantined, "quarantined closure", {kQuery, 1.4, 0.8, 5}},
    LoopStyle{MapPicture::EdgeKind::kLoopCandidate, "candidate closure", {kFaint, 1.4, 0.9, 5}},
    LoopStyle{MapPicture::EdgeKind::kLoopAccepted, "loop closure", {kLoop, 3, 1, 0}}};

std::string counted(std::size_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

// The largest of 1, 2, 5 times a power of ten that is at most `limit`.
double round_length(double limit) {
  const double power = std::pow(10, std::floor(std::log10(limit)));
  for (const double factor : {5.0, 2.0})
    if (factor * power <= limit) return factor * power;
  return power;
}

std::string length_name(double metres) {
  char text[32];
  if (metres >= 1000)
    std::snprintf(text, sizeof text, "%g km", metres / 1000);
  else
    std::snprintf(text, sizeof text, "%g m", metres);
  return text;
}

class Composer {
 public:
  explicit Composer(const MapPicture& picture)
      : picture_(picture),
        header_(kMargin + (picture.title.empty() ? 0 : 34) + (picture.subtitle.empty() ? 0 : 26)),
        area_width_(picture.width - 2 * kMargin - kLegendWidth - kGap),
        plan_(positions(picture), area_width_ - 2 * kInset, kTallestPlan, picture.turn_to_fit) {
    const double area_height = std::max(plan_.height() + 2 * kInset, legend_height());
    area_ = {{kMargin, header_}, {kMargin + area_width_, header_ + area_height}};
    shift_ = area_.low + Vector2(kInset, (area_height - plan_.height()) / 2);
    for (const MapPicture::Frame& f : picture.frames) frames_.emplace(f.id, &f);
    for (const MapPicture::Frame& f : picture.frames) sessions_[f.id.session].push_back(f.id);
    for (auto& [session, ids] : sessions_) std::sort(ids.begin(), ids.end());
    for (const MapPicture::Edge& e : picture.edges)
      if (e.kind == MapPicture::EdgeKind::kOdometry || e.kind == MapPicture::EdgeKind::kPrior)
        steps_.emplace(std::max(e.a, e.b), &e);
  }

  double height() const { return area_.high.y() + kMargin + 26; }

  void draw(Drawing& out) {
    LabelPlacement placement(area_);
    header(out);
    grid(out);
    if (picture_.route) route(out);
    for (const auto& [session, ids] : sessions_) trajectory(out, session, ids, placement);
    closures(out);
    for (const auto& [session, ids] : sessions_) ends(out, session, ids);
    labels(out, placement);
    if (picture_.query)
      query_marker(out, page(picture_.query->T_picture_query), 36 * plan_.heading(picture_.query->T_picture_query));
    legend(out);
  }

 private:
  static std::vector<Vector3> positions(const MapPicture& picture) {
    std::vector<Vector3> out;
    for (const auto& f : picture.frames) out.push_back(f.T_picture_frame.t);
    if (picture.query) out.push_back(picture.query->T_picture_query.t);
    return out;
  }

  Vector2 page(const SE3& pose) const { return shift_ + plan_.at(pose.t); }
  // Where a frame stands; false if it is not in the picture.
  bool find(FrameId id, Vector2& at) const {
    const auto found = frames_.find(id);
    if (found == frames_.end()) return false;
    at = page(found->second->T_picture_frame);
    return true;
  }
  Colour colour(SessionNumber session) const {
    const auto place = std::distance(sessions_.begin(), sessions_.find(session));
    return kSessionColours[static_cast<std::size_t>(place) % kSessionColours.size()];
  }

  void header(Drawing& out) const {
    double y = kMargin;
    if (!picture_.title.empty())
      out.text({kMargin, y + 18}, picture_.title, {.size = 26, .colour = kInk, .bold = true});
    y += picture_.title.empty() ? 0 : 34;
    if (!picture_.subtitle.empty()) out.text({kMargin, y + 12}, picture_.subtitle, {.size = 16, .colour = kFaint});
  }

  void grid(Drawing& out) const {
    out.rectangle(area_.low, area_.size(), kWhite, 1);
    const double bar = round_length(170 / plan_.points_per_metre()), step = bar * plan_.points_per_metre();
    const Vector2 middle = (area_.low + area_.high) / 2;
    const Stroke thin{kGrid, 1, 1, 0};
    for (int k = -100; k <= 100; ++k) {
      const double x = middle.x() + k * step, y = middle.y() + k * step;
      if (x > area_.low.x() && x < area_.high.x()) out.line({x, area_.low.y()}, {x, area_.high.y()}, thin);
      if (y > area_.low.y() && y < area_.high.y()) out.line({area_.low.x(), y}, {area_.high.x(), y}, thin);
    }
    out.polyline({area_.low, {area_.high.x(), area_.low.y()}, area_.high, {area_.low.x(), area_.high.y()}, area_.low},
                 {{214, 214, 208}, 1, 1, 0});
    const double y = area_.high.y() + 24, x = area_.low.x() + 2;
    out.polyline({{x, y - 5}, {x, y}, {x + step, y}, {x + step, y - 5}}, {kInk, 2, 1, 0});
    out.text({x + step + 10, y + 3}, length_name(bar), {.size = 15, .colour = kInk});
    out.text({area_.high.x(), y + 3}, "seen from above, grid " + length_name(bar),
             {.size = 13, .colour = kFaint, .anchor = Anchor::kRight});
  }

  void route(Drawing& out) const {
    std::vector<Vector2> way;
    Vector2 at;
    for (const FrameId id : picture_.route->frames)
      if (find(id, at)) way.push_back(at);
    if (way.empty()) return;
    out.polyline(way, {kRoute, 13, 0.75, 0});
    out.disc(way.front(), 9, kRoute, 0, kRoute);
    out.disc(way.back(), 9, kRoute, 0, kRoute);
  }

  // Runs of frames joined by motion; those bridged by a prior are joined by dashes.
  void trajectory(Drawing& out, SessionNumber session, const std::vector<FrameId>& ids,
                  LabelPlacement& placement) const {
    const Colour full = colour(session), early = mix(full, kWhite, 0.5);
    const auto shade = [&](std::size_t k) {
      return mix(early, full, ids.size() < 2 ? 1.0 : static_cast<double>(k) / static_cast<double>(ids.size() - 1));
    };
    std::vector<std::vector<Vector2>> runs;
    std::vector<std::size_t> begins;  // of each run
    std::vector<std::array<std::size_t, 2>> bridges;
    std::vector<Vector2> at;
    for (std::size_t k = 0; k < ids.size(); ++k) {
      at.push_back(page(frames_.at(ids[k])->T_picture_frame));
      const auto step = k == 0 ? steps_.end() : steps_.find(ids[k]);
      const bool joined = step != steps_.end() && std::min(step->second->a, step->second->b) == ids[k - 1];
      const bool bridged = joined && step->second->kind == MapPicture::EdgeKind::kPrior;
      if (bridged) bridges.push_back({k - 1, k});
      if (!joined || bridged) {
        runs.emplace_back();
        begins.push_back(k);
      }
      runs.back().push_back(at[k]);
      for (double t = 0.25; joined && t <= 1; t += 0.25) placement.avoid(at[k - 1] + t * (at[k] - at[k - 1]));
    }
    constexpr std::size_t kShades = 48;  // pieces that show the course of time
    const std::size_t piece = std::max<std::size_t>(1, ids.size() / kShades);
    for (std::size_t r = 0; r < runs.size(); ++r) {
      out.polyline(runs[r], {kWhite, 4.8, 0.85, 0});
      for (std::size_t k = 0; k + 1 < runs[r].size(); k += piece) {
        const auto begin = runs[r].begin() + static_cast<std::ptrdiff_t>(k);
        const std::size_t count = std::min(piece + 1, runs[r].size() - k);
        out.polyline({begin, begin + static_cast<std::ptrdiff_t>(count)}, {shade(begins[r] + k), 3, 1, 0});
      }
      arrows(out, runs[r], begins[r], shade);
    }
    for (const auto& [from, to] : bridges) out.line(at[from], at[to], {shade(to), 2, 1, 6});
  }

  template <typename Shade>
  static void arrows(Drawing& out, const std::vector<Vector2>& run, std::size_t begin, const Shade& shade) {
    double travelled = 60;
    for (std::size_t k = 1; k < run.size(); ++k) {
      const Vector2 step = run[k] - run[k - 1];
      travelled += step.norm();
      if (travelled < 130 || step.norm() < 1e-6) continue;
      travelled = 0;
      const Vector2 along = step.normalized() * 6.5, side(-along.y() * 0.75, along.x() * 0.75), at = run[k];
      out.polygon({at + along, at - along + side, at - 0.5 * along, at - along - side},
                  mix(shade(begin + k), kInk, 0.25), 1);
    }
  }

  void closures(Drawing& out) const {
    Vector2 a, b;
    for (const LoopStyle& style : kLoopStyles)
      for (const MapPicture::Edge& e : picture_.edges) {
        if (e.kind != style.kind || !find(e.a, a) || !find(e.b, b)) continue;
        out.line(a, b, style.stroke);
        for (const Vector2& end : {a, b}) out.disc(end, 3.2, style.stroke.colour, 0, kWhite);
      }
  }

  void ends(Drawing& out, SessionNumber session, const std::vector<FrameId>& ids) const {
    const Colour ink = colour(session);
    out.disc(page(frames_.at(ids.front())->T_picture_frame), 6.5, kWhite, 3, ink);
    if (ids.size() > 1) out.disc(page(frames_.at(ids.back())->T_picture_frame), 7.5, ink, 2, kWhite);
  }

  void labels(Drawing& out, LabelPlacement& placement) const {
    if (picture_.query) {
      const Vector2 at = page(picture_.query->T_picture_query);
      placement.avoid(Box{at - Vector2(22, 22), at + Vector2(22, 22)});
    }
    for (const auto& [session, ids] : sessions_)
      for (const FrameId id : {ids.front(), ids.back()}) {
        const Vector2 at = page(frames_.at(id)->T_picture_frame);
        placement.avoid(Box{at - Vector2(8, 8), at + Vector2(8, 8)});
      }
    for (const MapPicture::Label& label : picture_.labels) {
      Vector2 at;
      if (!find(label.frame, at)) continue;
      leader(out, placement, at, label.text, {.size = 17, .colour = kInk, .bold = true, .halo = 2});
      out.disc(at, 5, kInk, 2, kWhite);
    }
    if (sessions_.size() > 3) return;
    for (const auto& [session, ids] : sessions_) {
      const TextStyle style{.size = 14, .colour = mix(colour(session), kInk, 0.4), .halo = 2};
      leader(out, placement, page(frames_.at(ids.front())->T_picture_frame), "start", style);
      if (ids.size() > 1) leader(out, placement, page(frames_.at(ids.back())->T_picture_frame), "end", style);
    }
  }

  void leader(Drawing& out, LabelPlacement& placement, const Vector2& at, const std::string& text,
              const TextStyle& style) const {
    const Vector2 size(out.text_width(text, style), style.size);
    const Box box = placement.place(at, size);
    const Vector2 near = at.cwiseMax(box.low - Vector2(3, 1)).cwiseMin(box.high + Vector2(3, 1));
    if ((near - at).norm() > 12) out.line(at, near, {style.colour, 1.2, 0.8, 0});
    out.text({box.low.x(), box.high.y() - 0.14 * style.size}, text, style);
  }

  static void query_marker(Drawing& out, const Vector2& at, const Vector2& view) {
    const Vector2 side(-view.y(), view.x());
    out.polygon({at, at + view + 0.45 * side, at + view - 0.45 * side}, kQuery, 0.3);
    out.disc(at, 8, kQuery, 3, kWhite);
  }

  // The legend: a column of samples and texts.
  struct Entry {
    std::string text;
    int lines = 1;
  };
  static constexpr double kLine = 21, kEntryGap = 9;

  double legend_height() const {
    const std::size_t sessions = std::min<std::size_t>(8, picture_.session_names.size() + 1);
    return 190 +
           kLine * static_cast<double>(2 * sessions + 2 * (picture_.route ? 1 : 0) + 2 * (picture_.query ? 1 : 0));
  }

  // Breaks a text at spaces, but not between a number and its unit; at most four lines, the last one cut.
  static std::vector<std::string> wrap(const Drawing& out, const std::string& text, const TextStyle& style,
                                       double width) {
    std::vector<std::string> lines(1);
    for (std::size_t begin = 0; begin < text.size();) {
      std::size_t end = std::min(text.find(' ', begin), text.size());
      const std::size_t unit = std::min(text.find(' ', end + 1), text.size());
      if (end > begin && std::isdigit(static_cast<unsigned char>(text[end - 1])) && end < unit && unit - end <= 4)
        end = unit;
      const std::string word = text.substr(begin, end - begin);
      const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
      if (out.text_width(longer, style) <= width || lines.back().empty())
        lines.back() = longer;
      else if (lines.size() < 4)
        lines.push_back(word);
      else
        return lines.back() += " ...", lines;
      begin = end + 1;
    }
    return lines;
  }

  void legend(Drawing& out) const {
    const double left = area_.high.x() + kGap, text_left = left + 42;
    double y = area_.low.y() + 8;
    const TextStyle plain{.size = 15, .colour = kInk}, small{.size = 13, .colour = kFaint};
    const auto entry = [&](const std::string& text, const std::string& detail, auto sample) {
      sample(Vector2(left, y + 4), Vector2(left + 30, y + 4));
      for (const std::string& line : wrap(out, text, plain, kLegendWidth - 42)) {
        out.text({text_left, y + 9}, line, plain);
        y += kLine;
      }
      if (!detail.empty()) {
        out.text({text_left, y + 7}, detail, small);
        y += kLine;
      }
      y += kEntryGap;
    };
    std::size_t shown = 0;
    for (const auto& [session, ids] : sessions_) {
      if (++shown > 8) {
        entry("and " + counted(sessions_.size() - 8, "more session"), "", [](const Vector2&, const Vector2&) {});
        break;
      }
      const auto name = picture_.session_names.find(session);
      const Colour full = colour(session);
      entry(name == picture_.session_names.end() ? "session " + std::to_string(session) : name->second,
            counted(ids.size(), "keyframe") + ", light to dark", [&](const Vector2& a, const Vector2& b) {
              for (int k = 0; k < 10; ++k)
                out.line(a + (b - a) * (k / 10.0), a + (b - a) * ((k + 1) / 10.0),
                         {mix(mix(full, kWhite, 0.5), full, (k + 0.5) / 10), 3.4, 1, 0});
            });
    }
    for (auto style = kLoopStyles.rbegin(); style != kLoopStyles.rend(); ++style) {
      const auto count = std::count_if(picture_.edges.begin(), picture_.edges.end(), [&](const MapPicture::Edge& e) {
        return e.kind == style->kind && frames_.contains(e.a) && frames_.contains(e.b);
      });
      if (count == 0) continue;
      entry(counted(static_cast<std::size_t>(count), style->name), "", [&](const Vector2& a, const Vector2& b) {
        out.line(a, b, style->stroke);
        out.disc(a, 3.2, style->stroke.colour, 0, kWhite);
        out.disc(b, 3.2, style->stroke.colour, 0, kWhite);
      });
    }
    if (picture_.route)
      entry(picture_.route->caption.empty() ? "route" : picture_.route->caption, "",
            [&](const Vector2& a, const Vector2& b) {
              out.line(a, b, {kRoute, 13, 0.75, 0});
            });
    if (picture_.query)
      entry(picture_.query->caption.empty() ? "query" : picture_.query->caption, "",
            [&](const Vector2& a, const Vector2& b) {
              query_marker(out, 0.7 * a + 0.3 * b, {20, 0});
            });
    const Colour first = sessions_.empty() ? kInk : colour(sessions_.begin()->first);
    entry("start and end", "", [&](const Vector2& a, const Vector2& b) {
      out.disc(a + Vector2(5, 0), 6.5, kWhite, 3, first);
      out.disc(b - Vector2(5, 0), 7.5, first, 2, kWhite);
    });
  }

  const MapPicture& picture_;
  double header_, area_width_;
  MapPlan plan_;
  Box area_;
  Vector2 shift_;
  std::unordered_map<FrameId, const MapPicture::Frame*> frames_;
  std::map<SessionNumber, std::vector<FrameId>> sessions_;      // frames, ascending
  std::unordered_map<FrameId, const MapPicture::Edge*> steps_;  // motion edges by their newer frame
};

}  // namespace

std::vector<MapPicture::Frame> side_by_side(const Relaxation& relaxation) {
  struct Extent {
    double low = 1e300, high = -1e300, near = 1e300;
    std::size_t frames = 0;
    int component = 0;
  };
  std::vector<Extent> extents(static_cast<std::size_t>(relaxation.components));
  for (std::size_t k = 0; k < extents.size(); ++k) extents[k].component = static_cast<int>(k);
  for (const RelaxedPose& pose : relaxation.poses) {
    Extent& e = extents[static_cast<std::size_t>(pose.component)];
    e.low = std::min(e.low, pose.T_component_frame.t.x());
    e.high = std::max(e.high, pose.T_component_frame.t.x());
    e.near = std::min(e.near, pose.T_component_frame.t.z());
    ++e.frames;
  }
  std::vector<Extent> order = extents;
  std::stable_sort(order.begin(), order.end(), [](const Extent& a, const Extent& b) { return a.frames > b.frames; });
  std::vector<Vector3> shift(extents.size(), Vector3::Zero());
  double x = 0, widest = 0;
  for (const Extent& e : order) widest = std::max(widest, e.high - e.low);
  for (const Extent& e : order) {
    shift[static_cast<std::size_t>(e.component)] = Vector3(x - e.low, 0, -e.near);
    x += e.high - e.low + std::max(2.0, 0.1 * widest);
  }
  std::vector<MapPicture::Frame> out;
  for (const RelaxedPose& pose : relaxation.poses) {
    SE3 T = pose.T_component_frame;
    if (relaxation.components > 1) T.t += shift[static_cast<std::size_t>(pose.component)];
    out.push_back({pose.frame, T});
  }
  return out;
}

Status write_map_picture(const MapPicture& picture, const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending != ".svg" && ending != ".png")
    return {Reason::INVALID_ARGUMENT, path + " ends neither in .svg nor in .png"};
  if (picture.frames.empty()) return {Reason::EMPTY_MAP, "there is no frame to draw"};
  for (const MapPicture::Frame& f : picture.frames)
    if (!f.T_picture_frame.t.allFinite() || !f.T_picture_frame.R.allFinite())
      return {Reason::INVALID_ARGUMENT, "the pose of frame " + f.id.to_string() + " is not finite"};
  if (picture.query && !(picture.query->T_picture_query.t.allFinite() && picture.query->T_picture_query.R.allFinite()))
    return {Reason::INVALID_ARGUMENT, "the pose of the query is not finite"};
  if (!(picture.width >= 600 && picture.width <= 4000 && picture.png_scale >= 0.5 && picture.png_scale <= 4))
    return {Reason::INVALID_ARGUMENT, "the page must be 600 .. 4000 points wide, of 0.5 .. 4 pixels each"};
  Composer composer(picture);
  const auto drawing = ending == ".svg" ? make_svg_drawing(picture.width, composer.height(), kPaper)
                                        : make_png_drawing(picture.width, composer.height(), kPaper, picture.png_scale);
  composer.draw(*drawing);
  return drawing->save(path);
}

}  // namespace relmap
